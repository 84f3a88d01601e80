// Reads Material and MakeNamedMaterial directives.
#pragma once

#include <string_view>

#include "render/formats/pbrt/parameter_list.h"
#include "render/formats/pbrt/textures.h"
#include "render/scene/scene.h"

namespace lucerna {

// True for the types of material that pbrt-v3 had and pbrt-v4 renamed.
[[nodiscard]] bool IsPbrtV3Material(std::string_view type);
// True for the types that ReadMaterial reads.
[[nodiscard]] bool IsSupportedMaterial(std::string_view type);
[[nodiscard]] Material ReadMaterial(std::string_view type, ParameterList& parameters,
                                    const TextureNames& names);

}  // namespace lucerna
