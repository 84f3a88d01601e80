// The density of pbrt-v4's medium "cloud", at the points of a grid.
#pragma once

#include <array>
#include <vector>

#include "render/math/vector.h"

namespace lucerna {

// A function of the place in the cloud's own space, in [0, 1]: five octaves of noise that get
// thinner up to y = 1, over a floor that is dense at y = 0 and gone at 0.5.
struct CloudShape {
  float density = 1;    // of what the noise brings
  float wispiness = 1;  // how far finer noise moves each place
  float frequency = 5;  // features of the widest octave in a length of 1
};
[[nodiscard]] float CloudDensityAt(const CloudShape& shape, Vec3 place);

// How many points along each axis of the box from `low` to `high` show its octaves: 2 for each
// feature of the finest one, but 2^24 in all at most.
[[nodiscard]] std::array<int, 3> CloudGridSize(const CloudShape& shape, Vec3 low, Vec3 high);

// [size[0] × size[1] × size[2]], x fastest: at the middles of the cells of the box, as DensityGrid
// has its points.
[[nodiscard]] std::vector<float> CloudDensities(const CloudShape& shape,
                                                const std::array<int, 3>& size, Vec3 low,
                                                Vec3 high);

}  // namespace lucerna
