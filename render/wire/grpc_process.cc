#include "render/wire/grpc_process.h"

#include <grpc/grpc.h>
#include <grpc/support/log.h>

namespace lucerna {
namespace {

// gRPC's log function has no argument of its own; set before gRPC runs.
void (*error_sink)(const std::string& message) = nullptr;

}  // namespace

void IgnoreGrpcLog() {
  gpr_set_log_function([](gpr_log_func_args* /*line*/) {});
}

void TakeGrpcErrors(void (*on_error)(const std::string& message)) {
  error_sink = on_error;
  gpr_set_log_function([](gpr_log_func_args* line) {
    if (line->severity == GPR_LOG_SEVERITY_ERROR) error_sink(line->message);
  });
}

void KeepGrpc() {
  // Never undone, so that no object is the last one.
  [[maybe_unused]] static const bool is_kept = [] {
    grpc_init();
    return true;
  }();
}

}  // namespace lucerna
