#include "tests/support/hair_reference.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "render/math/warp.h"

namespace lucerna {
namespace {

// Of unpolarised light that comes in at this cosine.
double Reflectance(double cosine, double eta) {
  const double inside = std::sqrt(1 - (1 - cosine * cosine) / (eta * eta));
  const double s = (cosine - eta * inside) / (cosine + eta * inside);
  const double p = (eta * cosine - inside) / (eta * cosine + inside);
  return (s * s + p * p) / 2;
}

double Longitudinal(double theta_o, double theta_i, double v) {
  // Tilted beyond the pole, a direction is on the other side of the fibre; I0 is even.
  const double a = std::abs(std::cos(theta_o)) * std::cos(theta_i) / v;
  const double b = std::sin(theta_o) * std::sin(theta_i) / v;
  // Narrower lobes than the tests use would overflow.
  return std::cyl_bessel_i(0.0, a) * std::exp(-b) / (2 * v * std::sinh(1 / v));
}

double Azimuthal(double phi, double around, double s) {
  const double x = std::remainder(phi - around, 2 * kPi64);
  const auto cdf = [&](double at) { return 1 / (1 + std::exp(-at / s)); };
  const double e = std::exp(-std::abs(x) / s);
  return e / (s * (1 + e) * (1 + e)) / (cdf(kPi64) - cdf(-kPi64));
}

}  // namespace

std::array<double, 3> ReferenceHairShare(const ReferenceFibre& fibre, Double3 wo, Double3 wi) {
  const double theta_o = std::asin(std::clamp(wo.x, -1.0, 1.0));
  const double theta_i = std::asin(std::clamp(wi.x, -1.0, 1.0));
  const double gamma_o = std::asin(std::clamp(wo.y / std::hypot(wo.y, wo.z), -1.0, 1.0));
  const double phi = std::atan2(wi.y, wi.z) - std::atan2(wo.y, wo.z);

  const double m = fibre.beta_m;
  const double n = fibre.beta_n;
  const double v = std::pow(0.726 * m + 0.812 * m * m + 3.7 * std::pow(m, 20), 2);
  const double s = std::sqrt(kPi64 / 8) * (0.265 * n + 1.194 * n * n + 5.372 * std::pow(n, 22));

  const double theta_t = std::asin(std::sin(theta_o) / fibre.eta);
  const double eta_across =
      std::sqrt(fibre.eta * fibre.eta - std::pow(std::sin(theta_o), 2)) / std::cos(theta_o);
  const double gamma_t = std::asin(std::sin(gamma_o) / eta_across);
  const double f = Reflectance(std::cos(theta_o) * std::cos(gamma_o), fibre.eta);
  const double turned_in = 2 * gamma_t + kPi64;  // by each crossing of the fibre

  std::array<double, 3> sum{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double t = std::exp(-fibre.absorption[c] * 2 * std::cos(gamma_t) / std::cos(theta_t));
    const double a1 = (1 - f) * (1 - f) * t;
    sum[c] = f * Longitudinal(theta_o - 2 * fibre.tilt_rad, theta_i, v) *
                 Azimuthal(phi, -2 * gamma_o, s) +
             a1 * Longitudinal(theta_o + fibre.tilt_rad, theta_i, v / 4) *
                 Azimuthal(phi, turned_in - 2 * gamma_o, s) +
             a1 * t * f * Longitudinal(theta_o + 4 * fibre.tilt_rad, theta_i, 4 * v) *
                 Azimuthal(phi, 2 * turned_in - 2 * gamma_o, s) +
             a1 * t * f * t * f / (1 - t * f) * Longitudinal(theta_o, theta_i, 4 * v) / (2 * kPi64);
  }
  return sum;
}

}  // namespace lucerna
