// How does an index of refraction depend on the wavelength?
//
// Cauchy's equation with three terms, n = a + b/λ² + c/λ⁴, written around the helium d line, so
// that the index there is the one that catalogues give. It follows Sellmeier's equation of glasses
// within 1e-4 where the eye sees.
#pragma once

#include <functional>

namespace lucerna {

inline constexpr double kHeliumDNm = 587.6;
// What the eye sees, but for a thousandth.
inline constexpr double kFirstVisibleNm = 400, kLastVisibleNm = 700;

struct Dispersion {
  float b_um2 = 0;
  float c_um4 = 0;

  [[nodiscard]] bool is_none() const { return b_um2 == 0 && c_um4 == 0; }
  bool operator==(const Dispersion&) const = default;
};

struct RefractiveIndex {
  float at_d = 1.5F;
  Dispersion dispersion;
};

// The index at `nm` > 0 of a material with the index `at_d`.
[[nodiscard]] float IndexAt(float nm, float at_d, const Dispersion& dispersion);

// The one that comes closest to `index_at`, in squares over evenly spaced visible wavelengths, and
// has its value at the d line; none where the index is the same everywhere.
[[nodiscard]] Dispersion FitDispersion(const std::function<double(double nm)>& index_at);

}  // namespace lucerna
