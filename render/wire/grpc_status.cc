#include "render/wire/grpc_status.h"

#include <string>

namespace lucerna {
namespace {

// gRPC puts a message into a header; one that does not fit breaks the whole call. A scene can
// have a hundred errors, and the first of them say most.
constexpr std::size_t kMaxStatusBytes = 6000;

}  // namespace

grpc::Status ToGrpc(const Status& status) {
  if (status.ok()) return grpc::Status::OK;
  std::string message(status.message());
  if (message.size() > kMaxStatusBytes) {
    message.resize(message.rfind('\n', kMaxStatusBytes) == std::string::npos
                       ? kMaxStatusBytes
                       : message.rfind('\n', kMaxStatusBytes));
    message += "\n(and more)";
  }
  return {static_cast<grpc::StatusCode>(status.code()), std::move(message)};
}

Status FromGrpc(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  return {static_cast<absl::StatusCode>(status.error_code()), status.error_message()};
}

}  // namespace lucerna
