// An image of a scene whose diffuse light is that of a baked mesh.
//
// Eye paths go as in any render, through mirrors and glass to the first surface on which photons
// would be gathered. There the radiance is that of a diffuse surface, L = rho E / pi: reflectance
// rho from the scene, which may have been painted anew, and irradiance E from the mesh. No photons
// are traced. Lights are sampled where the mesh has no direct light, and on surfaces where eye
// paths go on.
#pragma once

#include <cstdint>

#include "render/bake/mesh_file.h"
#include "render/base/status.h"
#include "render/image/image.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"

namespace lucerna {

struct MeshRender {
  Image image;               // with the layers of any image, `photons` being what the mesh brings
  double share_unknown = 0;  // of the light paths' ends: nothing of the mesh lies there
};

// The mean of the passes of `settings`, which are above 0. `threads` as of ThreadTeam; the
// image does not depend on it.
// Errors: those of PreparedScene::PrepareFor.
[[nodiscard]] StatusOr<MeshRender> RenderFromMesh(const Scene& scene,
                                                  const RenderSettings& settings,
                                                  const BakedMesh& mesh, int threads);

}  // namespace lucerna
