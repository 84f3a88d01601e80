// As much of the viewer tev as receives: one connection, read to its end.
#pragma once

#include <map>
#include <string>
#include <thread>
#include <vector>

namespace lucerna {

// Listens on a free port of this machine until it is destroyed.
class SmallTev {
 public:
  SmallTev();
  ~SmallTev();
  SmallTev(const SmallTev&) = delete;
  SmallTev& operator=(const SmallTev&) = delete;

  [[nodiscard]] const std::string& address() const { return address_; }
  // Waits until the sender has closed the connection.
  [[nodiscard]] const std::string& Received();
  // The same, cut into packets, by operation.
  [[nodiscard]] std::map<int, std::vector<std::string>> Packets();

 private:
  int socket_;
  std::string address_;
  std::string received_;
  std::thread thread_;
};

}  // namespace lucerna
