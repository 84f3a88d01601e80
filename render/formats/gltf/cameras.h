// The camera of a glTF document.
#pragma once

#include <vector>

#include "render/formats/gltf/document.h"
#include "render/formats/gltf/nodes.h"
#include "render/scene/scene.h"

namespace lucerna {

// The first of the cameras. Sets the size of the film too, from the camera's aspect ratio. Errors
// are in the diagnostics.
void SetGltfCamera(const GltfDocument& document, const std::vector<GltfPlace>& places,
                   Scene& scene);

}  // namespace lucerna
