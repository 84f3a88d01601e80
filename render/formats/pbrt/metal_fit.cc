#include "render/formats/pbrt/metal_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "render/math/color_matching.h"

namespace lucerna {
namespace {

// Where reflectances are compared: cosines of the metal's normal, and indices of what lies on it.
struct View {
  double cosine, index;
};
constexpr std::array<View, 12> kViews = {{{1, 1},
                                          {0.8, 1},
                                          {0.6, 1},
                                          {0.4, 1},
                                          {0.25, 1},
                                          {0.12, 1},
                                          {1, 1.5},
                                          {0.8, 1.5},
                                          {0.6, 1.5},
                                          {0.4, 1.5},
                                          {0.25, 1.5},
                                          {0.12, 1.5}}};
using ByView = std::array<double, kViews.size()>;

// Fresnel's equations of a conductor, as FresnelConductor (transport/bsdf.h) has them, in double:
// differences of it are slopes here.
double Reflectance(double n, double k, View view) {
  n /= view.index;
  k /= view.index;
  const double c2 = view.cosine * view.cosine;
  const double s2 = 1 - c2;
  const double difference = n * n - k * k - s2;
  const double root = std::sqrt(difference * difference + 4 * n * n * k * k);
  const double a2 = std::max(0.0, 0.5 * (root + difference));
  const double across = 2 * view.cosine * std::sqrt(a2);
  const double s = (root + c2 - across) / (root + c2 + across);
  const double p = (c2 * root + s2 * s2 - across * s2) / (c2 * root + s2 * s2 + across * s2);
  return 0.5 * s * (1 + p);
}

// The colour in daylight, by view and channel.
std::array<ByView, 3> ColorsOf(const WavelengthCurve& eta, const WavelengthCurve& k) {
  constexpr double kStepNm = 5;
  std::array<ByView, 3> colors{};
  std::array<double, 3> white{};
  for (double nm = kFirstObservedNm; nm <= kLastObservedNm; nm += kStepNm) {
    const std::array<double, 3> seen = Rec709(CieObserver(nm));
    const double n_here = eta.AtClamped(nm);
    const double k_here = k.AtClamped(nm);
    for (std::size_t c = 0; c < 3; ++c)
      white[c] += seen[c] * D65At(nm);
    for (std::size_t view = 0; view < kViews.size(); ++view) {
      const double reflected = Reflectance(n_here, k_here, kViews[view]);
      for (std::size_t c = 0; c < 3; ++c)
        colors[c][view] += seen[c] * D65At(nm) * reflected;
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    for (double& color : colors[c])
      color /= white[c];
  }
  return colors;
}

struct Constants {
  double n, k;
};

// Where constants are looked for: not far from those of the curves.
struct SearchRange {
  Constants least, most;

  [[nodiscard]] Constants Hold(Constants at) const {
    return {std::clamp(at.n, least.n, most.n), std::clamp(at.k, least.k, most.k)};
  }
};
SearchRange SearchRangeOf(const WavelengthCurve& eta, const WavelengthCurve& k) {
  constexpr double kBeyond = 1.5;
  constexpr double kLeastIndex = 0.01;
  return {{kLeastIndex, 0},
          {std::max(kLeastIndex, kBeyond * *std::ranges::max_element(eta.value)),
           kBeyond * *std::ranges::max_element(k.value)}};
}

// Relative errors; a view counts by its cosine, as its flux does.
ByView ErrorsOf(const Constants& constants, const ByView& wanted) {
  ByView errors;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    errors[i] = std::sqrt(kViews[i].cosine) *
                (Reflectance(constants.n, constants.k, kViews[i]) / wanted[i] - 1);
  }
  return errors;
}

double SquaresOf(const ByView& errors) {
  double sum = 0;
  for (const double error : errors)
    sum += error * error;
  return sum;
}

// By Levenberg and Marquardt.
Constants Fit(const ByView& wanted, const SearchRange& range, Constants best) {
  constexpr int kSteps = 60;
  constexpr double kLeastGain = 1e-14;
  best = range.Hold(best);
  ByView errors = ErrorsOf(best, wanted);
  double damping = 1e-3;
  for (int step = 0; step < kSteps; ++step) {
    constexpr double kDifference = 1e-5;
    const ByView by_n = ErrorsOf({best.n + kDifference, best.k}, wanted);
    const ByView by_k = ErrorsOf({best.n, best.k + kDifference}, wanted);
    double nn = 0;
    double nk = 0;
    double kk = 0;
    double n_error = 0;
    double k_error = 0;
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const double n_slope = (by_n[i] - errors[i]) / kDifference;
      const double k_slope = (by_k[i] - errors[i]) / kDifference;
      nn += n_slope * n_slope;
      nk += n_slope * k_slope;
      kk += k_slope * k_slope;
      n_error += n_slope * errors[i];
      k_error += k_slope * errors[i];
    }
    // Without absorption nothing depends on it to first order.
    const double added = damping * (nn + kk);
    nn += added;
    kk += added;
    const double determinant = nn * kk - nk * nk;
    if (!(determinant > 0)) break;
    const Constants next = range.Hold({best.n - (kk * n_error - nk * k_error) / determinant,
                                       best.k - (nn * k_error - nk * n_error) / determinant});
    const ByView next_errors = ErrorsOf(next, wanted);
    const double gained = SquaresOf(errors) - SquaresOf(next_errors);
    if (gained > 0) {
      const bool is_found = gained < kLeastGain;
      best = next;
      errors = next_errors;
      damping = std::max(1e-9, damping / 4);
      if (is_found) break;
    } else {
      damping *= 4;
    }
  }
  return best;
}

}  // namespace

MetalConstants FitMetal(const WavelengthCurve& eta, const WavelengthCurve& k,
                        const MetalConstants& first) {
  const std::array<ByView, 3> colors = ColorsOf(eta, k);
  const SearchRange range = SearchRangeOf(eta, k);
  MetalConstants constants = first;
  const auto fit = [&](std::size_t c, float& n, float& absorption) {
    // Of no real metal.
    if (!std::ranges::all_of(colors[c], [](double color) { return color > 1e-6; })) return;
    const Constants fitted =
        Fit(colors[c], range, {static_cast<double>(n), static_cast<double>(absorption)});
    n = static_cast<float>(fitted.n);
    absorption = static_cast<float>(fitted.k);
  };
  fit(0, constants.eta.r, constants.k.r);
  fit(1, constants.eta.g, constants.k.g);
  fit(2, constants.eta.b, constants.k.b);
  return constants;
}

}  // namespace lucerna
