// How far from where it entered light comes out of a medium below a flat surface: computed once for
// an index of refraction and a phase function (transport/subsurface.h).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace lucerna {

// Distances r are in mean free paths. A row is the density of light over r: 2πr times what comes
// out per area there, of a flux of 1 that has entered. Rows differ in the albedo of one scattering;
// between two of them is a mix, named by its integral, the reflectance. Between nodes the density
// is linear, so that it can be integrated and sampled as it is evaluated.
struct SubsurfaceTable {
  static constexpr std::size_t kRows = 100;
  // r of nodes: 0, and each kGrowth times the one before it.
  static constexpr std::size_t kNodes = 136;
  static constexpr float kFirstNode = 1e-3F;
  static constexpr float kGrowth = 1.1F;

  // Of all that is below, about.
  static constexpr double kBytes = sizeof(float) * (2.0 * kRows * kNodes + kNodes + 2 * kRows);

  std::vector<float> nodes;         // [kNodes]
  std::vector<float> densities;     // [kRows × kNodes]
  std::vector<float> cumulatives;   // the same, integrals from 0
  std::vector<float> albedos;       // [kRows] of one scattering, ascending
  std::vector<float> reflectances;  // [kRows] ascending, from 0

  // A mix of row `below` and the one after it, of which the second has `share`.
  struct Mix {
    std::size_t below = 0;
    float share = 0;
  };
  // No reflectance is above the last row's.
  [[nodiscard]] Mix MixOf(float reflectance) const { return Place(reflectances, reflectance); }
  [[nodiscard]] float ReflectanceOf(float albedo) const {
    const Mix mix = Place(albedos, albedo);
    return reflectances[mix.below] * (1 - mix.share) + reflectances[mix.below + 1] * mix.share;
  }
  [[nodiscard]] float Density(Mix mix, float r) const {
    const auto [node, share] = Place(nodes, r);
    if (r > nodes.back()) return 0;
    return At(densities, mix, node) * (1 - share) + At(densities, mix, node + 1) * share;
  }
  // The integral of the density up to node `node`.
  [[nodiscard]] float Cumulative(Mix mix, std::size_t node) const {
    return At(cumulatives, mix, node);
  }
  // The r up to which the integral of the density is `integral`.
  [[nodiscard]] float RadiusWithin(Mix mix, float integral) const {
    std::size_t low = 0;
    std::size_t high = kNodes - 1;
    while (high - low > 1) {
      const std::size_t middle = (low + high) / 2;
      (Cumulative(mix, middle) <= integral ? low : high) = middle;
    }
    const float width = nodes[low + 1] - nodes[low];
    const float first = At(densities, mix, low);
    const float slope = (At(densities, mix, low + 1) - first) / width;
    const float left = std::max(integral - Cumulative(mix, low), 0.0F);
    // first·x + slope·x²/2 = left, by the form that does not cancel.
    const float root = std::sqrt(std::max(first * first + 2 * slope * left, 0.0F));
    const float x = first + root > 0 ? 2 * left / (first + root) : 0.0F;
    return nodes[low] + std::min(x, width);
  }

 private:
  // Where `value` lies in an ascending list of at least two.
  [[nodiscard]] static Mix Place(const std::vector<float>& list, float value) {
    const auto above = std::upper_bound(list.begin() + 1, list.end() - 1, value);
    const auto below = static_cast<std::size_t>(above - list.begin()) - 1;
    const float width = list[below + 1] - list[below];
    const float share = width > 0 ? (value - list[below]) / width : 0.0F;
    return {below, std::clamp(share, 0.0F, 1.0F)};
  }
  [[nodiscard]] static float At(const std::vector<float>& table, Mix mix, std::size_t node) {
    const float* row = &table[mix.below * kNodes + node];
    return row[0] * (1 - mix.share) + row[kNodes] * mix.share;
  }
};

}  // namespace lucerna
