// What the surface of a dielectric reflects to either of its sides, without what goes through it:
// the first part of materials with a coat, or with a medium below. Equations as in
// transport/microfacet.h; arguments as in transport/bsdf.h.
#pragma once

#include "render/transport/bsdf.h"

namespace lucerna {

// The weight contains Fresnel's factor.
[[nodiscard]] bool SampleDielectricReflection(const Material& material, Vec3 wo, float u1, float u2,
                                              BsdfSample& sample);
// Of one channel, all being alike.
[[nodiscard]] float EvaluateDielectricReflection(const Material& material, Vec3 wo, Vec3 wi);
[[nodiscard]] float PdfDielectricReflection(const Material& material, Vec3 wo, Vec3 wi);

}  // namespace lucerna
