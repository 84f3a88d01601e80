// Numbers of a scene's lights, and the lights that a job need not trace or sample.
#pragma once

#include <cstdint>
#include <vector>

#include "render/scene/scene.h"

namespace lucerna {

// Lights are numbered: meshes, analytic shapes in the order of their kinds
// (scene/analytic_shapes.h; shapes that do not emit have a number too), then delta lights in the
// order of theirs (scene/light_list.h), then infinite lights. Each member is the number of the
// first of a kind.
struct LightNumbers {
  explicit LightNumbers(const Scene& scene);

#define LUCERNA_MEMBER(Name, list, name) std::uint32_t list = 0;
  LUCERNA_ANALYTIC_SHAPES(LUCERNA_MEMBER)
  std::uint32_t delta = 0;  // the first of any delta light
  LUCERNA_DELTA_LIGHTS(LUCERNA_MEMBER)
#undef LUCERNA_MEMBER
  std::uint32_t infinite = 0, end = 0;
};

// Lights by number, ascending.
struct UnreachableLights {
  // Their light never reaches what the camera can see: they send no photons and are not sampled.
  std::vector<std::uint32_t> of_photons;
  // Nothing that scatters their light has a line of sight to them: next-event estimation would
  // find nothing. Those of_photons are not repeated.
  std::vector<std::uint32_t> of_sampling;

  bool operator==(const UnreachableLights&) const = default;
};

// Which lights a LightSet leaves out.
struct LightSelection {
  UnreachableLights unreachable;
  // Whether the faces of one-sided lights that nothing lies in front of emit too.
  bool includes_faces_away = false;
};

}  // namespace lucerna
