// Where do gRPC's own log lines go?
//
// gRPC writes to the standard error by itself, in its own form, and repeats what a failed call
// says.
#pragma once

#include <string>

namespace lucerna {

// Before gRPC is used otherwise.
void IgnoreGrpcLog();

// Hands gRPC's errors to `on_error`. Threads: `on_error` is called from any, several at once.
void TakeGrpcErrors(void (*on_error)(const std::string& message));

}  // namespace lucerna
