// The readers of each kind of light, defined in light_NAME.cc, and what they share.
//
// Units are pbrt-v4's: an rgb is radiance, intensity or irradiance as it stands; power and
// illuminance set the luminance that a colour of luminance 1 and a scale of 1 would have.
#pragma once

#include <memory>

#include "render/formats/asset_reader.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/math/rgb.h"
#include "render/math/transform.h"
#include "render/math/warp.h"
#include "render/scene/scene.h"

namespace lucerna {

// What a reader is given, and where it adds the light.
struct LightInput {
  ParameterList& parameters;
  const Transform& to_world;
  AssetReader& assets;
  Scene& scene;
};

#define LUCERNA_DECLARE(Name, list, name) void Read##Name##Light(const LightInput& input);
LUCERNA_DELTA_LIGHTS(LUCERNA_DECLARE)
#undef LUCERNA_DECLARE
void ReadInfiniteLight(const LightInput& input);

// These report an error when the result is not finite (S1).
[[nodiscard]] Rgb ScaledEmission(ParameterList& parameters, Rgb color, double scale);
[[nodiscard]] Vec3 FinitePoint(ParameterList& parameters, const Transform& to_world, Vec3 point);
// The unit direction from `from` to `to`, in the world.
[[nodiscard]] Vec3 Direction(ParameterList& parameters, const Transform& to_world, Vec3 from,
                             Vec3 to);

// The picture that "filename" names. nullptr, and an error, when there is none that can be used.
[[nodiscard]] std::shared_ptr<const Picture> ReadLightPicture(ParameterList& parameters,
                                                              AssetReader& assets);

void WarnIfBlack(ParameterList& parameters, Rgb emitted);

}  // namespace lucerna
