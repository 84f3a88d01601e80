#include "server/acceptor.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/base/clock.h"

namespace lucerna {
namespace {

constexpr int kTickMs = 100;
constexpr int kBacklog = 1024;
constexpr int kSweepEvery = 1024;  // connections, so that addresses that left are forgotten
constexpr rlim_t kMostDescriptors = rlim_t{1} << 20;

Status SystemError(const std::string& what) {
  return absl::UnavailableError(absl::StrCat(what, ": ", std::strerror(errno)));
}

int SoftLimit() {
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  return static_cast<int>(std::min(limit.rlim_cur, kMostDescriptors));
}

// Numeric, without the port.
std::string HostOf(const sockaddr_storage& address, socklen_t size) {
  std::array<char, NI_MAXHOST> host{};
  const int error = ::getnameinfo(reinterpret_cast<const sockaddr*>(&address), size, host.data(),
                                  host.size(), nullptr, 0, NI_NUMERICHOST);
  return error == 0 ? host.data() : "";
}

int PortOf(const sockaddr_storage& address) {
  return ntohs(address.ss_family == AF_INET6
                   ? reinterpret_cast<const sockaddr_in6&>(address).sin6_port
                   : reinterpret_cast<const sockaddr_in&>(address).sin_port);
}

}  // namespace

void RaiseDescriptorLimit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= limit.rlim_max) return;
  limit.rlim_cur = std::min(limit.rlim_max, std::max(limit.rlim_cur, kMostDescriptors));
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

StatusOr<std::unique_ptr<Acceptor>> Acceptor::Listen(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  std::string host = address.substr(0, colon);
  std::string port = address.substr(colon + 1);
  if (host.size() >= 2 && host.front() == '[') host = host.substr(1, host.size() - 2);
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(host.c_str(), port.c_str(), &hints, &found); error != 0) {
    return absl::UnavailableError(absl::StrCat(host, ": ", gai_strerror(error)));
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> all(found, &::freeaddrinfo);
  auto acceptor = std::unique_ptr<Acceptor>(new Acceptor);
  Status failure = absl::UnavailableError(absl::StrCat(host, ": no address"));
  for (const addrinfo* each = found; each != nullptr; each = each->ai_next) {
    const int listener = ::socket(each->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (listener < 0) {
      failure = SystemError(address);
      continue;
    }
    // Restarted at once; a port that another process listens on is refused all the same.
    const int yes = 1;
    const int no = 0;
    ::setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
    sockaddr_storage bound{};
    std::memcpy(&bound, each->ai_addr, each->ai_addrlen);
    if (each->ai_family == AF_INET6) {
      // "[::]" is every address of the machine, of both kinds.
      ::setsockopt(listener, IPPROTO_IPV6, IPV6_V6ONLY, &no, sizeof(no));
      // All addresses of one name have one port.
      if (acceptor->port_ != 0) {
        reinterpret_cast<sockaddr_in6&>(bound).sin6_port =
            htons(static_cast<std::uint16_t>(acceptor->port_));
      }
    } else if (acceptor->port_ != 0) {
      reinterpret_cast<sockaddr_in&>(bound).sin_port =
          htons(static_cast<std::uint16_t>(acceptor->port_));
    }
    socklen_t size = each->ai_addrlen;
    if (::bind(listener, reinterpret_cast<const sockaddr*>(&bound), size) != 0 ||
        ::listen(listener, kBacklog) != 0 ||
        ::getsockname(listener, reinterpret_cast<sockaddr*>(&bound), &size) != 0) {
      failure = SystemError(address);
      ::close(listener);
      continue;
    }
    acceptor->port_ = PortOf(bound);
    acceptor->listeners_.push_back(listener);
  }
  if (acceptor->listeners_.empty()) return failure;
  return acceptor;
}

Acceptor::~Acceptor() {
  Stop();
  for (const int listener : listeners_)
    ::close(listener);
}

void Acceptor::Start(Options options) {
  options_ = std::move(options);
  thread_ = std::thread([this] { Run(); });
}

void Acceptor::Stop() {
  is_stopped_ = true;
  if (thread_.joinable()) thread_.join();
}

int Acceptor::FirstSpare() const {
  return std::max(SoftLimit() - options_.spare_descriptors, 0);
}

void Acceptor::SetScarce(bool is_scarce) {
  if (is_scarce_ == is_scarce) return;
  is_scarce_ = is_scarce;
  if (is_scarce) {
    spdlog::error(
        "connections are refused: of the {} descriptors that this process may have, all but {} "
        "spare ones are used; raise the limit (ulimit -n)",
        SoftLimit(), options_.spare_descriptors);
  } else {
    spdlog::info("connections are accepted again: there are free descriptors");
  }
  options_.on_scarce(is_scarce);
}

void Acceptor::Run() {
  std::vector<pollfd> ready;
  for (const int listener : listeners_)
    ready.push_back({listener, POLLIN, 0});
  while (!is_stopped_) {
    if (::poll(ready.data(), ready.size(), kTickMs) > 0) {
      for (const pollfd& listener : ready) {
        if ((listener.revents & POLLIN) != 0) Take(listener.fd);
      }
    }
    if (is_scarce_) {
      // The system gives the lowest number that is free.
      const int probe = ::fcntl(listeners_.front(), F_DUPFD_CLOEXEC, 0);
      if (probe >= 0) ::close(probe);
      if (probe >= 0 && probe < FirstSpare()) SetScarce(false);
    }
  }
}

void Acceptor::Take(int listener) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  const int connection = ::accept4(listener, reinterpret_cast<sockaddr*>(&address), &size,
                                   SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (connection < 0) {
    // What others use meanwhile (EMFILE, ENFILE, ENOMEM) may be free soon; the connection waits.
    if (errno == EMFILE || errno == ENFILE) {
      SetScarce(true);
      std::this_thread::sleep_for(std::chrono::milliseconds(kTickMs));
    }
    return;
  }
  if (connection >= FirstSpare()) {
    ::close(connection);
    SetScarce(true);
    return;
  }
  const std::string peer = HostOf(address, size);
  if (IsFull(peer)) {
    ::close(connection);
    return;
  }
  struct stat facts {};
  ::fstat(connection, &facts);
  connections_[peer].push_back({connection, facts.st_ino});
  const int one = 1;
  ::setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &one, sizeof(one));
  options_.on_connection(listener, connection);
}

void Acceptor::DropClosed(std::vector<Open>& connections) {
  // Closed without a word: their number is another file by now, or none.
  std::erase_if(connections, [](const Open& connection) {
    struct stat facts {};
    return ::fstat(connection.descriptor, &facts) != 0 || facts.st_ino != connection.inode;
  });
}

bool Acceptor::IsFull(const std::string& peer) {
  if (++accepted_since_sweep_ >= kSweepEvery) {
    accepted_since_sweep_ = 0;
    for (auto& [address, open] : connections_)
      DropClosed(open);
    std::erase_if(connections_, [](const auto& each) { return each.second.empty(); });
  }
  std::vector<Open>& open = connections_[peer];
  if (open.size() < options_.max_connections_per_address) return false;
  DropClosed(open);
  if (open.size() < options_.max_connections_per_address) return false;
  static SteadyTime said_at;
  const SteadyTime now = SystemClock().Steady();
  if (now - said_at > std::chrono::seconds(10)) {
    said_at = now;
    spdlog::warn("connections of {} are refused: it has {} already (--max-connections)", peer,
                 open.size());
  }
  return true;
}

}  // namespace lucerna
