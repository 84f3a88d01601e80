// Meshes of a glTF document as triangles in a space of their own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "render/formats/gltf/accessors.h"
#include "render/formats/gltf/materials.h"
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

struct GltfPrimitive {
  TriangleMesh mesh;  // with its traits; never empty
  std::string place;  // for messages
  [[nodiscard]] bool emits() const { return mesh.traits.area_light != kNoAreaLight; }
};

class GltfMeshes {
 public:
  // All outlive it.
  GltfMeshes(const GltfDocument& document, GltfBuffers& buffers, GltfMaterials& materials,
             GltfBudget& budget)
      : document_(document), buffers_(buffers), materials_(materials), budget_(budget) {}

  // The primitives of a mesh that have triangles and can be seen. Errors are in the diagnostics.
  [[nodiscard]] std::vector<GltfPrimitive> Read(std::size_t mesh);

 private:
  [[nodiscard]] std::optional<TriangleMesh> ReadPrimitive(const GltfObject& primitive,
                                                          const GltfSurface& surface);

  const GltfDocument& document_;
  GltfBuffers& buffers_;
  GltfMaterials& materials_;
  GltfBudget& budget_;
};

}  // namespace lucerna
