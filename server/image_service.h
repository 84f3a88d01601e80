// The gRPC service that streams images and timelines, to the owners of their jobs.
//
// Threads: gRPC calls in from its own pool. The image of a running job waits for one step of its
// estimator and for the encoding, in the pool for images.
#pragma once

#include <grpcpp/grpcpp.h>

#include "proto/lucerna/v1/images.grpc.pb.h"
#include "server/access.h"
#include "server/bytes_reactor.h"
#include "server/coordinator.h"
#include "server/rpc_caller.h"
#include "server/work_pool.h"

namespace lucerna {

class ImageService final : public v1::ImageService::CallbackService {
 public:
  // Both outlive the service.
  ImageService(Coordinator& coordinator, WorkPools& pools,
               const Access& access = Access::Unrestricted())
      : coordinator_(coordinator), pools_(pools), access_(access) {}

  grpc::ServerWriteReactor<v1::Chunk>* GetImage(grpc::CallbackServerContext* context,
                                                const v1::GetImageRequest* request) override {
    return SendOf(context, request->job_id(),
                  [this, job_id = request->job_id(), uv_mesh = request->uv_mesh()] {
                    return uv_mesh ? coordinator_.UvMeshOf(job_id) : coordinator_.ImageOf(job_id);
                  });
  }

  grpc::ServerWriteReactor<v1::Chunk>* GetTrace(grpc::CallbackServerContext* context,
                                                const v1::GetTraceRequest* request) override {
    return SendOf(context, request->job_id(),
                  [this, job_id = request->job_id()] { return coordinator_.TraceOf(job_id); });
  }

 private:
  // Bytes of a job, to who may have them.
  template <typename MakeBytes>
  grpc::ServerWriteReactor<v1::Chunk>* SendOf(grpc::CallbackServerContext* context,
                                              const std::string& job_id, MakeBytes make) {
    auto* const reactor = new BytesReactor;
    const StatusOr<std::string> owner = coordinator_.OwnerOf(job_id);
    const Status allowed =
        owner.ok() ? access_.CheckOwns(*context, job_id, *owner) : owner.status();
    if (!allowed.ok()) {
      reactor->Send(allowed);
      return reactor;
    }
    pools_.images.Run(NeededByCaller(context), [reactor, make](const Status& may_begin) {
      reactor->Send(may_begin.ok() ? WithinMemory(make) : StatusOr<Blob>(may_begin));
    });
    return reactor;
  }

  Coordinator& coordinator_;
  WorkPools& pools_;
  const Access& access_;
};

}  // namespace lucerna
