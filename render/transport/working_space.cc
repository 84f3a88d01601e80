#include "render/transport/working_space.h"

#include <algorithm>

#include "render/math/color_space.h"
#include "render/transport/coat_tables.h"
#include "render/transport/subsurface.h"

namespace lucerna {

Scene InWorkingSpace(Scene scene, int threads) {
  // Coefficients are no colours, but mix as those of a thin layer do.
  const auto coefficients = [](Rgb rec709) {
    const Rgb mixed = ToWorking(rec709);
    return Rgb{std::max(mixed.r, 0.0F), std::max(mixed.g, 0.0F), std::max(mixed.b, 0.0F)};
  };
  for (Material& material : scene.materials) {
    material.ForEachColor([](Rgb& color) { color = ToWorking(color); });
    material.absorption = material.absorbs_for_reflectance
                              ? HairAbsorption(material.reflectance, material.beta_n)
                              : coefficients(material.absorption);
    material.scattering = coefficients(material.scattering);
    material.extinction = coefficients(material.extinction);
  }
  for (Medium& medium : scene.media) {
    medium.absorption = coefficients(medium.absorption);
    medium.scattering = coefficients(medium.scattering);
  }
  PrepareCoats(scene.materials, threads);
  PrepareSubsurface(scene.materials, threads);
  for (AreaLight& light : scene.area_lights)
    light.radiance = ToWorking(light.radiance);
  ForEachDeltaList(scene, [](auto& lights) {
    for (auto& light : lights)
      light.Strength() = ToWorking(light.Strength());
  });
  for (InfiniteLight& light : scene.infinite_lights)
    light.radiance = ToWorking(light.radiance);
  return scene;
}

}  // namespace lucerna
