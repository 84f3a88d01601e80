#include "render/formats/pbrt/textures.h"

#include <optional>
#include <utility>

#include "render/base/text.h"
#include "render/formats/pbrt/kinds.h"
#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {
namespace {

// Of textures made of textures: looking one up takes as many steps.
constexpr int kMaxDepth = 64;

using TextureReader = NamedTexture (*)(const TextureInput&);
#define LUCERNA_ROW(Name, name) {name, &Read##Name##Texture},
constexpr Kind<TextureReader> kKinds[] = {LUCERNA_TEXTURES(LUCERNA_ROW)};
#undef LUCERNA_ROW

}  // namespace

NamedTexture UnusableTexture(std::string why_not) {
  NamedTexture texture;
  texture.why_not = std::move(why_not);
  return texture;
}

NamedTexture AppendTexture(Texture texture, float largest, int depth,
                           std::vector<Texture>& textures) {
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

NamedTexture ReadPart(std::string_view name, float otherwise, const TextureInput& input) {
  ParameterList& parameters = input.parameters;
  if (parameters.IsTexture(name)) {
    const std::optional<std::string> other = parameters.FindTexture(name);
    const auto found = other.has_value() ? input.names.find(*other) : input.names.end();
    if (found != input.names.end()) return found->second;
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
  return AppendTexture(constant, MaxChannel(constant.color), 1, input.textures);
}

NamedTexture ReadTexture(std::string_view type, ParameterList& parameters,
                         const TextureNames& names, AssetReader& assets,
                         std::vector<Texture>& textures) {
  const TextureReader read = FindReader<TextureReader>(kKinds, type);
  if (read == nullptr) {
    return UnusableTexture(Concat("refers to a texture of type ", Quoted(type),
                                  ", which is not supported; ",
                                  SupportedKinds<TextureReader>(kKinds)));
  }
  NamedTexture made = read({parameters, names, assets, textures});
  if (made.depth > kMaxDepth) {
    parameters.Error(Concat("is made of textures more than ", kMaxDepth, " deep"));
    made = UnusableTexture("refers to a texture that has an error");
  }
  parameters.WarnOfUnread();
  return made;
}

}  // namespace lucerna
