// One of two materials at each place, for each ray: `mixed`, and `amount` or a texture in its
// place. What may happen at some place, for some ray, holds for the mix as a whole.
#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "render/base/status.h"
#include "render/scene/material.h"

namespace lucerna {
namespace {

MaterialProperties Joined(const MaterialProperties& a, const MaterialProperties& b) {
  MaterialProperties joined;
  joined.is_mix = true;
  joined.is_smooth = a.is_smooth && b.is_smooth;
  joined.is_black = a.is_black && b.is_black;
  joined.scatters_smoothly = a.scatters_smoothly || b.scatters_smoothly;
  joined.transmits = a.transmits || b.transmits;
  joined.gathers = a.gathers || b.gathers;
  joined.scatters_below = a.scatters_below || b.scatters_below;
  joined.is_thin = a.is_thin || b.is_thin;
  joined.has_rough_coat = a.gathers_caustics() || b.gathers_caustics();
  joined.lobe_width = std::min(a.lobe_width, b.lobe_width);
  joined.ior = std::max(a.ior, b.ior);
  // Each material is asked for its own hitpoints.
  joined.is_separable = true;
  return joined;
}

}  // namespace

MaterialProperties MixKind::Properties(const MaterialNumbers& material) {
  LUCERNA_CHECK(material.mixed_properties != nullptr);
  return *material.mixed_properties;
}

Rgb MixKind::Textured(const MaterialNumbers& /*material*/) {
  return {};
}

void MixKind::SetTextured(MaterialNumbers& /*material*/, Rgb /*value*/) {}

Rgb MixKind::TexturedValue(Rgb color) {
  return color;
}

void JoinMixes(std::vector<Material>& materials) {
  const std::size_t count = materials.size();
  // A mix after what it is made of.
  std::vector<std::size_t> mixes;
  for (std::size_t i = 0; i < count; ++i) {
    if (materials[i].kind == MaterialNumbers::Kind::kMix) mixes.push_back(i);
  }
  std::ranges::stable_sort(mixes, {},
                           [&](std::size_t index) { return materials[index].mix_depth; });
  // The copies of the materials that mixes are made of, made once for all mixes.
  std::vector<std::int32_t> copies(count, -1);
  for (const std::size_t index : mixes) {
    for (std::size_t side = 0; side < 2; ++side) {
      const auto part = static_cast<std::size_t>(materials[index].mixed[side]);
      // A mix chooses again, and its materials are copies already.
      if (materials[part].kind == MaterialNumbers::Kind::kMix || materials[part].is_in_mix)
        continue;
      if (copies[part] < 0) {
        copies[part] = static_cast<std::int32_t>(materials.size());
        Material copy = materials[part];
        copy.is_in_mix = true;
        materials.push_back(std::move(copy));
      }
      materials[index].mixed[side] = copies[part];
    }
    const auto [first, second] = materials[index].mixed;
    auto joined = std::make_shared<const MaterialProperties>(
        Joined(PropertiesOf(materials[static_cast<std::size_t>(first)]),
               PropertiesOf(materials[static_cast<std::size_t>(second)])));
    materials[index].mixed_properties = joined.get();
    materials[index].owned_mixed_properties = std::move(joined);
  }
}

std::int32_t CopyForThinShapes(std::vector<Material>& materials, std::int32_t index,
                               std::map<std::int32_t, std::int32_t>& copies) {
  if (const auto known = copies.find(index); known != copies.end()) return known->second;
  Material copy = materials[static_cast<std::size_t>(index)];
  copy.is_on_thin_shapes = true;
  for (std::int32_t& part : copy.mixed) {
    if (part >= 0) part = CopyForThinShapes(materials, part, copies);
  }
  const auto number = static_cast<std::int32_t>(materials.size());
  materials.push_back(std::move(copy));
  copies.emplace(index, number);
  return number;
}

}  // namespace lucerna
