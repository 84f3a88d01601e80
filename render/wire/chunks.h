// How are long bytes cut for a stream, and put together again?
//
// Chunks are of 256 KiB, which gRPC carries fastest; whoever receives accepts up to 1 MiB each,
// and never more bytes in all than was agreed before.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>

#include "render/base/digest.h"
#include "render/base/status.h"

namespace lucerna {

inline constexpr std::size_t kChunkBytes = std::size_t{256} << 10;
inline constexpr std::size_t kMaxChunkBytes = std::size_t{1} << 20;

// The next chunk of `rest`, which is shortened by it; empty when there is none.
[[nodiscard]] inline std::string_view NextChunk(std::string_view& rest) {
  const std::string_view chunk = rest.substr(0, std::min(rest.size(), kChunkBytes));
  rest.remove_prefix(chunk.size());
  return chunk;
}

// Bytes that arrive chunk by chunk, held to the digest and size that were announced.
class ChunkCollector {
 public:
  ChunkCollector(const Digest& digest, std::uint64_t size_bytes)
      : digest_(digest), size_bytes_(size_bytes) {}

  // Takes memory for all bytes at once: for sizes that have been found to be plausible.
  void Reserve() { bytes_.reserve(size_bytes_); }
  // Errors: INVALID_ARGUMENT for a chunk that is too long or goes past the announced size.
  [[nodiscard]] Status Add(std::string_view chunk);
  // The bytes. Errors: DATA_LOSS unless size and digest are as announced.
  [[nodiscard]] StatusOr<std::string> Finish();

 private:
  Digest digest_;
  std::uint64_t size_bytes_;
  std::string bytes_;
};

}  // namespace lucerna
