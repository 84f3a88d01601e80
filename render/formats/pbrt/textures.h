// Reads Texture directives.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "render/formats/asset_reader.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/scene/texture.h"

namespace lucerna {

// The spectrum textures that a text has declared, by name.
struct NamedTexture {
  std::int32_t number = kNoTexture;  // in Scene::textures
  std::string why_not;               // when it has no number
  float largest = 1;                 // no channel is larger anywhere
  int depth = 1;                     // of textures made of textures
};
using TextureNames = std::map<std::string, NamedTexture>;

// A spectrum texture of `type`; appends to `textures` what it is made of. One that is of an
// unsupported type is an error only where something uses it.
[[nodiscard]] NamedTexture ReadTexture(std::string_view type, ParameterList& parameters,
                                       const TextureNames& names, AssetReader& assets,
                                       std::vector<Texture>& textures);

}  // namespace lucerna
