#include "server/asset_service.h"

#include <memory>
#include <optional>
#include <utility>

#include "render/scene/scene_files.h"
#include "render/wire/chunks.h"
#include "render/wire/grpc_status.h"
#include "server/rpc_caller.h"

namespace lucerna {
namespace {

class UploadReactor final : public grpc::ServerReadReactor<v1::UploadRequest> {
 public:
  UploadReactor(BlobStore& blobs, MemoryBudget& budget, WorkPool& pool, OpenTransfers* transfers,
                const std::string& caller, grpc::CallbackServerContext* context)
      : blobs_(blobs), budget_(budget), pool_(pool), context_(context) {
    if (transfers != nullptr) {
      StatusOr<std::unique_ptr<OpenTransfers::Transfer>> opened =
          transfers->Open(caller, [context] { context->TryCancel(); });
      if (!opened.ok()) {
        Finish(ToGrpc(opened.status()));
        return;
      }
      transfer_ = *std::move(opened);
    }
    StartRead(&part_);
  }

  void OnReadDone(bool ok) override {
    if (transfer_) transfer_->Progress();
    if (!ok) {
      if (transfer_) transfer_->Complete();
      pool_.Run(NeededByCaller(context_), [this](const Status& may_begin) {
        Finish(ToGrpc(may_begin.ok() ? Keep() : may_begin));
      });
      return;
    }
    if (const Status status = Take(); !status.ok()) {
      Finish(ToGrpc(status));
      return;
    }
    StartRead(&part_);
  }
  void OnDone() override { delete this; }

 private:
  Status Take() {
    if (part_.has_header() == collector_.has_value()) {
      return absl::InvalidArgumentError("an upload is one header and then bytes");
    }
    if (collector_) return collector_->Add(part_.bytes());
    LUCERNA_ASSIGN_OR_RETURN(digest_, Digest::FromBytes(part_.header().digest()));
    if (part_.header().size_bytes() > SceneLimits().max_total_bytes) {
      return absl::InvalidArgumentError(
          absl::StrCat("a file of ", part_.header().size_bytes(), " bytes is larger than the ",
                       SceneLimits().max_total_bytes, " that are allowed"));
    }
    if (transfer_) LUCERNA_RETURN_IF_ERROR(transfer_->Announce(part_.header().size_bytes()));
    LUCERNA_ASSIGN_OR_RETURN(claim_,
                             budget_.Claim(MemoryUse::kUploads, part_.header().size_bytes()));
    collector_.emplace(digest_, part_.header().size_bytes());
    return absl::OkStatus();
  }

  Status Keep() {
    if (!collector_) return absl::InvalidArgumentError("an upload begins with a header");
    return WithinMemory([this]() -> Status {
      LUCERNA_ASSIGN_OR_RETURN(std::string bytes, collector_->Finish());
      // From here on they are claimed as a blob.
      claim_ = MemoryClaim();
      return blobs_.Put(digest_, std::move(bytes));
    });
  }

  BlobStore& blobs_;
  MemoryBudget& budget_;
  MemoryClaim claim_;
  WorkPool& pool_;
  const grpc::CallbackServerContext* const context_;
  std::unique_ptr<OpenTransfers::Transfer> transfer_;
  v1::UploadRequest part_;
  Digest digest_;
  std::optional<ChunkCollector> collector_;
};

}  // namespace

grpc::ServerUnaryReactor* AssetService::FindMissing(grpc::CallbackServerContext* context,
                                                    const v1::FindMissingRequest* request,
                                                    v1::FindMissingResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  Status status;
  if (static_cast<std::uint64_t>(request->digests_size()) > SceneLimits().max_files) {
    status = absl::InvalidArgumentError(
        absl::StrCat("more than ", SceneLimits().max_files, " digests in one question"));
  }
  for (int i = 0; status.ok() && i < request->digests_size(); ++i) {
    const StatusOr<Digest> digest = Digest::FromBytes(request->digests(i));
    status = digest.status();
    if (digest.ok() && !blobs_.Has(*digest)) response->add_missing(request->digests(i));
  }
  reactor->Finish(ToGrpc(status));
  return reactor;
}

grpc::ServerReadReactor<v1::UploadRequest>* AssetService::Upload(
    grpc::CallbackServerContext* context, v1::UploadResponse* /*response*/) {
  return new UploadReactor(blobs_, budget_, pools_.uploads, transfers_,
                           access_.LimitKeyOf(*context), context);
}

}  // namespace lucerna
