#include "render/transport/infinite_emission.h"

#include "render/math/warp.h"

namespace lucerna {

Ray EnteringRay(Vec3 towards, const BoundingSphere& scene, const EmissionNumbers& u) {
  const Frame frame(-towards);
  const Vec3 disk = SquareToDisk(u.place1, u.place2) * scene.radius;
  return {scene.center + towards * scene.radius + frame.s * disk.x + frame.t * disk.y, -towards,
          HUGE_VALF};
}

}  // namespace lucerna
