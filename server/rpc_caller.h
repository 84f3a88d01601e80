// Does the caller of an RPC still wait for its answer?
#pragma once

#include <grpcpp/grpcpp.h>

#include "server/work_pool.h"

namespace lucerna {

// CANCELLED when the caller has left or the call's deadline has passed, which gRPC makes one. To be
// asked before the call's OnDone.
[[nodiscard]] inline StillNeeded NeededByCaller(const grpc::CallbackServerContext* context) {
  return [context]() -> Status {
    if (!context->IsCancelled()) return absl::OkStatus();
    return absl::CancelledError("the caller does not wait for the answer any more");
  };
}

}  // namespace lucerna
