#include "render/formats/gltf/textures.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "render/base/text.h"

namespace lucerna {
namespace {

constexpr const char* kTransform = "KHR_texture_transform";

Texture::Wrap WrapOf(const JsonObject& sampler, const char* name) {
  constexpr std::uint64_t kRepeat = 10497;
  constexpr std::uint64_t kMirroredRepeat = 33648;
  constexpr std::uint64_t kClampToEdge = 33071;
  const std::uint64_t wrap = sampler.Whole(name).value_or(kRepeat);
  if (wrap == kClampToEdge) return Texture::Wrap::kClamp;
  if (wrap == kMirroredRepeat) return Texture::Wrap::kMirror;
  if (wrap != kRepeat) sampler.Error(Concat(name, " must be 10497, 33071 or 33648"));
  return Texture::Wrap::kRepeat;
}

// The file's v points down the image, the scene's v = 1 - v up. A point (u, v) of the file becomes
// (cos·sx·u + sin·sy·v + ox, -sin·sx·u + cos·sy·v + oy), as three.js has it and as the examples of
// the extension need it; the matrix printed there turns the other way.
TextureMapping MappingOf(const JsonObject& texture_info) {
  TextureMapping mapping;
  const JsonObject transform = ExtensionOf(texture_info, kTransform);
  if (!transform.exists()) return mapping;
  const std::vector<double> offset = transform.Numbers("offset", {0, 0}, {-1e6, 1e6});
  const std::vector<double> scale = transform.Numbers("scale", {1, 1}, {-1e6, 1e6});
  const double angle_rad = transform.Number("rotation", 0, {-1e6, 1e6});
  const double cosine = std::cos(angle_rad);
  const double sine = std::sin(angle_rad);
  mapping.delta_u = static_cast<float>(offset[0] + sine * scale[1]);
  mapping.delta_v = static_cast<float>(1 - cosine * scale[1] - offset[1]);
  if (angle_rad == 0) {
    mapping.scale_u = static_cast<float>(scale[0]);
    mapping.scale_v = static_cast<float>(scale[1]);
    return mapping;
  }
  mapping.kind = TextureMapping::Kind::kUvAffine;
  mapping.axis_u = {static_cast<float>(cosine * scale[0]), static_cast<float>(-sine * scale[1]), 0};
  mapping.axis_v = {static_cast<float>(sine * scale[0]), static_cast<float>(cosine * scale[1]), 0};
  return mapping;
}

}  // namespace

std::uint64_t GltfTextures::TexCoordOf(const JsonObject& texture_info) {
  const std::uint64_t own = texture_info.Whole("texCoord").value_or(0);
  return ExtensionOf(texture_info, kTransform).Whole("texCoord").value_or(own);
}

std::optional<std::size_t> GltfTextures::ImageOf(const JsonObject& texture_info) {
  const std::optional<std::size_t> index = texture_info.Index("index", "textures");
  if (!index.has_value()) {
    if (!texture_info.Has("index")) texture_info.Error("needs index, the number of a texture");
    return std::nullopt;
  }
  const JsonObject texture = document_.At("textures", *index);
  if (texture.Has("source")) return texture.Index("source", "images");
  texture.Error("has no source that is PNG or JPEG");
  return std::nullopt;
}

std::optional<GltfPicture> GltfTextures::ReadPicture(std::size_t image, PictureUse use,
                                                     const PixelEncoding& encoding) {
  if (faulty_images_.contains(image)) return std::nullopt;
  const JsonObject object = document_.At("images", image);
  // Errors of a view are reported by the buffers.
  std::optional<std::string_view> view;
  if (!object.Has("uri")) {
    if (!object.Has("bufferView")) object.Error("has neither a uri nor a bufferView");
    const std::optional<std::size_t> index = object.Index("bufferView", "bufferViews");
    if (index.has_value()) view = buffers_.View(*index);
    if (!view.has_value()) {
      faulty_images_.insert(image);
      return std::nullopt;
    }
  }
  const auto bytes = [&]() -> StatusOr<std::string> {
    if (view.has_value()) return std::string(*view);
    return ReadGltfUri(object.String("uri", ""), assets_);
  };
  StatusOr<std::shared_ptr<const Picture>> read =
      assets_.ReadNamedPicture(Concat("images[", image, "]"), encoding, use, bytes);
  if (!read.ok()) {
    object.Error(Concat("cannot be read: ", read.status().message()));
    faulty_images_.insert(image);
    return std::nullopt;
  }
  GltfPicture picture;
  picture.picture = *std::move(read);
  picture.least = picture.picture->Smallest();
  picture.largest = picture.picture->Largest();
  return picture;
}

const GltfPicture* GltfTextures::FindPicture(const JsonObject& texture_info, PictureUse use,
                                             const PixelEncoding& encoding) {
  const std::optional<std::size_t> image = ImageOf(texture_info);
  if (!image.has_value()) return nullptr;
  const auto [known, is_new] = pictures_.try_emplace(
      Key{*image, use, encoding.kind,
          encoding.kind == PixelEncoding::Kind::kStep ? encoding.threshold : encoding.gamma});
  if (is_new) known->second = ReadPicture(*image, use, encoding);
  return known->second.has_value() ? &*known->second : nullptr;
}

std::optional<Texture> GltfTextures::Make(const JsonObject& texture_info,
                                          const GltfTextureUse& use) {
  const GltfPicture* picture = FindPicture(texture_info, use.use, use.encoding);
  if (picture == nullptr) return std::nullopt;
  const std::optional<std::size_t> index = texture_info.Index("index", "textures");
  const JsonObject of_file = document_.At("textures", *index);
  Texture texture;
  texture.kind = Texture::Kind::kPicture;
  texture.picture = picture->picture;
  texture.is_number = use.use != PictureUse::kColors && use.use != PictureUse::kVectors;
  if (texture.is_number) {
    texture.scale = use.factor.r;
  } else {
    texture.tint = use.factor;
  }
  texture.mapping = MappingOf(texture_info);
  if (const std::optional<std::size_t> number = of_file.Index("sampler", "samplers")) {
    const JsonObject sampler = document_.At("samplers", *number);
    texture.wrap_u = WrapOf(sampler, "wrapS");
    texture.wrap_v = WrapOf(sampler, "wrapT");
    constexpr std::uint64_t kNearest = 9728;
    texture.is_nearest = sampler.Whole("magFilter") == kNearest;
  }
  return texture;
}

std::int32_t GltfTextures::Append(const JsonObject& texture_info, const GltfTextureUse& use) {
  std::optional<Texture> texture = Make(texture_info, use);
  if (!texture.has_value()) return kNoTexture;
  textures_.push_back(*std::move(texture));
  return static_cast<std::int32_t>(textures_.size()) - 1;
}

}  // namespace lucerna
