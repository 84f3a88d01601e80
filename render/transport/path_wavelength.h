// At which wavelength does a path cross glass that bends each one differently?
//
// Paths carry three colours. At the first such surface all of them go on in one direction, that of
// a wavelength drawn for the path, and its weight is multiplied by that wavelength's colour. The
// mean colour over all draws is white, so that light which glass does not spread stays as it was.
// Wavelengths are drawn in proportion to the sum of their channels, so that none is brighter
// than another by that sum.
//
// Colours are those of the CIE 1931 observer in daylight, in the working space. Single wavelengths
// lie outside of it: what is below zero is cut off, and each channel scaled so that the mean is 1.
//
// In jobs that carry wavelengths a path has the values at three of them. At such a surface it keeps
// one, chosen for the path with a probability of a third, and so three times its value: on average
// that is what each of the three brings along its own way. A photon and an eye path that both meet
// such a surface choose independently; the two agree in one case of three and have nine times the
// value then, on average what it is.
#pragma once

#include "render/math/rgb.h"
#include "render/math/uplift.h"
#include "render/scene/material.h"

namespace lucerna {

class PathWavelength {
 public:
  // None: glass has its index at the d line.
  PathWavelength() = default;
  // Drawn by `u` in [0, 1).
  explicit PathWavelength(float u);
  // The same in a job that carries wavelengths; `uplift` nullptr: in one of three colours.
  PathWavelength(float u, const Uplift* uplift);

  [[nodiscard]] bool is_drawn() const { return nm_ > 0; }
  // Requires is_drawn().
  [[nodiscard]] float nm() const { return nm_; }
  // Its channels have the sum 3.
  [[nodiscard]] Rgb color() const { return color_; }
  // To be called at each surface that the path meets. True at the first that disperses: the path's
  // weight is to be multiplied by the colour.
  [[nodiscard]] bool IsFirstUsedAt(const MaterialNumbers& material) {
    if (!is_drawn() || was_used_ || !material.Disperses()) return false;
    was_used_ = true;
    return true;
  }

 private:
  float nm_ = 0;
  bool was_used_ = false;
  Rgb color_ = Gray(1);
};

}  // namespace lucerna
