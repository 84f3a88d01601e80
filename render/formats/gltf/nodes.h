// The node tree of a glTF document: where its meshes, cameras and lights stand.
#pragma once

#include <cstddef>
#include <map>
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
  std::map<GltfShape, std::vector<Transform>> meshes;
  // What the joints of a skin do (skins.h), by its number; not of a skin that has an error.
  std::map<std::size_t, std::vector<Transform>> joints;
  std::vector<GltfPlace> cameras, lights;  // in the order in which the tree is walked
};

// Walks the scene that the document shows. Of nodes that are not visible (KHR_node_visibility) only
// cameras count. Each node is visited once: one that is reached twice is
// an error, so there are no cycles. Errors are in the diagnostics.
[[nodiscard]] GltfPlaces WalkNodes(const GltfDocument& document, GltfBuffers& buffers,
                                   GltfBudget& budget);

}  // namespace lucerna
