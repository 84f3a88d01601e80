// Who gets a connection?
//
// Accepts connections itself and hands them to gRPC. gRPC's own listener stops for good when the
// process has no descriptor left for a connection; this one closes the connection instead, keeps
// some descriptors for the coordinator's files, and takes connections again when there are enough.
// It also bounds how many connections one address has, so that no machine can take them all.
//
// Threads: one of its own, which calls back.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <sys/types.h>

#include "render/base/status.h"

namespace lucerna {

// Takes as many descriptors as the system allows this process without asking anybody.
void RaiseDescriptorLimit();

class Acceptor {
 public:
  struct Options {
    // A farm behind one address has two connections for each worker.
    std::size_t max_connections_per_address = 16384;
    // Not for connections: files of jobs, gRPC's own.
    int spare_descriptors = 48;
    // A connection that was accepted; the callee closes it.
    std::function<void(int listener, int connection)> on_connection;
    // Whether descriptors are used up; called when that changes.
    std::function<void(bool is_scarce)> on_scarce;
  };
  // Listens at once, accepts after Start. `address` is "host:port"; port 0: a free one.
  // Errors: UNAVAILABLE, what the system says.
  [[nodiscard]] static StatusOr<std::unique_ptr<Acceptor>> Listen(const std::string& address);
  ~Acceptor();
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

  [[nodiscard]] int port() const { return port_; }
  void Start(Options options);
  // Accepts nothing any more.
  void Stop();

 private:
  // A socket, as long as its number is that of the same file.
  struct Open {
    int descriptor = -1;
    ino_t inode = 0;
  };

  Acceptor() = default;
  void Run();
  void Take(int listener);
  // Whether the address has so many connections that it may have no other.
  bool IsFull(const std::string& peer);
  // Drops the connections that gRPC has closed meanwhile.
  static void DropClosed(std::vector<Open>& connections);
  void SetScarce(bool is_scarce);
  // The first number that is not for connections.
  [[nodiscard]] int FirstSpare() const;

  std::vector<int> listeners_;
  int port_ = 0;
  Options options_;
  std::atomic<bool> is_stopped_ = false;
  bool is_scarce_ = false;
  std::map<std::string, std::vector<Open>> connections_;  // by address without port
  int accepted_since_sweep_ = 0;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace lucerna
