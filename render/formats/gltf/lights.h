// Point, spot and directional lights (KHR_lights_punctual).
#pragma once

#include <vector>

#include "render/formats/gltf/document.h"
#include "render/formats/gltf/nodes.h"
#include "render/scene/scene.h"

namespace lucerna {

// Errors are in the diagnostics.
void AddGltfLights(const GltfDocument& document, const std::vector<GltfPlace>& places,
                   Scene& scene);

}  // namespace lucerna
