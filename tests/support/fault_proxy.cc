#include "tests/support/fault_proxy.h"

#include <algorithm>
#include <array>
#include <deque>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "render/base/status.h"

namespace lucerna {
namespace {

using LineClock = std::chrono::steady_clock;
constexpr int kPollMs = 5;
constexpr std::size_t kReadBytes = std::size_t{16} << 10;
// What may be on the line at one time, besides what its delay keeps there.
constexpr std::size_t kMostWaiting = std::size_t{256} << 10;

sockaddr_in Loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

int NewSocket() {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  LUCERNA_CHECK(socket >= 0);
  return socket;
}

// Bytes that have come, and when they may go on.
struct Late {
  LineClock::time_point due;
  std::vector<char> bytes;
};

bool SendAll(int to, const std::vector<char>& bytes, std::size_t count) {
  std::size_t sent = 0;
  while (sent < count) {
    const ssize_t done = ::send(to, bytes.data() + sent, count - sent, MSG_NOSIGNAL);
    if (done <= 0) return false;
    sent += static_cast<std::size_t>(done);
  }
  return true;
}

}  // namespace

FaultProxy::FaultProxy(const std::string& target) {
  target_port_ = std::stoi(target.substr(target.rfind(':') + 1));
  listener_ = NewSocket();
  sockaddr_in address = Loopback(0);
  socklen_t size = sizeof(address);
  LUCERNA_CHECK(::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) == 0);
  LUCERNA_CHECK(::listen(listener_, 64) == 0);
  LUCERNA_CHECK(::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) == 0);
  address_ = absl::StrCat("127.0.0.1:", ntohs(address.sin_port));
  accepting_ = std::thread([this] { Accept(); });
}

FaultProxy::~FaultProxy() {
  is_ending_ = true;
  accepting_.join();
  Cut();
  for (Connection& connection : open_) {
    connection.there.join();
    connection.back.join();
    ::close(connection.client);
    ::close(connection.server);
  }
  ::close(listener_);
}

void FaultProxy::Cut() {
  const std::lock_guard lock(mutex_);
  // The threads see the end; the descriptors stay theirs until they have been joined.
  for (const Connection& connection : open_) {
    ::shutdown(connection.client, SHUT_RDWR);
    ::shutdown(connection.server, SHUT_RDWR);
  }
}

void FaultProxy::Accept() {
  while (!is_ending_) {
    pollfd ready = {listener_, POLLIN, 0};
    if (::poll(&ready, 1, kPollMs) <= 0) continue;
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) continue;
    const int server = NewSocket();
    const sockaddr_in target = Loopback(target_port_);
    if (::connect(server, reinterpret_cast<const sockaddr*>(&target), sizeof(target)) != 0) {
      ::close(client);
      ::close(server);
      continue;
    }
    const int one = 1;
    for (const int socket : {client, server})
      ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &one, sizeof(one));
    ++connections_;
    const std::lock_guard lock(mutex_);
    Connection& connection = open_.emplace_back();
    connection.client = client;
    connection.server = server;
    connection.there = std::thread([this, client, server] { Carry(client, server); });
    connection.back = std::thread([this, client, server] { Carry(server, client); });
  }
}

void FaultProxy::Carry(int from, int to) {
  std::deque<Late> line;
  std::size_t waiting = 0;
  LineClock::time_point free_at = LineClock::now();  // when the line has sent what it was given
  std::int64_t until_flip = flip_every_;
  bool is_open = true;
  while (!is_ending_ && (is_open || !line.empty())) {
    const std::int64_t rate = bytes_per_s_;
    const bool has_room =
        waiting < (rate > 0 ? std::min<std::size_t>(kMostWaiting, static_cast<std::size_t>(rate))
                            : kMostWaiting);
    pollfd ready = {from, POLLIN, 0};
    if (is_open && has_room && ::poll(&ready, 1, line.empty() ? kPollMs : 1) > 0) {
      std::vector<char> bytes(kReadBytes);
      const ssize_t got = ::recv(from, bytes.data(), bytes.size(), 0);
      if (got <= 0) {
        is_open = false;
      } else if (!swallows_) {
        bytes.resize(static_cast<std::size_t>(got));
        if (const std::int64_t every = flip_every_; every > 0) {
          if (until_flip <= 0) until_flip = every;
          for (; until_flip <= static_cast<std::int64_t>(bytes.size()); until_flip += every) {
            bytes[static_cast<std::size_t>(until_flip - 1)] ^= 0x10;
            ++flips_;
          }
          until_flip -= static_cast<std::int64_t>(bytes.size());
        }
        const auto now = LineClock::now();
        if (rate > 0) {
          free_at =
              std::max(free_at, now) +
              std::chrono::microseconds(static_cast<std::int64_t>(bytes.size()) * 1'000'000 / rate);
        } else {
          free_at = now;
        }
        waiting += bytes.size();
        line.push_back({free_at + std::chrono::milliseconds(delay_ms_), std::move(bytes)});
      }
    } else if (!has_room || !is_open) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    while (!line.empty() && line.front().due <= LineClock::now()) {
      const std::vector<char> bytes = std::move(line.front().bytes);
      line.pop_front();
      waiting -= bytes.size();
      if (swallows_) continue;
      if (!SendAll(to, bytes, bytes.size())) {
        is_open = false;
        line.clear();
        break;
      }
      bytes_ += static_cast<std::int64_t>(bytes.size());
    }
  }
  // A cut or an end in one direction ends both.
  ::shutdown(to, SHUT_RDWR);
  ::shutdown(from, SHUT_RDWR);
}

}  // namespace lucerna
