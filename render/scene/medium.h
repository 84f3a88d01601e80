// What fills a part of space and absorbs or scatters light there.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>

#include "render/math/rgb.h"
#include "render/math/vector.h"
#include "render/scene/given_spectrum.h"

namespace lucerna {

class DensityGrid;  // scene/density_grid.h

inline constexpr std::int32_t kNoMedium = -1;

struct Medium {
  std::string name;  // for messages and the plan
  // Coefficients [1 / scene unit] of absorption and scattering at density 1, each channel >= 0.
  // Light that travels through a column density d keeps exp(-(absorption + scattering) d) of its
  // radiance.
  Rgb absorption, scattering;
  // By place; nullptr: 1 everywhere.
  std::shared_ptr<const DensityGrid> density = nullptr;
  // Mean cosine between the directions before and after a scattering, in (-1, 1) (Henyey &
  // Greenstein 1941).
  float g = 0;
  // What of the two the file gives by wavelength.
  GivenSpectrum absorption_spectrum = {}, scattering_spectrum = {};

  bool operator==(const Medium&) const = default;

  [[nodiscard]] Rgb Extinction() const { return absorption + scattering; }
  // Of light that the medium takes from a beam, the share that it scatters, per channel.
  [[nodiscard]] Rgb ScatteredShare() const {
    const auto of = [](float absorbed, float scattered) {
      return scattered > 0 ? scattered / (absorbed + scattered) : 0.0F;
    };
    return {of(absorption.r, scattering.r), of(absorption.g, scattering.g),
            of(absorption.b, scattering.b)};
  }
  [[nodiscard]] float GreatestDensity() const;
  [[nodiscard]] bool Scatters() const { return !IsBlack(scattering); }
  // What is left of radiance behind a column density [scene units of density 1]; a channel without
  // extinction keeps all of it behind an infinite one too.
  [[nodiscard]] Rgb Transmittance(float column) const {
    const Rgb extinction = Extinction();
    const auto of = [column](float coefficient) {
      return coefficient > 0 ? std::exp(-coefficient * column) : 1.0F;
    };
    return {of(extinction.r), of(extinction.g), of(extinction.b)};
  }

  // How far light gets along a ray of unit direction: until it has passed `column`, but `length` at
  // most. Both may be infinite.
  struct Way {
    float length = 0, column = 0;
    bool is_through = true;  // through `length`
  };
  [[nodiscard]] Way Travel(Vec3 origin, Vec3 direction, float length, float column) const {
    if (density != nullptr) return TravelUnevenly(origin, direction, length, column);
    return column < length ? Way{column, column, false} : Way{length, length, true};
  }
  // The column density of `length`.
  [[nodiscard]] float Column(Vec3 origin, Vec3 direction, float length) const {
    return Travel(origin, direction, length, HUGE_VALF).column;
  }

 private:
  [[nodiscard]] Way TravelUnevenly(Vec3 origin, Vec3 direction, float length, float column) const;
};

}  // namespace lucerna
