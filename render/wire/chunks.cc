#include "render/wire/chunks.h"

namespace lucerna {

Status ChunkCollector::Add(std::string_view chunk) {
  if (chunk.size() > kMaxChunkBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("a chunk of ", chunk.size(), " bytes is longer than ", kMaxChunkBytes));
  }
  // Memory grows with what has come, not with what was announced.
  if (chunk.size() > size_bytes_ - bytes_.size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("more bytes than the ", size_bytes_, " that were announced"));
  }
  bytes_.append(chunk);
  return absl::OkStatus();
}

StatusOr<std::string> ChunkCollector::Finish() {
  if (bytes_.size() != size_bytes_) {
    return absl::DataLossError(
        absl::StrCat("the stream ended after ", bytes_.size(), " of ", size_bytes_, " bytes"));
  }
  if (Sha256(bytes_) != digest_) {
    return absl::DataLossError(absl::StrCat("bytes arrived that are not ", digest_.Hex()));
  }
  return std::move(bytes_);
}

}  // namespace lucerna
