#include "render/formats/pbrt/textures.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "render/base/text.h"
#include "render/formats/pbrt/kinds.h"

namespace lucerna {
namespace {

// Of textures made of textures: looking one up takes as many steps.
constexpr int kMaxDepth = 64;

NamedTexture Unusable(std::string why_not) {
  NamedTexture texture;
  texture.why_not = std::move(why_not);
  return texture;
}

NamedTexture Append(Texture texture, float largest, int depth, std::vector<Texture>& textures) {
  textures.push_back(std::move(texture));
  return {static_cast<std::int32_t>(textures.size()) - 1, "", largest, depth};
}

UvMapping ReadMapping(ParameterList& parameters) {
  if (parameters.String("mapping", "uv") != "uv") {
    parameters.Error("mapping", "is not supported; there is uv");
  }
  UvMapping mapping;
  mapping.scale_u = static_cast<float>(parameters.Float("uscale", 1));
  mapping.scale_v = static_cast<float>(parameters.Float("vscale", 1));
  mapping.delta_u = static_cast<float>(parameters.Float("udelta", 0));
  mapping.delta_v = static_cast<float>(parameters.Float("vdelta", 0));
  return mapping;
}

// A parameter that is a texture or a colour; `otherwise` where it is absent or wrong.
NamedTexture Part(std::string_view name, float otherwise, ParameterList& parameters,
                  const TextureNames& names, std::vector<Texture>& textures) {
  if (parameters.IsTexture(name)) {
    const std::optional<std::string> other = parameters.FindTexture(name);
    const auto found = other.has_value() ? names.find(*other) : names.end();
    if (found != names.end()) return found->second;
    if (other.has_value()) {
      parameters.Error(name, Concat("refers to the spectrum texture ", Quoted(*other),
                                    ", which is not defined before it"));
    }
  }
  Texture constant;
  constant.color = Gray(otherwise);
  if (!parameters.IsTexture(name)) {
    constant.color = parameters.FindReflectance(name).value_or(constant.color);
  }
  return Append(constant, MaxChannel(constant.color), 1, textures);
}

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

// What the readers of all kinds of texture are given.
struct TextureInput {
  ParameterList& parameters;
  const TextureNames& names;
  AssetReader& assets;
};

NamedTexture ReadConstant(const TextureInput& input, std::vector<Texture>& textures) {
  return Part("value", 1, input.parameters, input.names, textures);
}

NamedTexture ReadImageMap(const TextureInput& input, std::vector<Texture>& textures) {
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
    return Unusable("refers to a texture that has an error");
  }
  StatusOr<std::shared_ptr<const Picture>> picture = input.assets.ReadPicture(*file, encoding);
  if (!picture.ok()) {
    parameters.Error("filename", Concat("cannot be read: ", picture.status().message()));
    return Unusable("refers to a texture that has an error");
  }
  texture.picture = *std::move(picture);
  const double brightest =
      static_cast<double>(texture.picture->Largest()) * static_cast<double>(texture.scale);
  if (!(brightest <= 3e38)) {
    parameters.Error("scale", "is too large for single precision");
    return Unusable("refers to a texture that has an error");
  }
  if (brightest > 1 && !texture.is_inverted) {
    parameters.Warning("", Concat("is up to ", brightest, " and is held at 1: no surface reflects ",
                                  "more light than it gets"));
  }
  const float largest = texture.is_inverted ? 1.0F : std::min(1.0F, static_cast<float>(brightest));
  return Append(std::move(texture), largest, 1, textures);
}

NamedTexture ReadScaled(const TextureInput& input, std::vector<Texture>& textures) {
  ParameterList& parameters = input.parameters;
  if (parameters.IsTexture("scale")) {
    parameters.Ignore("tex");
    parameters.Ignore("scale");
    return Unusable(
        "refers to a texture that is scaled by a float texture, which is not supported");
  }
  const NamedTexture part = Part("tex", 1, parameters, input.names, textures);
  Texture texture;
  texture.kind = Texture::Kind::kScaled;
  texture.scale = static_cast<float>(parameters.Float("scale", 1, kZeroOrMore));
  if (part.number == kNoTexture) return part;
  texture.parts[0] = part.number;
  const float largest = part.largest * texture.scale;
  if (largest > 1) {
    parameters.Warning("", Concat("is up to ", largest, " and is held at 1: no surface reflects ",
                                  "more light than it gets"));
  }
  return Append(texture, largest, part.depth + 1, textures);
}

NamedTexture ReadCheckerboard(const TextureInput& input, std::vector<Texture>& textures) {
  ParameterList& parameters = input.parameters;
  if (parameters.FindInteger("dimension", {2, 3}).value_or(2) != 2) {
    parameters.Error("dimension", "must be 2: checkerboards in space are not supported");
  }
  Texture texture;
  texture.kind = Texture::Kind::kCheckerboard;
  texture.mapping = ReadMapping(parameters);
  const NamedTexture even = Part("tex1", 1, parameters, input.names, textures);
  const NamedTexture odd = Part("tex2", 0, parameters, input.names, textures);
  if (even.number == kNoTexture) return even;
  if (odd.number == kNoTexture) return odd;
  texture.parts = {even.number, odd.number};
  return Append(texture, std::max(even.largest, odd.largest), std::max(even.depth, odd.depth) + 1,
                textures);
}

using TextureReader = NamedTexture (*)(const TextureInput&, std::vector<Texture>&);
constexpr Kind<TextureReader> kKinds[] = {
    {"imagemap", &ReadImageMap},
    {"constant", &ReadConstant},
    {"scale", &ReadScaled},
    {"checkerboard", &ReadCheckerboard},
};

}  // namespace

NamedTexture ReadTexture(std::string_view type, ParameterList& parameters,
                         const TextureNames& names, AssetReader& assets,
                         std::vector<Texture>& textures) {
  const TextureReader read = FindReader<TextureReader>(kKinds, type);
  if (read == nullptr) {
    return Unusable(Concat("refers to a texture of type ", Quoted(type),
                           ", which is not supported; ", SupportedKinds<TextureReader>(kKinds)));
  }
  NamedTexture made = read({parameters, names, assets}, textures);
  if (made.depth > kMaxDepth) {
    parameters.Error(Concat("is made of textures more than ", kMaxDepth, " deep"));
    made = Unusable("refers to a texture that has an error");
  }
  parameters.WarnOfUnread();
  return made;
}

}  // namespace lucerna
