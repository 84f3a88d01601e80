// How does a Status cross a process? Codes and messages are the same on both sides.
#pragma once

#include <grpcpp/support/status.h>

#include "render/base/status.h"

namespace lucerna {

[[nodiscard]] grpc::Status ToGrpc(const Status& status);
[[nodiscard]] Status FromGrpc(const grpc::Status& status);

}  // namespace lucerna
