#include "render/formats/gltf/document.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

#include "render/base/text.h"

namespace lucerna {
namespace {

// A value takes up to 100 bytes in memory and two in the text.
constexpr std::size_t kMostValues = std::size_t{1} << 23;

constexpr std::string_view kMagic = "glTF";
constexpr std::size_t kHeaderBytes = 12;
constexpr std::size_t kChunkHeaderBytes = 8;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinaryChunk = 0x004E4942;

// The top-level arrays whose entries are objects.
constexpr std::array kArrays = {"accessors", "buffers",   "bufferViews", "cameras",
                                "images",    "materials", "meshes",      "nodes",
                                "samplers",  "scenes",    "skins",       "textures"};

std::uint32_t WordAt(std::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof(word));
  return word;
}

}  // namespace

GltfDocument::GltfDocument(const std::string& main_path, std::string_view bytes,
                           Diagnostics& diagnostics)
    : JsonDocument(main_path, diagnostics) {
  const std::optional<std::string_view> text = OpenContainer(bytes);
  if (!text.has_value()) return;
  Parse(*text, kMostValues);
  if (diagnostics.has_error()) return;
  CheckVersion();
  CheckArrays();
  is_readable_ = !diagnostics.has_error();
}

std::optional<std::string_view> GltfDocument::OpenContainer(std::string_view bytes) {
  if (!bytes.starts_with(kMagic)) return bytes;
  const auto refuse = [&](std::string_view what) {
    diagnostics().Error(whole(), Concat("this is no usable .glb file: ", what));
    return std::nullopt;
  };
  if (bytes.size() < kHeaderBytes + kChunkHeaderBytes) return refuse("it is cut off");
  if (WordAt(bytes, 4) != 2) return refuse(Concat("its version is ", WordAt(bytes, 4), ", not 2"));
  if (WordAt(bytes, 8) > bytes.size()) return refuse("it is cut off");
  bytes = bytes.substr(0, std::max<std::size_t>(WordAt(bytes, 8), kHeaderBytes));
  std::optional<std::string_view> text;
  for (std::size_t at = kHeaderBytes; at < bytes.size();) {
    if (bytes.size() - at < kChunkHeaderBytes) return refuse("its last chunk is cut off");
    const std::size_t size = WordAt(bytes, at);
    const std::uint32_t type = WordAt(bytes, at + 4);
    at += kChunkHeaderBytes;
    if (size > bytes.size() - at) return refuse("one of its chunks is cut off");
    const std::string_view chunk = bytes.substr(at, size);
    if (!text.has_value()) {
      if (type != kJsonChunk) return refuse("its first chunk is not JSON");
      text = chunk;
    } else if (type == kBinaryChunk && !binary_chunk_.has_value()) {
      binary_chunk_ = chunk;
    }
    at += size;
  }
  if (!text.has_value()) return refuse("it has no chunks");
  return text;
}

void GltfDocument::CheckVersion() {
  const JsonObject asset = Root().Child("asset");
  if (diagnostics().has_error()) return;
  if (!asset.exists()) {
    diagnostics().Error(whole(), "this is no glTF 2.0: it has no \"asset\" with a \"version\"");
    return;
  }
  // A file that is written for a later 2.x says in minVersion whether it needs that.
  const std::string version = asset.String("minVersion", asset.String("version", ""));
  const bool is_read = asset.Has("minVersion") ? version == "2.0" : version.starts_with("2.");
  // What is no string has been reported.
  if (is_read || diagnostics().has_error()) return;
  asset.Error(Concat("the version is ", Quoted(version),
                     "; only 2.0 is read, to which newer exporters and converters write"));
}

void GltfDocument::CheckArrays() {
  for (const char* array : kArrays)
    CheckArrayOfObjects(array);
}

}  // namespace lucerna
