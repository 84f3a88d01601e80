#include "render/transport/unreachable_lights.h"

namespace lucerna {

LightNumbers::LightNumbers(const Scene& scene)
    : spheres(static_cast<std::uint32_t>(scene.meshes.size())),
      disks(spheres + static_cast<std::uint32_t>(scene.spheres.size())),
      points(disks + static_cast<std::uint32_t>(scene.disks.size())),
      spots(points + static_cast<std::uint32_t>(scene.point_lights.size())),
      distant(spots + static_cast<std::uint32_t>(scene.spot_lights.size())),
      infinite(distant + static_cast<std::uint32_t>(scene.distant_lights.size())),
      end(infinite + static_cast<std::uint32_t>(scene.infinite_lights.size())) {}

}  // namespace lucerna
