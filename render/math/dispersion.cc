#include "render/math/dispersion.h"

#include <algorithm>
#include <cmath>

namespace lucerna {
namespace {

// 1/λ² less that of the d line, and the same of 1/λ⁴ [µm⁻², µm⁻⁴].
struct Terms {
  double b = 0, c = 0;
};

Terms TermsAt(double nm) {
  constexpr double kAtD = 1e6 / (kHeliumDNm * kHeliumDNm);
  const double square = 1e6 / (nm * nm);
  return {square - kAtD, square * square - kAtD * kAtD};
}

}  // namespace

float IndexAt(float nm, float at_d, const Dispersion& dispersion) {
  const Terms terms = TermsAt(static_cast<double>(nm));
  return at_d + dispersion.b_um2 * static_cast<float>(terms.b) +
         dispersion.c_um4 * static_cast<float>(terms.c);
}

Dispersion FitDispersion(const std::function<double(double nm)>& index_at) {
  constexpr double kStepNm = 5;
  const double at_d = index_at(kHeliumDNm);
  double bb = 0;
  double bc = 0;
  double cc = 0;
  double bn = 0;
  double cn = 0;
  double largest = 0;
  for (double nm = kFirstVisibleNm; nm <= kLastVisibleNm; nm += kStepNm) {
    const Terms terms = TermsAt(nm);
    const double above = index_at(nm) - at_d;
    bb += terms.b * terms.b;
    bc += terms.b * terms.c;
    cc += terms.c * terms.c;
    bn += terms.b * above;
    cn += terms.c * above;
    largest = std::max(largest, std::abs(above));
  }
  // Rounding, which no float can hold beside the index.
  if (largest < 1e-7 * at_d) return {};
  const double determinant = bb * cc - bc * bc;
  return {static_cast<float>((bn * cc - cn * bc) / determinant),
          static_cast<float>((cn * bb - bn * bc) / determinant)};
}

}  // namespace lucerna
