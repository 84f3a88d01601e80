// Meshes of a glTF document as triangles in a space of their own, or in the world when a skin
// places them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "render/formats/gltf/accessors.h"
#include "render/formats/gltf/materials.h"
#include "render/math/transform.h"
#include "render/scene/scene.h"

namespace lucerna {

// What the shapes of a scene may take: checked before anything is laid out, and never given back,
// so that it bounds time too.
class GltfBudget {
 public:
  GltfBudget(const GltfDocument& document, const SceneLimits& limits)
      : document_(document), limits_(limits) {}

  // False, with an error, when that is too much: reading must end.
  [[nodiscard]] bool Take(std::uint64_t triangles, std::uint64_t size_bytes);
  [[nodiscard]] bool is_spent() const { return is_spent_; }

 private:
  const GltfDocument& document_;
  const SceneLimits& limits_;
  std::uint64_t triangles_ = 0;
  std::uint64_t size_bytes_ = 0;
  bool is_spent_ = false;
};

// A mesh in one of the shapes that nodes give it.
struct GltfShape {
  std::size_t mesh = 0;
  std::vector<double> weights;  // of its morph targets; none: those that the mesh has
  std::optional<std::size_t> skin;
  auto operator<=>(const GltfShape&) const = default;
};

struct GltfPrimitive {
  TriangleMesh mesh;  // with its traits; never empty
  std::string place;  // for messages
  // Placed by a skin: no transform of a node applies to it (glTF 2.0, 3.7.3.3).
  bool is_in_world = false;
  [[nodiscard]] bool emits() const { return mesh.traits.area_light != kNoAreaLight; }
};

class GltfMeshes {
 public:
  // All outlive it.
  GltfMeshes(const GltfDocument& document, GltfBuffers& buffers, GltfMaterials& materials,
             GltfBudget& budget)
      : document_(document), buffers_(buffers), materials_(materials), budget_(budget) {}

  // The primitives of a mesh that have triangles and can be seen; `joints` are those of the shape's
  // skin (skins.h). Errors are in the diagnostics.
  [[nodiscard]] std::vector<GltfPrimitive> Read(const GltfShape& shape,
                                                std::span<const Transform> joints);

 private:
  const GltfDocument& document_;
  GltfBuffers& buffers_;
  GltfMaterials& materials_;
  GltfBudget& budget_;
};

}  // namespace lucerna
