// Reads MakeNamedMedium directives.
#pragma once

#include <cstdint>

#include "render/formats/pbrt/parameter_list.h"
#include "render/math/transform.h"
#include "render/scene/medium.h"

namespace lucerna {

// Points of the grids that clouds become, of all in a scene: their noise takes a second for every
// million or two.
inline constexpr std::uint64_t kMostCloudPoints = std::uint64_t{1} << 26;

// `to_world`: of the directive; for densities. `cloud_points_left` falls by those of a cloud.
[[nodiscard]] Medium ReadMedium(ParameterList& parameters, const Transform& to_world,
                                std::uint64_t& cloud_points_left);

}  // namespace lucerna
