// The gRPC service that receives the files of a scene.
//
// Turns bytes into blobs of the store. Nothing is decided here.
//
// Threads: gRPC calls in from its own pool. Handlers never wait; digests are checked in the pool
// for uploads.
#pragma once

#include <grpcpp/grpcpp.h>

#include "proto/lucerna/v1/assets.grpc.pb.h"
#include "server/access.h"
#include "server/blob_store.h"
#include "server/open_transfers.h"
#include "server/work_pool.h"

namespace lucerna {

class AssetService final : public v1::AssetService::CallbackService {
 public:
  // All outlive the service. Without `transfers` uploads have no limits of their own.
  AssetService(BlobStore& blobs, MemoryBudget& budget, WorkPools& pools,
               OpenTransfers* transfers = nullptr, const Access& access = Access::Unrestricted())
      : blobs_(blobs), budget_(budget), pools_(pools), transfers_(transfers), access_(access) {}

  grpc::ServerUnaryReactor* FindMissing(grpc::CallbackServerContext* context,
                                        const v1::FindMissingRequest* request,
                                        v1::FindMissingResponse* response) override;
  grpc::ServerReadReactor<v1::UploadRequest>* Upload(grpc::CallbackServerContext* context,
                                                     v1::UploadResponse* response) override;

 private:
  BlobStore& blobs_;
  MemoryBudget& budget_;
  WorkPools& pools_;
  OpenTransfers* const transfers_;
  const Access& access_;
};

}  // namespace lucerna
