// Reads Material and MakeNamedMaterial directives.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "render/formats/asset_reader.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/formats/pbrt/textures.h"
#include "render/scene/scene.h"

namespace lucerna {

// Indices in Scene::materials of the named materials that are defined.
using MaterialNames = std::map<std::string, std::int32_t>;

// What a material may refer to, and where textures of its own go.
struct MaterialSources {
  const DeclaredTextures& declared;
  const MaterialNames& names;
  const std::vector<Material>& materials;
  AssetReader& assets;
  std::vector<Texture>& textures;
};

// True for the types of material that pbrt-v3 had and pbrt-v4 renamed.
[[nodiscard]] bool IsPbrtV3Material(std::string_view type);
// True for the types that ReadMaterial reads.
[[nodiscard]] bool IsSupportedMaterial(std::string_view type);
[[nodiscard]] Material ReadMaterial(std::string_view type, ParameterList& parameters,
                                    const MaterialSources& sources);

}  // namespace lucerna
