// How do two of the project's processes hold their connection?
//
// Both sides ping a silent connection, so that a machine that vanished is noticed, and both bound
// what they receive. With TLS both sides show certificates; a program's files are read again when
// they change, and connections that exist stay. In the clear a coordinator listens on loopback
// unless its administrator says otherwise, and tokens travel over TLS or loopback only.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include <grpcpp/grpcpp.h>

#include "render/base/certificate.h"
#include "render/base/clock.h"
#include "render/base/status.h"

namespace lucerna {

// A manifest of 20,000 files is about 3 MiB; everything longer is cut into chunks.
inline constexpr int kMaxMessageBytes = 16 << 20;

// The deadline of a call that needs no waiting on the other side. A round trip may take seconds.
inline constexpr std::chrono::seconds kCallTime{30};

// `time` from now, as gRPC expects it.
[[nodiscard]] std::chrono::system_clock::time_point DeadlineIn(Duration time);

// Where a coordinator is, and what a program shows it.
struct Endpoint {
  std::string address;     // "host:port"
  TlsFiles tls = {};       // empty: in the clear
  std::string token = {};  // empty: none
};

// Errors: INVALID_ARGUMENT or NOT_FOUND, one sentence: what CheckTlsFiles says, or a token that
// would travel in the clear beyond this machine, or one that is no token.
[[nodiscard]] Status CheckSecurity(const Endpoint& endpoint);

// What a connection carries: messages that must be punctual wait for no others, so bytes in bulk
// have a connection of their own, which may be silent for long.
enum class Traffic : std::uint8_t { kMessages, kBulk };

// Does not connect yet, and connects again by itself, with growing pauses of a few seconds at most.
// Every call carries the endpoint's token.
[[nodiscard]] std::shared_ptr<grpc::Channel> MakeChannel(const Endpoint& endpoint,
                                                         Traffic traffic = Traffic::kMessages);

// In the clear and without a token.
[[nodiscard]] inline std::shared_ptr<grpc::Channel> MakeChannel(const std::string& address) {
  return MakeChannel(Endpoint{address});
}

// What to say of a connection that could not be made, from what gRPC says of it
// (`grpc_message`): a sentence where TLS, or its absence, is the cause; else empty.
[[nodiscard]] std::string ExplainTls(const Endpoint& endpoint, const std::string& grpc_message);

// The same agreement for a server.
void SetUpConnections(grpc::ServerBuilder& builder);

// For a server: with TLS, clients must show a certificate of the authority.
// A server that is to look at tokens sets an AuthMetadataProcessor: it needs `has_tokens`, because
// credentials in the clear have none; those with one are for connections from this machine only.
[[nodiscard]] std::shared_ptr<grpc::ServerCredentials> MakeServerCredentials(const TlsFiles& tls,
                                                                             bool has_tokens);

// Whether `address` is "host:port" with a host and a port from 0 to 65535. gRPC would take a larger
// port for another one, and say of no port that the name is unknown.
[[nodiscard]] bool IsAddress(const std::string& address);

// Whether `address` ("host:port") can be reached from this machine only.
[[nodiscard]] bool IsLoopback(const std::string& address);

}  // namespace lucerna
