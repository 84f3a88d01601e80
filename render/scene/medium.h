// What fills a part of space and absorbs or scatters light there: homogeneous media.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "render/math/rgb.h"
#include "render/scene/given_spectrum.h"

namespace lucerna {

inline constexpr std::int32_t kNoMedium = -1;

struct Medium {
  std::string name;  // for messages and the plan
  // Coefficients [1 / scene unit] of absorption and scattering, each channel >= 0. Light that
  // travels a length d keeps exp(-(absorption + scattering) d) of its radiance.
  Rgb absorption, scattering;
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
  [[nodiscard]] bool Scatters() const { return !IsBlack(scattering); }
  // What is left of radiance after `length` [scene units]; a channel without extinction keeps all
  // of it after an infinite length too.
  [[nodiscard]] Rgb Transmittance(float length) const {
    const Rgb extinction = Extinction();
    const auto of = [length](float coefficient) {
      return coefficient > 0 ? std::exp(-coefficient * length) : 1.0F;
    };
    return {of(extinction.r), of(extinction.g), of(extinction.b)};
  }
};

}  // namespace lucerna
