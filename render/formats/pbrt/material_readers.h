// The readers of each kind of material, defined in material_NAME.cc, and what they share.
//
// A reader sets the numbers of `material`, whose kind is set, from the parameters of its directive.
#pragma once

#include <cstdint>
#include <string_view>

#include "render/formats/pbrt/materials.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/formats/pbrt/textures.h"
#include "render/scene/material.h"

namespace lucerna {

// What the readers of all kinds of material are given.
struct MaterialInput {
  ParameterList& parameters;
  const MaterialSources& from;
};

#define LUCERNA_DECLARE(Name, name) void Read##Name(const MaterialInput& input, Material& material);
LUCERNA_MATERIALS(LUCERNA_DECLARE)
#undef LUCERNA_DECLARE

inline constexpr Range kIndexRange = {0.01, 100};  // of refraction
// Of phase functions in layers and below surfaces. Nearer to 1 nearly all light would go straight
// on, for which diffusion and few scatterings are no models.
inline constexpr Range kPhaseCosine = {-0.99, 0.99};

// Widths of facets: of a surface, or of the metal under a coat.
enum class Facets : std::uint8_t { kSurface, kBase };
// These widths, or the textures in their places, from remaproughness and roughness, uroughness and
// vroughness, whose names begin with `prefix`.
void ReadRoughness(std::string_view prefix, Facets facets, const MaterialInput& input,
                   Material& material);

// `ior` of a coat, from the parameter named `eta`; `thickness`, or the texture in its place, and
// what else the parameters of pbrt's layered materials set. Requires that roughness has been read.
void ReadCoat(std::string_view eta, const MaterialInput& input, Material& material);

// `eta` and `k` of a metal, from the parameters of these names or from reflectance, or its texture.
struct MetalParameters {
  std::string_view eta, k;
};
void ReadMetal(const MetalParameters& called, const MaterialInput& input, Material& material);

// The texture of colours that the parameter `name` refers to, if it is one and can be used; else
// kNoTexture.
[[nodiscard]] std::int32_t FindTexture(std::string_view name, const MaterialInput& input);

}  // namespace lucerna
