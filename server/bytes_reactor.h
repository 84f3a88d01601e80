// How do the bytes of a blob leave in chunks?
#pragma once

#include <string_view>
#include <utility>

#include <grpcpp/grpcpp.h>

#include "proto/lucerna/v1/values.pb.h"
#include "render/base/status.h"
#include "render/wire/chunks.h"
#include "render/wire/grpc_status.h"
#include "server/blob_store.h"

namespace lucerna {

// Sends one blob, or says why there is none; deletes itself when the call is over.
class BytesReactor final : public grpc::ServerWriteReactor<v1::Chunk> {
 public:
  // Once; from any thread.
  void Send(StatusOr<Blob> blob) {
    if (!blob.ok()) {
      Finish(ToGrpc(blob.status()));
      return;
    }
    blob_ = *std::move(blob);
    rest_ = *blob_;
    Next();
  }

  void OnWriteDone(bool ok) override {
    if (ok) {
      Next();
    } else {
      Finish(grpc::Status(grpc::StatusCode::CANCELLED, "the connection broke"));
    }
  }
  void OnDone() override { delete this; }

 private:
  void Next() {
    const std::string_view bytes = NextChunk(rest_);
    if (bytes.empty()) {
      Finish(grpc::Status::OK);
      return;
    }
    chunk_.set_bytes(bytes.data(), bytes.size());
    StartWrite(&chunk_);
  }

  Blob blob_;
  std::string_view rest_;
  v1::Chunk chunk_;
};

}  // namespace lucerna
