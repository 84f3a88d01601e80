// The door through which images go out.
//
// Threads: gRPC calls in from its own pool. Asking for the image of a running job waits for one
// step of its estimator and for the encoding, and for nothing else.
#pragma once

#include <grpcpp/grpcpp.h>

#include "proto/lucerna/v1/images.grpc.pb.h"
#include "server/bytes_reactor.h"
#include "server/coordinator.h"

namespace lucerna {

class ImageService final : public v1::ImageService::CallbackService {
 public:
  // The coordinator outlives the service.
  explicit ImageService(Coordinator& coordinator) : coordinator_(coordinator) {}

  grpc::ServerWriteReactor<v1::Chunk>* GetImage(grpc::CallbackServerContext* /*context*/,
                                                const v1::GetImageRequest* request) override {
    return new BytesReactor(coordinator_.ImageOf(request->job_id()));
  }

 private:
  Coordinator& coordinator_;
};

}  // namespace lucerna
