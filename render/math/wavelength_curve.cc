#include "render/math/wavelength_curve.h"

#include <algorithm>
#include <cstddef>

namespace lucerna {

double WavelengthCurve::At(double nm) const {
  if (wavelength_nm.empty() || nm < wavelength_nm.front() || nm > wavelength_nm.back()) return 0;
  return AtClamped(nm);
}

double WavelengthCurve::AtClamped(double nm) const {
  const auto above = std::upper_bound(wavelength_nm.begin(), wavelength_nm.end(), nm);
  if (above == wavelength_nm.begin()) return value.front();
  if (above == wavelength_nm.end()) return value.back();
  const auto i = static_cast<std::size_t>(above - wavelength_nm.begin());
  const double t = (nm - wavelength_nm[i - 1]) / (wavelength_nm[i] - wavelength_nm[i - 1]);
  return value[i - 1] * (1 - t) + value[i] * t;
}

}  // namespace lucerna
