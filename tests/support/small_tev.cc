#include "tests/support/small_tev.h"

#include <cstdint>
#include <cstring>

#include "gtest/gtest.h"
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace lucerna {

SmallTev::SmallTev() : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  EXPECT_EQ(::listen(socket_, 1), 0);
  socklen_t size = sizeof(address);
  ::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size);
  address_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  thread_ = std::thread([this] {
    const int connection = ::accept(socket_, nullptr, nullptr);
    char bytes[65536];
    for (ssize_t got = 0; (got = ::read(connection, bytes, sizeof(bytes))) > 0;)
      received_.append(bytes, static_cast<std::size_t>(got));
    ::close(connection);
  });
}

SmallTev::~SmallTev() {
  // Ends a wait for a connection.
  ::shutdown(socket_, SHUT_RDWR);
  if (thread_.joinable()) thread_.join();
  ::close(socket_);
}

const std::string& SmallTev::Received() {
  if (thread_.joinable()) thread_.join();
  return received_;
}

std::map<int, std::vector<std::string>> SmallTev::Packets() {
  const std::string& received = Received();
  std::map<int, std::vector<std::string>> packets;
  for (std::size_t at = 0; at + 5 <= received.size();) {
    std::uint32_t length = 0;
    std::memcpy(&length, &received[at], 4);
    EXPECT_LE(at + length, received.size()) << "a packet is cut off";
    if (length < 5) {
      ADD_FAILURE() << "a packet of " << length << " bytes";
      break;
    }
    packets[received[at + 4]].push_back(received.substr(at, length));
    at += length;
  }
  return packets;
}

}  // namespace lucerna
