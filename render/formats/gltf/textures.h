// Textures of a glTF document: images, samplers and KHR_texture_transform.
//
// An image is decoded once for each use (colours, vectors, one channel); a texture of the scene is
// made for each place in a material that names one.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "render/formats/gltf/accessors.h"
#include "render/formats/gltf/document.h"
#include "render/scene/scene.h"

namespace lucerna {

// A picture with what materials are chosen by.
struct GltfPicture {
  std::shared_ptr<const Picture> picture;
  float least = 0, largest = 0;  // of all channels
};

// Which picture a texture shows, and how.
struct GltfTextureUse {
  PictureUse use = PictureUse::kColors;
  PixelEncoding encoding;
  Rgb factor = {1, 1, 1};  // of numbers, the first channel
};

class GltfTextures {
 public:
  // All outlive it.
  GltfTextures(const GltfDocument& document, GltfBuffers& buffers, AssetReader& assets,
               std::vector<Texture>& textures)
      : document_(document), buffers_(buffers), assets_(assets), textures_(textures) {}

  // The picture that a textureInfo names. nullptr: an error, which is in the diagnostics once.
  [[nodiscard]] const GltfPicture* FindPicture(const JsonObject& texture_info, PictureUse use,
                                               const PixelEncoding& encoding);
  // The texture that a textureInfo names; nullopt after an error. Requires that FindPicture found
  // its picture.
  [[nodiscard]] std::optional<Texture> Make(const JsonObject& texture_info,
                                            const GltfTextureUse& use);
  // Appends it to the scene's, and returns its number; kNoTexture after an error.
  [[nodiscard]] std::int32_t Append(const JsonObject& texture_info, const GltfTextureUse& use);
  // Which TEXCOORD_n it is placed by.
  [[nodiscard]] static std::uint64_t TexCoordOf(const JsonObject& texture_info);

 private:
  using Key = std::tuple<std::size_t, PictureUse, PixelEncoding::Kind, double>;

  [[nodiscard]] std::optional<std::size_t> ImageOf(const JsonObject& texture_info);
  [[nodiscard]] std::optional<GltfPicture> ReadPicture(std::size_t image, PictureUse use,
                                                       const PixelEncoding& encoding);

  const GltfDocument& document_;
  GltfBuffers& buffers_;
  AssetReader& assets_;
  std::vector<Texture>& textures_;
  std::map<Key, std::optional<GltfPicture>> pictures_;
  std::set<std::size_t> faulty_images_;
};

}  // namespace lucerna
