#include "server/listener.h"

#include <grpcpp/health_check_service_interface.h>

#include "render/wire/channel.h"

namespace lucerna {

std::unique_ptr<Listener> Listener::Start(const Options& options) {
  const std::shared_ptr<grpc::ServerCredentials> credentials =
      MakeServerCredentials(options.tls, options.access->has_tokens());
  if (options.access->has_tokens()) {
    credentials->SetAuthMetadataProcessor(options.access->MakeProcessor());
  }
  grpc::ServerBuilder builder;
  SetUpConnections(builder);
  int port = 0;
  builder.AddListeningPort(options.address, credentials, &port);
  for (grpc::Service* const service : options.services)
    builder.RegisterService(service);
  auto listener = std::unique_ptr<Listener>(new Listener);
  listener->server_ = builder.BuildAndStart();
  if (!listener->server_ || port == 0) return nullptr;
  listener->address_ =
      absl::StrCat(options.address.substr(0, options.address.rfind(':')), ":", port);
  return listener;
}

void Listener::StopServing() {
  server_->GetHealthCheckService()->SetServingStatus(false);
}

void Listener::Shutdown(Duration time) {
  server_->Shutdown(DeadlineIn(time));
  server_->Wait();
}

}  // namespace lucerna
