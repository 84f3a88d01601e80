#include "server/listener.h"

#include <utility>

#include <grpcpp/health_check_service_interface.h>

#include "render/wire/channel.h"

namespace lucerna {

StatusOr<std::unique_ptr<Listener>> Listener::Start(const Options& options) {
  auto listener = std::unique_ptr<Listener>(new Listener);
  LUCERNA_ASSIGN_OR_RETURN(listener->acceptor_, Acceptor::Listen(options.address));
  const std::shared_ptr<grpc::ServerCredentials> credentials =
      MakeServerCredentials(options.tls, options.access->has_tokens());
  if (options.access->has_tokens()) {
    credentials->SetAuthMetadataProcessor(options.access->MakeProcessor());
  }
  grpc::ServerBuilder builder;
  SetUpConnections(builder);
  listener->hand_over_ = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, credentials);
  for (grpc::Service* const service : options.services)
    builder.RegisterService(service);
  if (options.latencies != nullptr) {
    std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> factories;
    factories.push_back(options.latencies->Factory());
    builder.experimental().SetInterceptorCreators(std::move(factories));
  }
  listener->server_ = builder.BuildAndStart();
  if (!listener->server_) return absl::UnavailableError("gRPC cannot be started");
  listener->address_ = absl::StrCat(options.address.substr(0, options.address.rfind(':')), ":",
                                    listener->acceptor_->port());
  listener->acceptor_->Start({
      .max_connections_per_address = options.max_connections_per_address,
      .on_connection =
          [self = listener.get()](int at, int connection) {
            grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters parameters;
            parameters.listener_fd = at;
            parameters.fd = connection;
            self->hand_over_->HandleNewConnection(&parameters);
          },
      .on_scarce =
          [self = listener.get()](bool is_scarce) {
            const MutexLock lock(self->mutex_);
            if (self->is_ending_) return;
            self->server_->GetHealthCheckService()->SetServingStatus(!is_scarce);
          },
  });
  return listener;
}

void Listener::StopServing() {
  const MutexLock lock(mutex_);
  is_ending_ = true;
  server_->GetHealthCheckService()->SetServingStatus(false);
}

void Listener::Shutdown(Duration time) {
  acceptor_->Stop();
  server_->Shutdown(DeadlineIn(time));
  server_->Wait();
}

}  // namespace lucerna
