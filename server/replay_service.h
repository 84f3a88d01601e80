// What `lucerna trace-photon` needs of WorkerService, for a listener of clients.
//
// Where workers have a listener of their own, clients may not be able to reach it. The program that
// traces a photon again reads jobs and their files as a worker does, and needs no more of the
// protocol of workers: all other calls are UNIMPLEMENTED here. Who may make these is decided as in
// WorkerService (server/access.h).
//
// Threads: as WorkerService.
#pragma once

#include <grpcpp/grpcpp.h>

#include "proto/lucerna/v1/work.grpc.pb.h"
#include "server/worker_service.h"

namespace lucerna {

class ReplayService final : public v1::WorkerService::CallbackService {
 public:
  // `workers` outlives the service.
  explicit ReplayService(WorkerService& workers) : workers_(workers) {}

  grpc::ServerUnaryReactor* DescribeJob(grpc::CallbackServerContext* context,
                                        const v1::DescribeJobRequest* request,
                                        v1::JobDescription* response) override {
    return workers_.DescribeJob(context, request, response);
  }
  grpc::ServerWriteReactor<v1::Chunk>* FetchBlob(grpc::CallbackServerContext* context,
                                                 const v1::FetchBlobRequest* request) override {
    return workers_.FetchBlob(context, request);
  }

 private:
  WorkerService& workers_;
};

}  // namespace lucerna
