// What does gRPC do for a whole process: where do its log lines go, and when does it end?
//
// gRPC writes to the standard error by itself, in its own form, and repeats what a failed call
// says. When its last object goes, it ends its threads, for which it may wait ten seconds for a
// poll in which nothing happens any more.
#pragma once

#include <string>

namespace lucerna {

// Before gRPC is used otherwise.
void IgnoreGrpcLog();

// Hands gRPC's errors to `on_error`. Threads: `on_error` is called from any, several
// at once.
void TakeGrpcErrors(void (*on_error)(const std::string& message));

// From now on gRPC's threads stay until the process ends. They begin here, so signals that others
// wait for are blocked before.
void KeepGrpc();

}  // namespace lucerna
