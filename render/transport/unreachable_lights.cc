#include "render/transport/unreachable_lights.h"

namespace lucerna {

LightNumbers::LightNumbers(const Scene& scene) {
  const auto count = [](const auto& items) { return static_cast<std::uint32_t>(items.size()); };
#define LUCERNA_NUMBER(Name, list, name) \
  list = next;                           \
  next += count(scene.list);
  std::uint32_t next = count(scene.meshes);
  LUCERNA_ANALYTIC_SHAPES(LUCERNA_NUMBER)
  delta = next;
  LUCERNA_DELTA_LIGHTS(LUCERNA_NUMBER)
#undef LUCERNA_NUMBER
  infinite = next;
  end = infinite + count(scene.infinite_lights);
}

}  // namespace lucerna
