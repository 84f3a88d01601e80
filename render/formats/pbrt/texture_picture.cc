// Texture "imagemap": the pixels of a file.
#include <algorithm>
#include <charconv>
#include <cmath>
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
  texture.is_number = input.is_number;
  texture.mapping = ReadMapping(input);
  texture.wrap_u = texture.wrap_v = ReadWrap(parameters);
  texture.scale =
      static_cast<float>(parameters.Float("scale", 1, input.is_number ? kAnyNumber : kZeroOrMore));
  texture.is_inverted = parameters.Bool("invert", false);
  const PixelEncoding encoding = ReadEncoding(parameters);
  // Every pixel has many samples, over which a look-up between four pixels averages out.
  texture.is_nearest = parameters.String("filter", "bilinear") == "point";
  parameters.Ignore("maxanisotropy");
  const std::optional<std::string> file = parameters.FindString("filename");
  if (!file.has_value()) {
    if (!parameters.Has("filename")) parameters.Error("needs \"string filename\"");
    return FaultyTexture();
  }
  StatusOr<std::shared_ptr<const Picture>> picture = input.assets.ReadPicture(
      *file, encoding, input.is_number ? PictureUse::kNumbers : PictureUse::kColors);
  if (!picture.ok()) {
    parameters.Error("filename", Concat("cannot be read: ", picture.status().message()));
    return FaultyTexture();
  }
  texture.picture = *std::move(picture);
  ValueRange range = {texture.picture->Smallest(), texture.picture->Largest()};
  if (texture.wrap_u == Texture::Wrap::kBlack) range = range.Joined({0, 0});
  range = range * ValueRange{texture.scale, texture.scale};
  if (!(std::max(std::abs(range.least), std::abs(range.largest)) <= 3e38F)) {
    parameters.Error("scale", "is too large for single precision");
    return FaultyTexture();
  }
  if (texture.is_inverted) {
    range = {std::max(0.0F, 1 - range.largest), std::max(0.0F, 1 - range.least)};
  } else if (!input.is_number) {
    WarnOfBright(range.largest, parameters);
  }
  if (!input.is_number) range = {std::min(1.0F, range.least), std::min(1.0F, range.largest)};
  return AppendTexture(std::move(texture), range, {}, input);
}

}  // namespace lucerna
