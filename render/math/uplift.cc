#include "render/math/uplift.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "render/base/status.h"
#include "render/math/color_matching.h"

namespace lucerna {
namespace {

using Triple = std::array<double, 3>;

// A polynomial's coefficients; beyond this size spectra are steps.
constexpr double kLargestCoefficient = 1000;

// What a reflectance looks like in daylight: sums over wavelengths 5 nm apart.
struct Observer {
  static constexpr std::size_t kSamples = 81;
  std::array<double, kSamples> x{};  // as the polynomial takes it
  std::array<Triple, kSamples> xyz{};
  Triple white{};

  Observer() {
    for (std::size_t i = 0; i < kSamples; ++i) {
      const double nm = kFirstObservedNm + 5 * static_cast<double>(i);
      x[i] = PolynomialPlace(nm);
      xyz[i] = CieObserver(nm);
      for (std::size_t c = 0; c < 3; ++c) {
        xyz[i][c] *= D65At(nm);
        white[c] += xyz[i][c];
      }
    }
  }
};

const Observer& TheObserver() {
  static const Observer observer;
  return observer;
}

// CIE L*a*b* is made of these of X, Y and Z over those of white; and the slope.
double LabRoot(double share, double& slope) {
  constexpr double kLinear = 216.0 / 24389;
  if (share > kLinear) {
    const double root = std::cbrt(share);
    slope = root / (3 * share);
    return root;
  }
  slope = 841.0 / 108;
  return slope * share + 4.0 / 29;
}

Triple LabOf(const Triple& roots) {
  return {116 * roots[1] - 16, 500 * (roots[0] - roots[1]), 200 * (roots[1] - roots[2])};
}

// Of X, Y and Z over those of white.
Triple LabOfShares(const Triple& shares) {
  Triple roots;
  double slope = 0;
  for (std::size_t c = 0; c < 3; ++c)
    roots[c] = LabRoot(shares[c], slope);
  return LabOf(roots);
}

// X, Y and Z of a Rec. 709 colour over those of white.
Triple SharesOf(const Triple& rec709) {
  // The rows of IEC 61966-2-1, each over its sum: white is (1, 1, 1).
  constexpr std::array<Triple, 3> kRows = {{{0.4124564, 0.3575761, 0.1804375},
                                            {0.2126729, 0.7151522, 0.0721750},
                                            {0.0193339, 0.1191920, 0.9503041}}};
  Triple shares{};
  for (std::size_t row = 0; row < 3; ++row) {
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      shares[row] += kRows[row][c] * rec709[c];
      sum += kRows[row][c];
    }
    shares[row] /= sum;
  }
  return shares;
}

struct Seen {
  Triple lab{};
  std::array<Triple, 3> slopes{};  // of each of lab, by each coefficient
};

Seen Look(const Triple& coefficients) {
  const Observer& observer = TheObserver();
  Triple sum{};
  std::array<Triple, 3> by{};  // [of X, Y, Z][by coefficient]
  for (std::size_t i = 0; i < Observer::kSamples; ++i) {
    const double x = observer.x[i];
    const double p = coefficients[0] + x * (coefficients[1] + x * coefficients[2]);
    const double root = std::sqrt(1 + p * p);
    const double value = 0.5 + 0.5 * p / root;
    const double slope = 0.5 / (root * root * root);
    for (std::size_t c = 0; c < 3; ++c) {
      const double weight = observer.xyz[i][c];
      sum[c] += weight * value;
      by[c][0] += weight * slope;
      by[c][1] += weight * slope * x;
      by[c][2] += weight * slope * x * x;
    }
  }
  Seen seen;
  Triple roots{};
  for (std::size_t c = 0; c < 3; ++c) {
    double slope = 0;
    roots[c] = LabRoot(sum[c] / observer.white[c], slope);
    for (double& derivative : by[c])
      derivative *= slope / observer.white[c];
  }
  seen.lab = LabOf(roots);
  for (std::size_t k = 0; k < 3; ++k) {
    seen.slopes[0][k] = 116 * by[1][k];
    seen.slopes[1][k] = 500 * (by[0][k] - by[1][k]);
    seen.slopes[2][k] = 200 * (by[1][k] - by[2][k]);
  }
  return seen;
}

double SquaredDistance(const Triple& a, const Triple& b) {
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c)
    sum += (a[c] - b[c]) * (a[c] - b[c]);
  return sum;
}

// The x with m x = right, m symmetric and positive; false where it has none.
bool SolveSymmetric(const std::array<Triple, 3>& m, const Triple& right, Triple& x) {
  const auto determinant = [](const std::array<Triple, 3>& a) {
    return a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
           a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
           a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
  };
  const double whole = determinant(m);
  if (!(whole > 0)) return false;
  for (std::size_t column = 0; column < 3; ++column) {
    std::array<Triple, 3> replaced = m;
    for (std::size_t row = 0; row < 3; ++row)
      replaced[row][column] = right[row];
    x[column] = determinant(replaced) / whole;
  }
  return true;
}

// Levenberg and Marquardt's method, from a polynomial of a colour nearby.
void Approach(const Triple& lab, int most_steps, Triple& coefficients) {
  constexpr double kNear = 1e-8;  // the square of a difference in L*a*b*
  double damping = 1e-4;
  Seen seen = Look(coefficients);
  double distance = SquaredDistance(seen.lab, lab);
  for (int step = 0; step < most_steps && distance > kNear; ++step) {
    std::array<Triple, 3> normal{};
    Triple right{};
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t k = 0; k < 3; ++k) {
        right[k] += seen.slopes[row][k] * (lab[row] - seen.lab[row]);
        for (std::size_t l = 0; l < 3; ++l)
          normal[k][l] += seen.slopes[row][k] * seen.slopes[row][l];
      }
    }
    for (std::size_t k = 0; k < 3; ++k)
      normal[k][k] *= 1 + damping;
    Triple change{};
    if (!SolveSymmetric(normal, right, change)) return;
    Triple next = coefficients;
    for (std::size_t k = 0; k < 3; ++k)
      next[k] = std::clamp(next[k] + change[k], -kLargestCoefficient, kLargestCoefficient);
    Seen seen_next = Look(next);
    const double distance_next = SquaredDistance(seen_next.lab, lab);
    if (distance_next < distance) {
      coefficients = next;
      seen = seen_next;
      distance = distance_next;
      damping = std::max(damping * 0.1, 1e-12);
    } else {
      damping *= 10;
      if (damping > 1e8) return;
    }
  }
}

// The polynomial that is the same everywhere and has this value.
Triple Constant(double value) {
  const double held = std::clamp(value, 1e-4, 1 - 1e-4);
  const double s = 2 * held - 1;
  return {s / std::sqrt(1 - s * s), 0, 0};
}

Triple Fit(const Triple& color) {
  constexpr int kSteps = 8;
  constexpr int kMostIterations = 40;
  // From grey of the same luminance, with more and more of the colour.
  const double gray = 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2];
  Triple coefficients = Constant(gray);
  for (int step = 1; step <= kSteps; ++step) {
    Triple part;
    for (std::size_t c = 0; c < 3; ++c)
      part[c] = gray + (color[c] - gray) * step / kSteps;
    Approach(LabOfShares(SharesOf(part)), kMostIterations, coefficients);
  }
  return coefficients;
}

SigmoidPolynomial ToFloat(const Triple& c) {
  return {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
}

double SmoothStep(double t) {
  return t * t * (3 - 2 * t);
}

}  // namespace

double PolynomialPlace(double nm) {
  return 2 * (nm - kFirstObservedNm) / (kLastObservedNm - kFirstObservedNm) - 1;
}

SigmoidPolynomial FitReflectance(Rgb color) {
  return ToFloat(Fit(
      {static_cast<double>(color.r), static_cast<double>(color.g), static_cast<double>(color.b)}));
}

// Polynomials by the largest channel, its value, and the two others over it.
class Uplift::Table {
 public:
  Table() {
    for (std::size_t i = 0; i < kSide; ++i) {
      // Denser near black and white, where polynomials change fastest.
      values_[i] = static_cast<float>(
          SmoothStep(SmoothStep(static_cast<double>(i) / static_cast<double>(kSide - 1))));
    }
    polynomials_.resize(3 * kSide * kSide * kSide);
    for (std::size_t largest = 0; largest < 3; ++largest) {
      for (std::size_t y = 0; y < kSide; ++y) {
        for (std::size_t x = 0; x < kSide; ++x)
          FillRow(largest, x, y);
      }
    }
  }

  // Of a colour in [0, 1] that is not grey.
  [[nodiscard]] SigmoidPolynomial At(Rgb color) const {
    const int largest =
        color.r >= color.g ? (color.r >= color.b ? 0 : 2) : (color.g >= color.b ? 1 : 2);
    const float value = color[largest];
    const auto last = static_cast<float>(kSide - 1);
    const auto node = [](float place, float& share) {
      const auto below = std::min(static_cast<std::size_t>(place), kSide - 2);
      share = place - static_cast<float>(below);
      return below;
    };
    std::array<float, 3> share{};
    const std::size_t x = node(color[(largest + 1) % 3] / value * last, share[0]);
    const std::size_t y = node(color[(largest + 2) % 3] / value * last, share[1]);
    const auto above = std::upper_bound(values_.begin() + 1, values_.end() - 1, value);
    const auto z = static_cast<std::size_t>(above - values_.begin()) - 1;
    share[2] = (value - values_[z]) / (values_[z + 1] - values_[z]);
    SigmoidPolynomial sum;
    for (std::size_t corner = 0; corner < 8; ++corner) {
      const std::size_t dx = corner & 1;
      const std::size_t dy = corner >> 1 & 1;
      const std::size_t dz = corner >> 2;
      const float weight = (dx != 0 ? share[0] : 1 - share[0]) *
                           (dy != 0 ? share[1] : 1 - share[1]) *
                           (dz != 0 ? share[2] : 1 - share[2]);
      const SigmoidPolynomial& at =
          polynomials_[Index(static_cast<std::size_t>(largest), x + dx, y + dy, z + dz)];
      sum.c0 += weight * at.c0;
      sum.c1 += weight * at.c1;
      sum.c2 += weight * at.c2;
    }
    return sum;
  }

 private:
  static constexpr std::size_t kSide = 32;
  static std::size_t Index(std::size_t largest, std::size_t x, std::size_t y, std::size_t z) {
    return ((largest * kSide + y) * kSide + x) * kSide + z;
  }

  // All values of the largest channel, from a middle one outwards.
  void FillRow(std::size_t largest, std::size_t x, std::size_t y) {
    constexpr std::size_t kMiddle = kSide / 2;
    constexpr int kMostIterations = 12;
    const auto color = [&](std::size_t z) {
      // Black has no polynomial.
      const double value = std::max(static_cast<double>(values_[z]), 1e-4);
      Triple c;
      c[largest] = value;
      c[(largest + 1) % 3] = value * static_cast<double>(x) / (kSide - 1);
      c[(largest + 2) % 3] = value * static_cast<double>(y) / (kSide - 1);
      return c;
    };
    const Triple middle = Fit(color(kMiddle));
    Triple coefficients = middle;
    for (std::size_t z = kMiddle; z < kSide; ++z) {
      Approach(LabOfShares(SharesOf(color(z))), kMostIterations, coefficients);
      polynomials_[Index(largest, x, y, z)] = ToFloat(coefficients);
    }
    coefficients = middle;
    for (std::size_t z = kMiddle; z-- > 0;) {
      Approach(LabOfShares(SharesOf(color(z))), kMostIterations, coefficients);
      polynomials_[Index(largest, x, y, z)] = ToFloat(coefficients);
    }
  }

  std::array<float, kSide> values_{};
  std::vector<SigmoidPolynomial> polynomials_;
};

const Uplift::Table& Uplift::TheTable() {
  static const Table table;
  return table;
}

Uplift::Uplift(const PassWavelengths& wavelengths) : wavelengths_(wavelengths) {
  for (std::size_t i = 0; i < 3; ++i)
    x_[i] = static_cast<float>(PolynomialPlace(wavelengths.nm[i]));
}

Rgb Uplift::Reflectance(Rgb color) const {
  if (IsGray(color)) return Gray(color.g);
  const SigmoidPolynomial polynomial = TheTable().At(color);
  return {polynomial.At(x_[0]), polynomial.At(x_[1]), polynomial.At(x_[2])};
}

Rgb Uplift::Unbounded(Rgb color) const {
  if (IsGray(color)) return Gray(color.g);
  const float scale = 2 * MaxChannel(color);
  return Reflectance(color / scale) * scale;
}

}  // namespace lucerna
