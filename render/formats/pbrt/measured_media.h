// Media that pbrt files refer to by name.
#pragma once

#include <string>
#include <string_view>

#include "render/math/rgb.h"

namespace lucerna {

// Coefficients [1/mm] of absorption and of scattering that keeps no direction (reduced by its mean
// cosine), linear Rec. 709.
struct MeasuredMedium {
  std::string_view name;
  Rgb absorption, scattering;
};

// nullptr when there is none of this name.
[[nodiscard]] const MeasuredMedium* FindMeasuredMedium(std::string_view name);

// "there are Apple, ... and Wholemilk".
[[nodiscard]] std::string MeasuredMediaThereAre();

}  // namespace lucerna
