// Power, sampling and spectrum of each kind of delta light, defined in light_NAME.cc.
//
//   Power           [W] of the light that enters the scene.
//   SampleEmission  Draws a photon; see LightSet::SampleEmission. `emission` comes with
//                   emitter.power / emitter.choice as flux, the density of a delta light and a ray
//                   without an end.
//   FindNumbers     Sets those of the numbers that matter to what SampleEmission draws the photon
//                   with that leaves along `ray`, about. At infinity the ray may begin anywhere on
//                   its line.
//   SampleDirect    Light that arrives at `from`, over `choice`; see LightSet::SampleDirect.
//   InTree          What a tree of lights knows of it (transport/light_tree.h).
//   Source          The spectrum of a photon that `emission` has drawn. `edge_strength`: see
//                   frequency/bandwidth.h.
#pragma once

#include "render/frequency/spectrum.h"
#include "render/scene/scene.h"
#include "render/transport/light.h"

namespace lucerna {

struct EmissionNumbers {  // in [0, 1)
  float place1 = 0, place2 = 0;
  float direction1 = 0, direction2 = 0;
};

#define LUCERNA_DECLARE(Name, list, name)                                                          \
  struct Name##Emission {                                                                          \
    static Rgb Power(const Name##Light& light, const BoundingSphere& scene);                       \
    static bool SampleEmission(const Name##Light& light, const Emitter& emitter,                   \
                               const BoundingSphere& scene, const EmissionNumbers& u,              \
                               Emission& emission);                                                \
    static void FindNumbers(const Name##Light& light, const BoundingSphere& scene, const Ray& ray, \
                            EmissionNumbers& u);                                                   \
    static bool SampleDirect(const Name##Light& light, const Emitter& emitter, float choice,       \
                             Vec3 from, LightSample& sample);                                      \
    static TreeLight InTree(const Name##Light& light, const Emitter& emitter);                     \
    static Spectrum Source(const Name##Light& light, const Emitter& emitter,                       \
                           const Emission& emission, double edge_strength,                         \
                           const SpectrumLimits& limits);                                          \
  };
LUCERNA_DELTA_LIGHTS(LUCERNA_DECLARE)
#undef LUCERNA_DECLARE

}  // namespace lucerna
