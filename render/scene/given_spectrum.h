// Colours that a scene's file gives by wavelength, beside the three numbers made of them.
//
// Jobs that carry wavelengths (math/pass_wavelengths.h) use these where they are, and a smooth
// spectrum of the three numbers (math/uplift.h) where they are not.
#pragma once

#include <memory>
#include <utility>

#include "render/math/wavelength_curve.h"

namespace lucerna {

// A curve times a factor; none where `curve` is nullptr.
struct GivenSpectrum {
  std::shared_ptr<const WavelengthCurve> curve = nullptr;
  float factor = 1;

  [[nodiscard]] bool is_given() const { return curve != nullptr; }
  bool operator==(const GivenSpectrum& o) const {
    if (curve == nullptr || o.curve == nullptr) return curve == o.curve;
    return factor == o.factor && (curve == o.curve || *curve == *o.curve);
  }
};

struct MaterialSpectra {
  GivenSpectrum reflectance, transmittance;
  GivenSpectrum eta, k;      // of a metal
  GivenSpectrum absorption;  // of hair

  [[nodiscard]] bool HasAny() const {
    return reflectance.is_given() || transmittance.is_given() || eta.is_given() || k.is_given() ||
           absorption.is_given();
  }
  bool operator==(const MaterialSpectra&) const = default;
};

// Those of one material, most of which have none.
struct OwnedSpectra {
  std::shared_ptr<const MaterialSpectra> spectra = nullptr;

  OwnedSpectra() = default;
  explicit OwnedSpectra(MaterialSpectra given) {
    if (given.HasAny()) spectra = std::make_shared<const MaterialSpectra>(std::move(given));
  }
  bool operator==(const OwnedSpectra& o) const {
    if (spectra == nullptr || o.spectra == nullptr) return spectra == o.spectra;
    return spectra == o.spectra || *spectra == *o.spectra;
  }
};

}  // namespace lucerna
