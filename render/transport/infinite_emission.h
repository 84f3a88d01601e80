// Radiance, sampling and spectrum of infinite lights: one class for each kind, in infinite_NAME.cc.
//
// Directions are unit, in the world, and point towards the light, away from the scene. Light that
// comes through a portal depends on where one stands: `from` is a point of the scene.
#pragma once

#include <memory>
#include <numbers>
#include <vector>

#include "render/frequency/spectrum.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"
#include "render/math/warp.h"
#include "render/scene/scene.h"
#include "render/transport/light.h"
#include "render/transport/light_kinds.h"

namespace lucerna {

// The spectrum of photons of an infinite light. Threads: any.
class InfiniteSpectrum {
 public:
  virtual ~InfiniteSpectrum() = default;
  // Of light that comes from `direction`.
  [[nodiscard]] virtual Spectrum Source(Vec3 direction, const SpectrumLimits& limits) const = 0;
};

// A light that is not black. Threads: any, while no other takes colours.
class InfiniteEmission {
 public:
  virtual ~InfiniteEmission() = default;

  [[nodiscard]] virtual EmitterKind kind() const = 0;
  // Takes over colours of the scene's infinite lights, and its uplift, that have changed.
  // MeanRadiance and Power of a map stay as they were, and all by which directions are drawn.
  virtual void TakeColors(const std::vector<InfiniteLight>& lights, const Uplift* uplift) = 0;
  // In the scene's colours.
  [[nodiscard]] virtual Rgb Radiance(Vec3 from, Vec3 direction) const = 0;
  // The mean over all directions.
  [[nodiscard]] virtual Rgb MeanRadiance() const = 0;
  // [W] of the light that enters the scene.
  [[nodiscard]] virtual Rgb Power(const BoundingSphere& scene) const {
    return MeanRadiance() * (4 * kPi * kPi * scene.radius * scene.radius);
  }
  // What a tree of lights knows of it; `power` [W, luminance] is its Power.
  [[nodiscard]] virtual TreeLight InTree(double power, const BoundingSphere& scene) const {
    const auto radius = static_cast<double>(scene.radius);
    TreeLight in_tree;
    in_tree.is_at_infinity = true;
    in_tree.intensity = radius > 0 ? power / (std::numbers::pi * radius * radius) : 0;
    return in_tree;
  }
  // The largest channel of any direction.
  [[nodiscard]] virtual float LargestRadiance() const = 0;

  // Draws a direction; false where no light comes from any. u1, u2 in [0, 1).
  [[nodiscard]] virtual bool Sample(Vec3 from, float u1, float u2, Vec3& direction) const = 0;
  // The density [sr⁻¹] with which Sample draws `direction`, times `choice`.
  [[nodiscard]] virtual float Density(Vec3 from, Vec3 direction, float choice) const = 0;
  // The density with which photons come along the line through `from`, per solid angle and, across
  // the line, per area of the disk through which all rays of a direction enter the scene [sr⁻¹],
  // times `choice`.
  [[nodiscard]] virtual float PhotonDensity(Vec3 from, Vec3 direction, float choice,
                                            const BoundingSphere& /*scene*/) const {
    return Density(from, direction, choice);
  }
  // The largest flux of a photon over the mean, at least [luminance].
  [[nodiscard]] virtual float LargestShare() const { return 1; }
  // Whether a photon has passed what it must pass before it may land: false before a portal.
  [[nodiscard]] virtual bool Lights(Vec3 /*landing*/) const { return true; }
  // Draws a photon as LightSet::SampleEmission does, its density excepted. `emission` comes with
  // emitter.power / emitter.choice as flux and a ray without an end.
  [[nodiscard]] virtual bool SampleEmission(const Emitter& emitter, const BoundingSphere& scene,
                                            const EmissionNumbers& u, Emission& emission) const = 0;
  // With which numbers SampleEmission draws the photon that comes from `direction` along a line
  // through `point`, about.
  [[nodiscard]] virtual EmissionNumbers FindNumbers(const BoundingSphere& scene, Vec3 point,
                                                    Vec3 direction) const = 0;

  // May measure the whole light. Keeps a reference to this.
  [[nodiscard]] virtual std::unique_ptr<const InfiniteSpectrum> MeasureSpectrum() const = 0;
};

// The lights of one kind, those that are black left out; a kind whose lights look alike may make
// one of them all.
using InfiniteEmissions = std::vector<std::shared_ptr<InfiniteEmission>>;
#define LUCERNA_DECLARE(Name, name) \
  [[nodiscard]] InfiniteEmissions Make##Name##Emissions(const std::vector<InfiniteLight>& lights);
LUCERNA_INFINITE_LIGHTS(LUCERNA_DECLARE)
#undef LUCERNA_DECLARE

// Makes `ray`, but for its end, that of a photon that travels against `towards`, from an even place
// on the disk through which all rays of this direction enter the scene. Inline: out of line it took
// photons of an even sky 3 % longer.
inline void SetEnteringRay(Vec3 towards, const BoundingSphere& scene, const EmissionNumbers& u,
                           Ray& ray) {
  const Frame frame(-towards);
  const Vec3 disk = SquareToDisk(u.place1, u.place2) * scene.radius;
  ray.origin = scene.center + towards * scene.radius + frame.s * disk.x + frame.t * disk.y;
  ray.direction = -towards;
}

// The place on that disk, in [0, 1]², through which the ray of this direction meets `point`.
inline Vec2 EnteringPlace(Vec3 towards, const BoundingSphere& scene, Vec3 point) {
  const Frame frame(-towards);
  const Vec3 offset = point - scene.center;
  return DiskToSquare(Dot(offset, frame.s) / scene.radius, Dot(offset, frame.t) / scene.radius);
}

}  // namespace lucerna
