// Skins of a glTF document: where the joints of one bring the vertices that follow them.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "render/formats/gltf/accessors.h"
#include "render/formats/gltf/document.h"
#include "render/formats/gltf/meshes.h"
#include "render/math/transform.h"

namespace lucerna {

// The transform of a matrix, given by columns, whose fourth row is 0 0 0 1 but for rounding;
// nullopt for other matrices.
[[nodiscard]] std::optional<Transform> AffineOf(const std::array<double, 16>& columns);

// For each joint, the transform from the mesh as it is modelled to the world. `node_to_world` has a
// value for each node that is in the scene. nullopt: an error, which is in the diagnostics.
[[nodiscard]] std::optional<std::vector<Transform>> ReadGltfSkin(
    const GltfDocument& document, std::size_t skin, GltfBuffers& buffers, GltfBudget& budget,
    const std::vector<std::optional<Transform>>& node_to_world);

}  // namespace lucerna
