// The gRPC service of operators.
//
// Turns messages into values, calls the coordinator, and turns the result back; admin.proto says
// what each call promises. Nothing is decided here.
//
// Threads: gRPC calls in from its own pool. No call takes long.
#pragma once

#include <grpcpp/grpcpp.h>

#include "proto/lucerna/v1/admin.grpc.pb.h"
#include "server/coordinator.h"

namespace lucerna {

class AdminService final : public v1::AdminService::CallbackService {
 public:
  // Both outlive the service.
  AdminService(Coordinator& coordinator, const Clock& clock)
      : coordinator_(coordinator), clock_(clock) {}

  grpc::ServerUnaryReactor* ListWorkers(grpc::CallbackServerContext* context,
                                        const v1::ListWorkersRequest* request,
                                        v1::ListWorkersResponse* response) override;
  grpc::ServerUnaryReactor* DrainWorker(grpc::CallbackServerContext* context,
                                        const v1::WorkerRequest* request,
                                        v1::Worker* response) override;
  grpc::ServerUnaryReactor* QuarantineWorker(grpc::CallbackServerContext* context,
                                             const v1::WorkerRequest* request,
                                             v1::Worker* response) override;
  grpc::ServerUnaryReactor* ReleaseWorker(grpc::CallbackServerContext* context,
                                          const v1::WorkerRequest* request,
                                          v1::Worker* response) override;

 private:
  // The worker as it is after a change that came to `status`.
  grpc::ServerUnaryReactor* Answer(grpc::CallbackServerContext* context, const Status& status,
                                   const std::string& worker_id, v1::Worker* response) const;
  v1::Worker ToProto(const WorkerRecord& record) const;

  Coordinator& coordinator_;
  const Clock& clock_;
};

}  // namespace lucerna
