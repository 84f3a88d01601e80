// Materials of a glTF document as materials, lights and media of the scene.
//
// The metallic-roughness model is a mix: a metal whose reflectance at right angles is the base
// colour, with the share `metallic`, and else a diffuse base of that colour under a coat, of which
// a share `transmission` is glass. Only what a material uses is made: most are one of the three.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "render/formats/gltf/document.h"
#include "render/formats/gltf/textures.h"
#include "render/scene/scene.h"

namespace lucerna {

// What a primitive has of its material.
struct GltfSurface {
  ShapeTraits traits;  // area_light too: a light for all shapes of the material
  std::uint64_t tex_coord = 0;
  bool has_textures = false;
};

class GltfMaterials {
 public:
  // Both outlive it.
  GltfMaterials(const GltfDocument& document, GltfTextures& textures, Scene& scene)
      : document_(document), textures_(textures), scene_(scene) {}

  // nullopt: the material that the format gives to primitives without one. `has_colors`: of meshes
  // whose vertices have colours, by which the base colour is multiplied. As long-lived as this.
  [[nodiscard]] const GltfSurface& Get(std::optional<std::size_t> material, bool has_colors);

 private:
  const GltfDocument& document_;
  GltfTextures& textures_;
  Scene& scene_;
  std::map<std::pair<std::optional<std::size_t>, bool>, GltfSurface> surfaces_;
};

}  // namespace lucerna
