// The node tree of a glTF document: where its meshes, cameras and lights stand.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "render/formats/gltf/accessors.h"
#include "render/formats/gltf/document.h"
#include "render/formats/gltf/meshes.h"
#include "render/math/transform.h"

namespace lucerna {

// Something that a node names by its number, and where.
struct GltfPlace {
  std::size_t index = 0;
  Transform to_world;
};

struct GltfPlaces {
  std::vector<std::vector<Transform>> meshes;  // by the number of the mesh
  std::vector<GltfPlace> cameras, lights;      // in the order in which the tree is walked
};

// Walks the scene that the document shows. Each node is visited once: one that is reached twice is
// an error, so there are no cycles. Errors are in the diagnostics.
[[nodiscard]] GltfPlaces WalkNodes(const GltfDocument& document, GltfBuffers& buffers,
                                   GltfBudget& budget);

}  // namespace lucerna
