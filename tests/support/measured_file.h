// How is a measured BSDF made without a goniometer?
//
// The arrays of a metal of GGX facets, whose BSDF is known in closed form, at the knots that a file
// of measurements has.
#pragma once

#include <string>
#include <vector>

#include "render/scene/material.h"
#include "render/scene/measured_table.h"

namespace lucerna {

struct MetalToMeasure {
  float alpha_u = 0.3F, alpha_v = 0.3F;
  std::vector<float> wavelength_nm = {400, 500, 600, 700};
  std::vector<float> reflectance = {1, 1, 1, 1};  // at the wavelengths, at all angles
  std::size_t knots = 32;                         // of each dimension of its grids
  std::size_t thetas = 8, phis = 1;               // directions to the eye
  // The part of a turn that was measured; the rest mirrors it. Of several directions around the
  // normal.
  float turn = 1;
};

[[nodiscard]] MeasuredData MeasureMetal(const MetalToMeasure& metal);
// The bytes of a file with these arrays.
[[nodiscard]] std::string MeasuredFile(const MeasuredData& data);
[[nodiscard]] Material MeasuredMaterial(MeasuredData data);

}  // namespace lucerna
