#include "render/transport/unreachable_lights.h"

namespace lucerna {

LightNumbers::LightNumbers(const Scene& scene) {
  const auto count = [](const auto& items) { return static_cast<std::uint32_t>(items.size()); };
  spheres = count(scene.meshes);
  disks = spheres + count(scene.spheres);
  delta = disks + count(scene.disks);
  std::uint32_t next = delta;
#define LUCERNA_NUMBER(Name, list, name) \
  list = next;                           \
  next += count(scene.list);
  LUCERNA_DELTA_LIGHTS(LUCERNA_NUMBER)
#undef LUCERNA_NUMBER
  infinite = next;
  end = infinite + count(scene.infinite_lights);
}

}  // namespace lucerna
