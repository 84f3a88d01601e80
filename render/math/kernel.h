// How much does a photon count at a distance from the hitpoint?
//
// A kernel is K(x) = norm · shape(|x|²/r²) / r², with integral 1 over the disc of radius r. The
// worker applies the shape, in [0, 1]; the coordinator the norm and 1/r².
//
// All that a kernel is made of is one struct below. A new one: an enumerator, a struct
// and its entry in Kernels.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "render/math/gauss_legendre.h"

namespace lucerna {

enum class KernelKind : std::uint8_t { kConstant, kEpanechnikov, kBiweight, kGaussian };

// Of a kernel K with integral 1 on the unit disc.
struct KernelMoments {
  double mu2;        // second moment per axis: what it makes of curvature
  double roughness;  // integral of K²: what it makes of noise
};

// The integrals of shape(s t²) t^(k+1) over t from 0 to 1, for k = 0, 1, 2: what a kernel leaves
// along a ray that ends at distance sqrt(s), over sqrt(s)^(k+2).
struct RayIntegrals {
  double k0, k1, k2;
};

// Each has
//   kKind, kName      the enumerator; the name in settings
//   kMoments          of K on the unit disc
//   kNodes            for integrals of Along over an angle
//   Shape(t2)         at t2 = |x|²/r², in [0, 1]
//   Norm()            one over the integral of the shape over the unit disc
//   Along(s)          integrals along a ray

struct ConstantKernel {
  static constexpr KernelKind kKind = KernelKind::kConstant;
  static constexpr std::string_view kName = "constant";
  static constexpr KernelMoments kMoments = {1.0 / 4, 0.31830988618379067};  // 1/π
  static constexpr std::span<const QuadratureNode> kNodes = kFourPoints;
  static float Shape(float /*t2*/) { return 1; }
  static double Norm() { return 1 / std::numbers::pi; }
  static RayIntegrals Along(double /*s*/) { return {1.0 / 2, 1.0 / 3, 1.0 / 4}; }
};

struct EpanechnikovKernel {
  static constexpr KernelKind kKind = KernelKind::kEpanechnikov;
  static constexpr std::string_view kName = "epanechnikov";
  static constexpr KernelMoments kMoments = {1.0 / 6, 0.42441318157838756};  // 4/(3π)
  static constexpr std::span<const QuadratureNode> kNodes = kFourPoints;
  static float Shape(float t2) { return 1 - t2; }
  static double Norm() { return 2 / std::numbers::pi; }
  static RayIntegrals Along(double s) {
    return {1.0 / 2 - s / 4, 1.0 / 3 - s / 5, 1.0 / 4 - s / 6};
  }
};

struct BiweightKernel {
  static constexpr KernelKind kKind = KernelKind::kBiweight;
  static constexpr std::string_view kName = "biweight";
  static constexpr KernelMoments kMoments = {1.0 / 8, 0.57295779513082321};  // 9/(5π)
  static constexpr std::span<const QuadratureNode> kNodes = kFourPoints;
  static float Shape(float t2) { return (1 - t2) * (1 - t2); }
  static double Norm() { return 3 / std::numbers::pi; }
  static RayIntegrals Along(double s) {
    return {1.0 / 2 - s / 2 + s * s / 6, 1.0 / 3 - 2 * s / 5 + s * s / 7,
            1.0 / 4 - s / 3 + s * s / 8};
  }
};

// Of standard deviation r/3, cut at r.
struct GaussianKernel {
  static constexpr KernelKind kKind = KernelKind::kGaussian;
  static constexpr std::string_view kName = "gaussian";
  static constexpr KernelMoments kMoments = {0.10549421475986834, 0.7322884666579611};
  static constexpr std::span<const QuadratureNode> kNodes = kEightPoints;
  static float Shape(float t2) { return std::exp(-4.5F * t2); }
  static double Norm() { return 4.5 / (std::numbers::pi * (1 - std::exp(-4.5))); }
  static RayIntegrals Along(double s) {
    RayIntegrals sum = {0, 0, 0};
    for (const QuadratureNode& node : kEightPoints) {
      for (const double at : {-node.at, node.at}) {
        const double t = 0.5 + 0.5 * at;
        const double value = 0.5 * node.weight * t * std::exp(-4.5 * s * t * t);
        sum.k0 += value;
        sum.k1 += value * t;
        sum.k2 += value * t * t;
      }
    }
    return sum;
  }
};

// All, in documentation order.
using Kernels = std::tuple<ConstantKernel, EpanechnikovKernel, BiweightKernel, GaussianKernel>;

// Returns visit(k), where k is the struct of `kind`.
template <std::size_t kFirst = 0, typename Visit>
[[nodiscard]] decltype(auto) WithKernel(KernelKind kind, const Visit& visit) {
  using First = std::tuple_element_t<kFirst, Kernels>;
  if constexpr (kFirst + 1 < std::tuple_size_v<Kernels>) {
    if (kind != First::kKind) return WithKernel<kFirst + 1>(kind, visit);
  }
  return visit(First());
}

// A kernel chosen at run time.
struct Kernel {
  KernelKind kind = KernelKind::kEpanechnikov;

  [[nodiscard]] float Shape(float t2) const {
    return WithKernel(kind, [&](auto kernel) { return kernel.Shape(t2); });
  }
  [[nodiscard]] double Norm() const {
    return WithKernel(kind, [](auto kernel) { return kernel.Norm(); });
  }
  [[nodiscard]] KernelMoments Moments() const {
    return WithKernel(kind, [](auto kernel) { return kernel.kMoments; });
  }
};

}  // namespace lucerna
