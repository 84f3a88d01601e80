#include "render/wire/channel.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <grpcpp/support/client_interceptor.h>

#include "render/wire/grpc_process.h"

namespace lucerna {
namespace {

// A machine that vanished is noticed within about half a minute. An answer to a ping waits behind
// what has been written before it: on a slow line megabytes, so connections with bytes in bulk, and
// a server, which has both kinds, have longer.
constexpr int kPingEveryMs = 10'000;
constexpr int kPongWithinMs = 20'000;
constexpr int kBulkPingEveryMs = 30'000;
constexpr int kBulkPongWithinMs = 180'000;
// A server must allow pings somewhat more often than clients send them, or it hangs up.
constexpr int kPingAllowedEveryMs = 5'000;
// One attempt: several round trips of seconds, and the TLS handshake.
constexpr int kConnectMs = 20'000;
// Between attempts to connect, with gRPC's jitter: soon, because a coordinator that starts is up
// within a second.
constexpr int kFirstBackoffMs = 100;
constexpr int kLongestBackoffMs = 2'000;
// After a failure gRPC asks for the address again before it connects, and by itself not sooner than
// after 30 s.
constexpr int kResolveEveryMs = 500;
// How often certificates are looked at.
constexpr unsigned int kRereadEveryS = 2;

// Of one connection: a program that watches a thousand jobs needs no other.
constexpr int kMostStreams = 4096;

constexpr std::size_t kMaxTokenBytes = 4096;

// Adds the token to every call. gRPC's own way to do so refuses connections in the clear, loopback
// among them.
class TokenInterceptor final : public grpc::experimental::Interceptor {
 public:
  explicit TokenInterceptor(const std::string& header) : header_(header) {}
  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    using grpc::experimental::InterceptionHookPoints;
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_INITIAL_METADATA)) {
      methods->GetSendInitialMetadata()->insert({"authorization", header_});
    }
    methods->Proceed();
  }

 private:
  const std::string& header_;
};

class TokenInterceptorFactory final : public grpc::experimental::ClientInterceptorFactoryInterface {
 public:
  explicit TokenInterceptorFactory(const std::string& token)
      : header_(absl::StrCat("Bearer ", token)) {}
  grpc::experimental::Interceptor* CreateClientInterceptor(
      grpc::experimental::ClientRpcInfo* /*info*/) override {
    return new TokenInterceptor(header_);
  }

 private:
  const std::string header_;
};

std::shared_ptr<grpc::experimental::CertificateProviderInterface> Certificates(
    const TlsFiles& files) {
  return std::make_shared<grpc::experimental::FileWatcherCertificateProvider>(
      files.key, files.certificate, files.authority, kRereadEveryS);
}

std::shared_ptr<grpc::ChannelCredentials> MakeChannelCredentials(const TlsFiles& tls) {
  if (tls.empty()) return grpc::InsecureChannelCredentials();
  grpc::experimental::TlsChannelCredentialsOptions options;
  options.set_certificate_provider(Certificates(tls));
  options.watch_root_certs();
  options.watch_identity_key_cert_pairs();
  return grpc::experimental::TlsCredentials(options);
}

bool Contains(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

Status CheckSecurity(const Endpoint& endpoint) {
  const bool has_tls = !endpoint.tls.empty();
  if (has_tls) {
    LUCERNA_RETURN_IF_ERROR(CheckTlsFiles(endpoint.tls, SystemClock().Wall()).status());
  }
  if (endpoint.token.empty()) return absl::OkStatus();
  const auto is_token_byte = [](char c) { return c > 0x20 && c < 0x7f; };
  if (endpoint.token.size() > kMaxTokenBytes ||
      !std::ranges::all_of(endpoint.token, is_token_byte)) {
    return absl::InvalidArgumentError(
        "the token is not one line of printable characters; lucerna token new makes one");
  }
  if (!has_tls && !IsLoopback(endpoint.address)) {
    return absl::InvalidArgumentError(
        absl::StrCat("the token would be readable on the way to ", endpoint.address,
                     "; give --tls-ca, --tls-cert and --tls-key, or leave the token away"));
  }
  return absl::OkStatus();
}

std::shared_ptr<grpc::Channel> MakeChannel(const Endpoint& endpoint, Traffic traffic) {
  const bool is_bulk = traffic == Traffic::kBulk;
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, is_bulk ? kBulkPingEveryMs : kPingEveryMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, is_bulk ? kBulkPongWithinMs : kPongWithinMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kFirstBackoffMs);
  // Despite its name the time that one attempt has.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kConnectMs);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kLongestBackoffMs);
  arguments.SetInt(GRPC_ARG_DNS_MIN_TIME_BETWEEN_RESOLUTIONS_MS, kResolveEveryMs);
  // A proxy meant for the web would be asked for addresses of this network, loopback among them.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // gRPC would lead channels with the same arguments over one connection.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>> interceptors;
  if (!endpoint.token.empty()) {
    interceptors.push_back(std::make_unique<TokenInterceptorFactory>(endpoint.token));
  }
  KeepGrpc();
  return grpc::experimental::CreateCustomChannelWithInterceptors(
      endpoint.address, MakeChannelCredentials(endpoint.tls), arguments, std::move(interceptors));
}

std::string ExplainTls(const Endpoint& endpoint, const std::string& grpc_message) {
  const bool is_ended =
      Contains(grpc_message, "failed to connect") &&
      (Contains(grpc_message, "Socket closed") || Contains(grpc_message, "Connection reset"));
  if (endpoint.tls.empty()) {
    return is_ended ? absl::StrCat("the coordinator at ", endpoint.address,
                                   " ended the connection at once; if it uses TLS, give --tls-ca, "
                                   "--tls-cert and --tls-key")
                    : "";
  }
  if (Contains(grpc_message, "certificate verify failed")) {
    return absl::StrCat("the certificate of the coordinator at ", endpoint.address,
                        " is not of the authority in --tls-ca ", endpoint.tls.authority,
                        ", or it has expired");
  }
  if (Contains(grpc_message, "Hostname Verification")) {
    return absl::StrCat("the certificate of the coordinator at ", endpoint.address,
                        " is for another host; it must name this one");
  }
  if (Contains(grpc_message, "wrong version number")) {
    return absl::StrCat("the coordinator at ", endpoint.address,
                        " does not use TLS; start it with --tls-ca, --tls-cert and --tls-key");
  }
  // TLS 1.3: the coordinator judges this side's certificate when the handshake is over here.
  if (is_ended) {
    return absl::StrCat("the coordinator at ", endpoint.address,
                        " ended the connection: it does not accept the certificate in --tls-cert ",
                        endpoint.tls.certificate, ", which must be of its authority and valid");
  }
  return "";
}

std::chrono::system_clock::time_point DeadlineIn(Duration time) {
  return std::chrono::time_point_cast<std::chrono::system_clock::duration>(SystemClock().Wall() +
                                                                           time);
}

void SetUpConnections(grpc::ServerBuilder& builder) {
  builder.SetMaxReceiveMessageSize(kMaxMessageBytes);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kBulkPingEveryMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kBulkPongWithinMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS,
                             kPingAllowedEveryMs);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMostStreams);
}

std::shared_ptr<grpc::ServerCredentials> MakeServerCredentials(const TlsFiles& tls,
                                                               bool has_tokens) {
  if (tls.empty()) {
    // On the wire the same as no credentials.
    return has_tokens ? grpc::experimental::LocalServerCredentials(LOCAL_TCP)
                      : grpc::InsecureServerCredentials();
  }
  grpc::experimental::TlsServerCredentialsOptions options(Certificates(tls));
  options.watch_root_certs();
  options.watch_identity_key_cert_pairs();
  options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  return grpc::experimental::TlsServerCredentials(options);
}

bool IsAddress(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0) return false;
  std::uint16_t port = 0;
  const char* const end = address.data() + address.size();
  const auto [stopped, error] = std::from_chars(address.data() + colon + 1, end, port);
  return error == std::errc() && stopped == end;
}

bool IsLoopback(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  std::string host = address.substr(0, colon);
  if (host.size() >= 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  if (host == "localhost" || host == "::1") return true;
  in_addr parsed{};
  return inet_pton(AF_INET, host.c_str(), &parsed) == 1 && (ntohl(parsed.s_addr) >> 24) == 127;
}

}  // namespace lucerna
