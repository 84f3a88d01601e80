// A quantity at wavelengths, as measurements give it.
#pragma once

#include <vector>

namespace lucerna {

// Values at wavelengths, linear between them and zero outside.
struct WavelengthCurve {
  std::vector<double> wavelength_nm;  // strictly increasing
  std::vector<double> value;          // one for each wavelength

  // The value at `nm`, zero outside the curve.
  [[nodiscard]] double At(double nm) const;
  // The value at `nm`, outside the curve that of its nearer end. Requires a curve of one or more.
  [[nodiscard]] double AtClamped(double nm) const;

  bool operator==(const WavelengthCurve&) const = default;
};

}  // namespace lucerna
