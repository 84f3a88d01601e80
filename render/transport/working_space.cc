#include "render/transport/working_space.h"

#include "render/math/color_space.h"

namespace lucerna {

Scene InWorkingSpace(Scene scene) {
  for (Material& material : scene.materials)
    material.ForEachColor([](Rgb& color) { color = ToWorking(color); });
  for (AreaLight& light : scene.area_lights)
    light.radiance = ToWorking(light.radiance);
  for (PointLight& light : scene.point_lights)
    light.intensity = ToWorking(light.intensity);
  for (SpotLight& light : scene.spot_lights)
    light.intensity = ToWorking(light.intensity);
  for (DistantLight& light : scene.distant_lights)
    light.irradiance = ToWorking(light.irradiance);
  for (InfiniteLight& light : scene.infinite_lights)
    light.radiance = ToWorking(light.radiance);
  return scene;
}

}  // namespace lucerna
