// Reads LightSource and AreaLightSource directives.
#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include "render/formats/asset_reader.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/math/rgb.h"
#include "render/math/transform.h"
#include "render/scene/scene.h"

namespace lucerna {

// An AreaLightSource: what it makes of a shape depends on the shape's area when a power is given.
struct AreaEmission {
  // At scale 1 and, where there is one, power 1 over an emitting area of 1 m² [and of the picture's
  // mean luminance]; with a picture, what it is multiplied by.
  Rgb radiance;
  bool two_sided = false;
  std::optional<double> power_w;  // luminous, of the whole shape
  std::shared_ptr<const Picture> picture;
  double mean_luminance = 1;  // of the picture's pixels
  GivenSpectrum spectrum;     // of the radiance, where it is given
};
// Absent for a type that is not supported, which is an error.
[[nodiscard]] std::optional<AreaEmission> ReadAreaEmission(std::string_view type,
                                                           ParameterList& parameters,
                                                           AssetReader& assets);
[[nodiscard]] AreaLight MakeAreaLight(const AreaEmission& emission, double area_m2);

// A LightSource, with the transform from its space to the world. Adds it to `scene`.
void ReadLight(std::string_view type, ParameterList& parameters, const Transform& to_world,
               AssetReader& assets, Scene& scene);

}  // namespace lucerna
