// How do two processes of the house hold their connection?
//
// Both sides ping a silent connection, so that a machine that vanished is noticed within about
// half a minute, and both bound what they receive. Traffic is not encrypted: a coordinator
// listens on loopback unless its administrator says otherwise.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include <grpcpp/grpcpp.h>

#include "render/base/clock.h"

namespace lucerna {

// A manifest of 20,000 files is about 3 MiB; everything longer is cut into chunks.
inline constexpr int kMaxMessageBytes = 16 << 20;

// The deadline of a call that needs no waiting on the other side.
inline constexpr std::chrono::seconds kCallTime{30};

// `time` from now, as gRPC expects it.
[[nodiscard]] std::chrono::system_clock::time_point DeadlineIn(Duration time);

// A channel to `address` ("host:port"). Does not connect yet, and connects again by itself.
[[nodiscard]] std::shared_ptr<grpc::Channel> MakeChannel(const std::string& address);

// The same agreement for a server.
void SetUpConnections(grpc::ServerBuilder& builder);

// Whether `address` is "host:port" with a host and a port from 0 to 65535. gRPC would take a larger
// port for another one, and say of no port that the name is unknown.
[[nodiscard]] bool IsAddress(const std::string& address);

// Whether `address` ("host:port") can be reached from this machine only.
[[nodiscard]] bool IsLoopback(const std::string& address);

}  // namespace lucerna
