// The readers of each kind of texture, defined in texture_NAME.cc, and what they share.
//
// A reader adds to `textures` what the texture is made of.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "render/formats/asset_reader.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/formats/pbrt/textures.h"
#include "render/scene/texture.h"

namespace lucerna {

// What the readers of all kinds of texture are given.
struct TextureInput {
  ParameterList& parameters;
  const TextureNames& names;
  AssetReader& assets;
  std::vector<Texture>& textures;
};

#define LUCERNA_DECLARE(Name, name) \
  [[nodiscard]] NamedTexture Read##Name##Texture(const TextureInput& input);
LUCERNA_TEXTURES(LUCERNA_DECLARE)
#undef LUCERNA_DECLARE

// A texture that is an error where something uses it.
[[nodiscard]] NamedTexture UnusableTexture(std::string why_not);
// Gives `texture` the next number. `largest` and `depth`: see NamedTexture.
[[nodiscard]] NamedTexture AppendTexture(Texture texture, float largest, int depth,
                                         std::vector<Texture>& textures);
[[nodiscard]] UvMapping ReadMapping(ParameterList& parameters);
// A parameter that is a texture or a colour; `otherwise` where it is absent or wrong.
[[nodiscard]] NamedTexture ReadPart(std::string_view name, float otherwise,
                                    const TextureInput& input);

}  // namespace lucerna
