// The gRPC service of workers.
//
// Turns messages into values, calls the coordinator, and turns the result back. What each call
// promises and which errors it has is said in work.proto. Nothing is decided here.
//
// Threads: gRPC calls in from its own pool. A Sync that must wait is parked with the coordinator;
// CommitBatch unpacks and merges in the pool for commits.
#pragma once

#include <grpcpp/grpcpp.h>

#include "proto/lucerna/v1/work.grpc.pb.h"
#include "server/access.h"
#include "server/bytes_reactor.h"
#include "server/coordinator.h"
#include "server/work_pool.h"

namespace lucerna {

class WorkerService final : public v1::WorkerService::CallbackService {
 public:
  // Both outlive the service.
  WorkerService(Coordinator& coordinator, WorkPools& pools,
                const Access& access = Access::Unrestricted())
      : coordinator_(coordinator), pools_(pools), access_(access) {}

  grpc::ServerUnaryReactor* Register(grpc::CallbackServerContext* context,
                                     const v1::RegisterRequest* request,
                                     v1::RegisterResponse* response) override;
  grpc::ServerUnaryReactor* Sync(grpc::CallbackServerContext* context,
                                 const v1::SyncRequest* request,
                                 v1::SyncResponse* response) override;
  grpc::ServerWriteReactor<v1::Chunk>* FetchBlob(grpc::CallbackServerContext* context,
                                                 const v1::FetchBlobRequest* request) override;
  grpc::ServerReadReactor<v1::CommitBatchRequest>* CommitBatch(
      grpc::CallbackServerContext* context, v1::CommitBatchResponse* response) override;
  grpc::ServerUnaryReactor* DescribeJob(grpc::CallbackServerContext* context,
                                        const v1::DescribeJobRequest* request,
                                        v1::JobDescription* response) override;
  grpc::ServerUnaryReactor* Goodbye(grpc::CallbackServerContext* context,
                                    const v1::GoodbyeRequest* request,
                                    v1::GoodbyeResponse* response) override;

 private:
  Coordinator& coordinator_;
  WorkPools& pools_;
  const Access& access_;
};

}  // namespace lucerna
