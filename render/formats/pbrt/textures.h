// Reads Texture directives.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "render/formats/asset_reader.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/math/transform.h"
#include "render/scene/texture.h"

namespace lucerna {

// A texture that a text has declared.
struct NamedTexture {
  std::int32_t number = kNoTexture;  // in Scene::textures
  std::string why_not;               // when it has no number
  float least = 0, largest = 1;      // no channel is smaller or larger anywhere
  int depth = 1;                     // of textures made of textures
  int lookups = 1;                   // that one of it takes, at most
};
// By name.
using TextureNames = std::map<std::string, NamedTexture>;

// The textures of a text: spectrum textures and float textures have names of their own.
struct DeclaredTextures {
  TextureNames colors, numbers;
};

// A texture of `type`, of numbers (a float texture) or of colours (a spectrum texture); appends to
// `textures` what it is made of. `to_world`: of its directive. One that is of an unsupported type
// is an error only where something uses it.
[[nodiscard]] NamedTexture ReadTexture(std::string_view type, bool is_number,
                                       ParameterList& parameters, const DeclaredTextures& declared,
                                       const Transform& to_world, AssetReader& assets,
                                       std::vector<Texture>& textures);

// The texture of numbers that the parameter `name` refers to, nullptr and an error when there is
// none that can be used. Requires that it is a texture.
[[nodiscard]] const NamedTexture* FindNumbers(std::string_view name, ParameterList& parameters,
                                              const TextureNames& numbers);

}  // namespace lucerna
