// An address at which some of the coordinator's services are offered.
//
// Each listener is a gRPC server of its own with its own health, so that one for workers offers
// nothing that is for clients. Health says NOT_SERVING while there are no descriptors for
// connections.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <grpcpp/grpcpp.h>

#include "render/base/certificate.h"
#include "render/base/clock.h"
#include "render/base/mutex.h"
#include "render/base/status.h"
#include "server/acceptor.h"
#include "server/access.h"
#include "server/call_latencies.h"

namespace lucerna {

class Listener {
 public:
  struct Options {
    std::string address;                   // "host:port"; port 0: a free one
    TlsFiles tls;                          // empty: in the clear
    const Access* access = nullptr;        // outlives the listener
    std::vector<grpc::Service*> services;  // outlive the listener
    std::size_t max_connections_per_address = 16384;
    CallLatencies* latencies = nullptr;  // outlives the listener; nullptr: are not measured
  };
  // Errors: UNAVAILABLE when it cannot listen there.
  [[nodiscard]] static StatusOr<std::unique_ptr<Listener>> Start(const Options& options);

  // "host:port", with the port that it has.
  [[nodiscard]] const std::string& address() const { return address_; }

  // Health says NOT_SERVING, so that nothing new comes.
  void StopServing();
  // Calls that are under way have `time` to end. Waits for them.
  void Shutdown(Duration time);

 private:
  Listener() = default;

  std::string address_;
  std::unique_ptr<Acceptor> acceptor_;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> hand_over_;
  std::unique_ptr<grpc::Server> server_;
  Mutex mutex_;
  bool is_ending_ LUCERNA_GUARDED_BY(mutex_) = false;
};

}  // namespace lucerna
