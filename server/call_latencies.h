// How long do the coordinator's calls take, by method?
//
// A gRPC interceptor that sees each call begin and end. Calls that wait on purpose (Sync, Watch)
// take as long as they wait.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include <grpcpp/support/server_interceptor.h>

#include "render/base/clock.h"
#include "render/base/latency_counts.h"
#include "render/base/mutex.h"

namespace lucerna {

class CallLatencies {
 public:
  // Both outlive all calls.
  explicit CallLatencies(const Clock& clock) : clock_(clock) {}

  // To be given to each server.
  [[nodiscard]] std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> Factory();
  // Each method that was called.
  void ForEach(
      const std::function<void(const std::string& method, const LatencyCounts&)>& visit) const;

 private:
  class Factories;
  class Call;
  // Only methods that there are have calls: there are few.
  LatencyCounts& CountsOf(const char* method);

  const Clock& clock_;
  mutable Mutex mutex_;
  std::map<std::string, std::unique_ptr<LatencyCounts>> counts_ LUCERNA_GUARDED_BY(mutex_);
};

}  // namespace lucerna
