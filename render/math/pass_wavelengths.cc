#include "render/math/pass_wavelengths.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <vector>

#include "render/base/status.h"
#include "render/math/color_matching.h"
#include "render/math/color_space.h"
#include "render/math/rng.h"
#include "render/math/sobol.h"

namespace lucerna {
namespace {

using Triple = std::array<double, 3>;
using Matrix = std::array<Triple, 3>;  // [row][column]

// The observer's curves times daylight, in the working space, as lines between whole nanometres;
// each with the integral 1, so that daylight is white.
class Daylight {
 public:
  Daylight() {
    for (std::size_t i = 0; i <= kCells; ++i) {
      const double nm = kFirstObservedNm + static_cast<double>(i);
      const Triple rec709 = Rec709(CieObserver(nm));
      Triple& curve = curves_.emplace_back();
      for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t k = 0; k < 3; ++k)
          curve[c] += kWorkingFrom709[c][k] * rec709[k];
        curve[c] *= D65At(nm);
      }
    }
    Triple sum{};
    for (std::size_t i = 0; i < kCells; ++i) {
      for (std::size_t c = 0; c < 3; ++c)
        sum[c] += 0.5 * (curves_[i][c] + curves_[i + 1][c]);
    }
    integrals_.emplace_back();
    for (std::size_t i = 0; i <= kCells; ++i) {
      for (std::size_t c = 0; c < 3; ++c)
        curves_[i][c] /= sum[c];
    }
    for (std::size_t i = 0; i < kCells; ++i) {
      Triple& integral = integrals_.emplace_back(integrals_.back());
      for (std::size_t c = 0; c < 3; ++c)
        integral[c] += 0.5 * (curves_[i][c] + curves_[i + 1][c]);
    }
  }

  [[nodiscard]] Triple At(double nm) const {
    const auto [i, f] = CellOf(nm);
    Triple value;
    for (std::size_t c = 0; c < 3; ++c)
      value[c] = curves_[i][c] * (1 - f) + curves_[i + 1][c] * f;
    return value;
  }
  // From the first wavelength to `nm`.
  [[nodiscard]] Triple IntegralTo(double nm) const {
    const auto [i, f] = CellOf(nm);
    Triple value;
    for (std::size_t c = 0; c < 3; ++c) {
      value[c] =
          integrals_[i][c] + f * (curves_[i][c] + 0.5 * f * (curves_[i + 1][c] - curves_[i][c]));
    }
    return value;
  }

 private:
  static constexpr std::size_t kCells =
      static_cast<std::size_t>(kLastObservedNm - kFirstObservedNm);
  struct Cell {
    std::size_t below;
    double share;
  };
  [[nodiscard]] static Cell CellOf(double nm) {
    const double place = std::clamp(nm - kFirstObservedNm, 0.0, static_cast<double>(kCells));
    const auto below = std::min(static_cast<std::size_t>(place), kCells - 1);
    return {below, place - static_cast<double>(below)};
  }

  std::vector<Triple> curves_;     // [kCells + 1]
  std::vector<Triple> integrals_;  // the same
};

const Daylight& TheDaylight() {
  static const Daylight daylight;
  return daylight;
}

double Determinant(const Matrix& m) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
         m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

// The x with m x = right, by Cramer's rule.
Triple Solve(const Matrix& m, const Triple& right) {
  const double determinant = Determinant(m);
  Triple x;
  for (std::size_t column = 0; column < 3; ++column) {
    Matrix replaced = m;
    for (std::size_t row = 0; row < 3; ++row)
      replaced[row][column] = right[row];
    x[column] = Determinant(replaced) / determinant;
  }
  return x;
}

// The parts, the one of the longest wavelengths first.
constexpr Triple kLow = {kThirdPartNm, kSecondPartNm, kFirstObservedNm};
constexpr Triple kHigh = {kLastObservedNm, kThirdPartNm, kSecondPartNm};

Matrix CurvesAt(const Triple& nm) {
  Matrix curves;
  for (std::size_t i = 0; i < 3; ++i) {
    const Triple at = TheDaylight().At(nm[i]);
    for (std::size_t row = 0; row < 3; ++row)
      curves[row][i] = at[row];
  }
  return curves;
}

// Newton's method from wavelengths of a t nearby.
void MoveTo(double t, Triple& nm) {
  constexpr int kMostSteps = 50;
  constexpr double kTolerance = 1e-13;
  for (int step = 0; step < kMostSteps; ++step) {
    Triple missing = {t, t, t};
    double largest = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const Triple to = TheDaylight().IntegralTo(nm[i]);
      const Triple from = TheDaylight().IntegralTo(kLow[i]);
      for (std::size_t c = 0; c < 3; ++c)
        missing[c] -= to[c] - from[c];
    }
    for (const double value : missing)
      largest = std::max(largest, std::abs(value));
    if (largest < kTolerance) return;
    const Triple change = Solve(CurvesAt(nm), missing);
    // Not out of any part, where curves are next to zero.
    double share = 1;
    for (std::size_t i = 0; i < 3; ++i) {
      const double room = 0.95 * (change[i] > 0 ? kHigh[i] - nm[i] : nm[i] - kLow[i]);
      if (share * std::abs(change[i]) > room) share = room / std::abs(change[i]);
    }
    for (std::size_t i = 0; i < 3; ++i)
      nm[i] = std::clamp(nm[i] + share * change[i], kLow[i], kHigh[i]);
  }
}

}  // namespace

PassWavelengths WavelengthsAt(double t) {
  // At the very ends the curves are too small to tell wavelengths apart.
  constexpr double kNearest = 1e-5;
  t = std::clamp(t, kNearest, 1 - kNearest);
  // From the middle to `t` in steps within which the method cannot go astray.
  constexpr int kSteps = 64;
  Triple nm = {618, 536, 451};
  MoveTo(0.5, nm);
  for (int step = 1; step <= kSteps; ++step)
    MoveTo(0.5 + (t - 0.5) * step / kSteps, nm);

  PassWavelengths wavelengths;
  wavelengths.nm = nm;
  const Matrix curves = CurvesAt(nm);
  const Triple speed = Solve(curves, {1, 1, 1});
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t i = 0; i < 3; ++i)
      wavelengths.to_working[row][i] = curves[row][i] * speed[i];
  }
  return wavelengths;
}

PassWavelengths WavelengthsOfPass(std::uint64_t seed, std::uint64_t pass) {
  constexpr std::uint64_t kKey = 0x50415353574C454EULL;
  // A dimension of Sobol's sequence that eye paths leave free. Their places on film and lens are
  // the first four, scrambled, and a fifth chooses among these wavelengths: with one of those each
  // part of a pixel would see a part of the wavelengths, for ever. Where sets of eye paths take
  // turns, each set meets all of them in time.
  constexpr int kFreeDimension = 5;
  const std::uint32_t digits = SobolDigits(static_cast<std::uint32_t>(pass / 2), kFreeDimension);
  // Shifted by the seed, and odd passes once more: they lie between the even ones.
  const double shift = static_cast<double>(KeyedRng(CombineKeys(seed, kKey)).Uniform()) +
                       (pass % 2 == 0 ? 0.0 : 1.0 / 3);
  const double place = static_cast<double>(digits) * 0x1p-32 + shift;
  // There and back, so that what goes over the end of the range comes in where it left: a sum over
  // even places of a function that is continuous around the circle converges faster.
  return WavelengthsAt(1 - std::abs(2 * (place - std::floor(place)) - 1));
}

}  // namespace lucerna
