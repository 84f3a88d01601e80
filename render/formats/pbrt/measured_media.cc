#include "render/formats/pbrt/measured_media.h"

#include <array>
#include <vector>

#include "render/base/text.h"

namespace lucerna {
namespace {

// Source: Jensen et al. 2001, "A Practical Model for Subsurface Light Transport", figure 5.
constexpr std::array<MeasuredMedium, 12> kMedia = {{
    {"Apple", {0.0030F, 0.0034F, 0.046F}, {2.29F, 2.39F, 1.97F}},
    {"Chicken1", {0.015F, 0.077F, 0.19F}, {0.15F, 0.21F, 0.38F}},
    {"Chicken2", {0.018F, 0.088F, 0.20F}, {0.19F, 0.25F, 0.32F}},
    {"Cream", {0.0002F, 0.0028F, 0.0163F}, {7.38F, 5.47F, 3.15F}},
    {"Ketchup", {0.061F, 0.97F, 1.45F}, {0.18F, 0.07F, 0.03F}},
    {"Marble", {0.0021F, 0.0041F, 0.0071F}, {2.19F, 2.62F, 3.00F}},
    {"Potato", {0.0024F, 0.0090F, 0.12F}, {0.68F, 0.70F, 0.55F}},
    {"Skimmilk", {0.0014F, 0.0025F, 0.0142F}, {0.70F, 1.22F, 1.90F}},
    {"Skin1", {0.032F, 0.17F, 0.48F}, {0.74F, 0.88F, 1.01F}},
    {"Skin2", {0.013F, 0.070F, 0.145F}, {1.09F, 1.59F, 1.79F}},
    {"Spectralon", {0, 0, 0}, {11.6F, 20.4F, 14.9F}},
    {"Wholemilk", {0.0011F, 0.0024F, 0.014F}, {2.55F, 3.21F, 3.77F}},
}};

}  // namespace

const MeasuredMedium* FindMeasuredMedium(std::string_view name) {
  for (const MeasuredMedium& medium : kMedia) {
    if (medium.name == name) return &medium;
  }
  return nullptr;
}

std::string MeasuredMediaThereAre() {
  std::vector<std::string_view> names;
  for (const MeasuredMedium& medium : kMedia)
    names.push_back(medium.name);
  return Concat("there are ", Listed(names));
}

}  // namespace lucerna
