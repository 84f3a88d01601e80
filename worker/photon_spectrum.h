// The light field around a frequency photon, as a spectrum.
//
// Carries a photon's spectrum (render/frequency) past every event of its path, looking up in the
// scene what the events need: how large its light is, how the surfaces bend. One for all photons of
// a job; the spectrum itself travels with the photon.
#pragma once

#include <memory>
#include <vector>

#include "render/analysis/needs.h"
#include "render/frequency/spectrum.h"
#include "render/geometry/curvature.h"
#include "render/geometry/intersector.h"
#include "render/geometry/silhouette.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"
#include "render/transport/bsdf.h"
#include "render/transport/infinite_emission.h"
#include "render/transport/light.h"
#include "worker/texture_detail.h"

namespace lucerna {

class SpectrumTracer {
 public:
  // Keeps references to scene and lights. Measures of the scene what `needs` of a job with these
  // settings need. Errors: as SilhouetteEdges::Create.
  [[nodiscard]] static StatusOr<std::unique_ptr<SpectrumTracer>> Create(
      const Scene& scene, const RenderSettings& settings, const SceneNeeds& needs,
      const Intersector& intersector, const LightSet& lights);

  // Whether it was made for settings with the same needs.
  [[nodiscard]] bool Suits(const RenderSettings& settings) const;

  // A spectrum on its way. After diffuse scattering it is complete once the next leg is known.
  struct Carried {
    Spectrum spectrum;
    bool left_diffusely = false;
  };

  [[nodiscard]] Carried Leave(const Emission& emission) const;
  // Whether the silhouettes near a leg are looked for, which costs as much as some legs do.
  enum class Shadows : std::uint8_t { kFound, kLeftOut };

  // A leg along `ray` of `distance` [scene units].
  void Fly(Carried& carried, const Ray& ray, float distance, Shadows shadows) const;
  // The trace of what arrives from `wo` at `surface` [1/length²], for a deposit; below 0 when it is
  // not a number. A glossy material's hitpoints see it through their lobe.
  [[nodiscard]] float Received(const Carried& carried, const SurfacePoint& surface,
                               const Material& material, Vec3 wo) const;
  // Scattering from `wo` to `wi`, world, by `part` of the material.
  void Scatter(Carried& carried, const SurfacePoint& surface, const Material& material, Vec3 wo,
               Vec3 wi, Parts part = Parts::kAll) const;

 private:
  SpectrumTracer(const Scene& scene, const RenderSettings& settings, const SceneNeeds& needs,
                 const Bounds& bounds, const LightSet& lights);
  void MeasureEmitters();
  [[nodiscard]] SurfaceBend BendAt(const SurfacePoint& surface, Vec3 wo) const;
  // Adds the detail of the picture that the emitter shows, if any.
  [[nodiscard]] Spectrum WithPicture(Spectrum source, const Emitter& emitter, Vec3 place) const;
  // Of the surface's texture, along the surface [1/length²].
  [[nodiscard]] double TextureDetailAt(const SurfacePoint& surface, const Material& material) const;

  const Scene& scene_;
  const LightSet& lights_;
  Bounds bounds_;
  SpectrumLimits limits_;
  double edge_strength_;
  float reach_;
  bool sees_glossily_;                      // some hitpoints do
  std::unique_ptr<SilhouetteEdges> edges_;  // nullptr where nothing casts a shadow
  SurfaceCurvature curvature_;
  // Of emitting meshes, each connected surface as one emitter, in however many meshes it comes.
  std::vector<EmitterMoments> surface_moments_;
  std::vector<std::uint32_t> surface_of_;       // [triangles of emitting meshes]
  std::vector<std::size_t> first_of_mesh_;      // [meshes] into surface_of_
  std::vector<TextureDetail> texture_details_;  // [textures]
  std::vector<TextureDetail> picture_details_;  // [area lights], or empty: none has a picture
  std::vector<std::unique_ptr<const InfiniteSpectrum>> infinite_spectra_;  // [infinite lights]
};

}  // namespace lucerna
