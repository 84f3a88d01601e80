// The numbers of a glTF document: buffers, the views of them, and accessors.
//
// An accessor is checked as a whole when it is opened: its type, stride, count and sparse
// replacements lie within the bytes that there are, so reading an element needs no checks and takes
// no memory. An accessor without bytes is zeros, of which there may be 64 MiB.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "render/formats/asset_reader.h"
#include "render/formats/gltf/document.h"

namespace lucerna {

// Elements of one to four numbers, or of 4 x 4 matrices. Points into the buffers.
class GltfAccessor {
 public:
  [[nodiscard]] std::size_t count() const { return count_; }
  // Of integers that stand for the interval [0, 1] or [-1, 1].
  [[nodiscard]] bool is_normalized() const { return is_normalized_; }
  // Requires index < count(). The components of an element; those it does not have are 0.
  [[nodiscard]] std::array<double, 4> At(std::size_t index) const { return NumbersAt<4>(index); }
  // Of a matrix, column by column.
  [[nodiscard]] std::array<double, 16> MatrixAt(std::size_t index) const {
    return NumbersAt<16>(index);
  }
  // Of a scalar of unsigned integers.
  [[nodiscard]] std::uint32_t WholeAt(std::size_t index) const;

 private:
  friend class GltfBuffers;

  template <std::size_t kCount>
  [[nodiscard]] std::array<double, kCount> NumbersAt(std::size_t index) const;
  [[nodiscard]] const char* ElementAt(std::size_t index) const;
  [[nodiscard]] double NumberAt(const char* at) const;

  int component_type_ = 0;
  std::size_t component_bytes_ = 0;
  std::size_t components_ = 0;
  bool is_normalized_ = false;
  std::size_t count_ = 0;
  std::size_t stride_ = 0;
  const char* data_ = nullptr;  // null: zeros
  // Elements in place of others, by index.
  std::vector<std::uint32_t> sparse_indices_;
  const char* sparse_data_ = nullptr;
};

// What an accessor has to be for its use.
enum class GltfUse : std::uint8_t { kIndices, kScalar, kVec2, kVec3, kVec4, kMat4 };

class GltfBuffers {
 public:
  // Both outlive the buffers.
  GltfBuffers(const GltfDocument& document, AssetReader& assets)
      : document_(document), assets_(assets), buffers_(document.Count("buffers")) {}

  // As long-lived as the buffers. nullptr: an error, which is in the diagnostics once.
  [[nodiscard]] const GltfAccessor* Open(std::size_t accessor, GltfUse use);
  // The bytes of a view.
  [[nodiscard]] std::optional<std::string_view> View(std::size_t view);

 private:
  struct Buffer {
    bool is_read = false;
    std::optional<std::string> owned;
    std::optional<std::string_view> bytes;
  };

  [[nodiscard]] std::optional<std::string_view> BytesOf(std::size_t buffer);
  [[nodiscard]] std::optional<GltfAccessor> Read(std::size_t accessor, GltfUse use);
  [[nodiscard]] bool ReadSparse(const JsonObject& object, GltfAccessor& accessor);
  // `count` elements of `element_bytes` each, `stride` apart, from `offset` in a view.
  [[nodiscard]] const char* Elements(const JsonObject& object, std::size_t view,
                                     std::uint64_t offset, std::uint64_t count,
                                     std::uint64_t element_bytes, std::uint64_t stride);

  const GltfDocument& document_;
  AssetReader& assets_;
  std::vector<Buffer> buffers_;
  std::map<std::pair<std::size_t, GltfUse>, std::optional<GltfAccessor>> opened_;
};

// What a "uri" of the document names: bytes within the text (data:), or a file beside it, by a path
// that is read the way most other programs read it.
// Errors: INVALID_ARGUMENT for other schemes and damaged text, and those of the reader.
[[nodiscard]] StatusOr<std::string> ReadGltfUri(std::string_view uri, AssetReader& assets);

}  // namespace lucerna
