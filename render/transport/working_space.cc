#include "render/transport/working_space.h"

#include "render/math/color_space.h"

namespace lucerna {

Scene InWorkingSpace(Scene scene) {
  for (Material& material : scene.materials)
    material.ForEachColor([](Rgb& color) { color = ToWorking(color); });
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
