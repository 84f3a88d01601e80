// Texture "imagemap": the pixels of a file.
#include <algorithm>
#include <charconv>
#include <utility>

#include "render/base/text.h"
#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {
namespace {

PixelEncoding ReadEncoding(ParameterList& parameters) {
  const std::string text = parameters.String("encoding", "sRGB");
  if (text == "sRGB") return {};
  if (text == "linear") return {PixelEncoding::Kind::kLinear};
  PixelEncoding encoding = {PixelEncoding::Kind::kGamma};
  constexpr std::string_view kGamma = "gamma ";
  const std::string_view number =
      std::string_view(text).substr(std::min(text.size(), kGamma.size()));
  const auto [end, error] =
      std::from_chars(number.data(), number.data() + number.size(), encoding.gamma);
  if (!text.starts_with(kGamma) || error != std::errc() || end != number.data() + number.size() ||
      !(encoding.gamma > 0) || !(encoding.gamma <= 100)) {
    parameters.Error("encoding", "must be sRGB, linear or gamma and a number");
    return {};
  }
  return encoding;
}

Texture::Wrap ReadWrap(ParameterList& parameters) {
  const std::string wrap = parameters.String("wrap", "repeat");
  if (wrap == "clamp") return Texture::Wrap::kClamp;
  if (wrap == "black") return Texture::Wrap::kBlack;
  if (wrap != "repeat") parameters.Error("wrap", "must be repeat, clamp or black");
  return Texture::Wrap::kRepeat;
}

}  // namespace

NamedTexture ReadPictureTexture(const TextureInput& input) {
  ParameterList& parameters = input.parameters;
  Texture texture;
  texture.kind = Texture::Kind::kPicture;
  texture.mapping = ReadMapping(parameters);
  texture.wrap = ReadWrap(parameters);
  texture.scale = static_cast<float>(parameters.Float("scale", 1, kZeroOrMore));
  texture.is_inverted = parameters.Bool("invert", false);
  const PixelEncoding encoding = ReadEncoding(parameters);
  // Every pixel has many samples, over which a look-up between four pixels averages out.
  parameters.Ignore("filter");
  parameters.Ignore("maxanisotropy");
  const std::optional<std::string> file = parameters.FindString("filename");
  if (!file.has_value()) {
    if (!parameters.Has("filename")) parameters.Error("needs \"string filename\"");
    return UnusableTexture("refers to a texture that has an error");
  }
  StatusOr<std::shared_ptr<const Picture>> picture = input.assets.ReadPicture(*file, encoding);
  if (!picture.ok()) {
    parameters.Error("filename", Concat("cannot be read: ", picture.status().message()));
    return UnusableTexture("refers to a texture that has an error");
  }
  texture.picture = *std::move(picture);
  const double brightest =
      static_cast<double>(texture.picture->Largest()) * static_cast<double>(texture.scale);
  if (!(brightest <= 3e38)) {
    parameters.Error("scale", "is too large for single precision");
    return UnusableTexture("refers to a texture that has an error");
  }
  if (brightest > 1 && !texture.is_inverted) {
    parameters.Warning("", Concat("is up to ", brightest, " and is held at 1: no surface reflects ",
                                  "more light than it gets"));
  }
  const float largest = texture.is_inverted ? 1.0F : std::min(1.0F, static_cast<float>(brightest));
  return AppendTexture(std::move(texture), largest, 1, input.textures);
}

}  // namespace lucerna
