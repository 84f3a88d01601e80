// What does one eye path see?
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "absl/container/inlined_vector.h"

#include "render/analysis/needs.h"
#include "render/estimate/hitpoint_block.h"
#include "render/geometry/bend_radii.h"
#include "render/geometry/intersector.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"
#include "render/tracing/direct_light.h"
#include "render/tracing/facet_sides.h"
#include "render/tracing/filter_sampler.h"
#include "render/tracing/pixel_sampler.h"
#include "render/transport/caustic_weight.h"
#include "render/transport/light.h"
#include "render/transport/media.h"
#include "render/transport/path_wavelength.h"

namespace lucerna {

// What an eye path saw at its first gathering surface, for the feature layers.
struct EyeFeatures {
  Rgb albedo;
  Vec3 normal;                 // world, shading normal on the eye's side
  float distance = HUGE_VALF;  // along the path [scene units]
};

// Where an eye path waits for photons.
struct EyeHitpoint {
  Vec3 position;
  Vec3 normal;  // geometric, on the eye's side
  bool is_glossy = false;
  std::uint32_t material = 0;
  Vec3 to_eye, shading_normal;  // glossy only
  GlossyPlace place;            // glossy only: what depends on the place
  Rgb weight;                   // from gathered flux density to radiance; black: no hitpoint
  // Width of the pixel at the hitpoint [scene units]; less on a surface that is bent as strongly as
  // the first disc is wide.
  float footprint = 0;
};

// A straight part of an eye path through a medium that scatters: photons count that were scattered
// near it.
struct EyeSegment {
  Vec3 from, to;
  std::int32_t medium = kNoMedium;
  Rgb weight;                                  // from radiance scattered at `from`; black: none
  float from_footprint = 0, to_footprint = 0;  // widths of the pixel there [scene units]
  // Normal of the surface at which it begins, on the eye's side; against its direction where there
  // is none.
  Vec3 border;
  float free_path =
      0;  // shortest mean one of the medium [scene units]; infinite without extinction
};

// The end of one eye path.
struct EyePath {
  Rgb direct;  // radiance that needs no photons, but for `bright`
  // Of the emission that the path meets before any rough surface, what is brighter than the image's
  // white; not weighted by the filter (see film_spread.h).
  Rgb bright;
  EyeFeatures features;
  EyeHitpoint hitpoint;
  // One of the surfaces on the way that gather caustic photons, with the weight that stands for all
  // of them; glossy.
  EyeHitpoint caustic;
  float caustic_strength = 0;  // sum of the weights of those surfaces, largest channels
  // One of the segments, with the weight that stands for all of them.
  EyeSegment segment;
  int rays = 0;
};

class EyePathTracer {
 public:
  // Where lights are sampled.
  enum class DirectLight : std::uint8_t {
    kEverywhere,
    kWherePathsGoOn,  // not where photons are gathered: something else knows all light there
  };
  // Keeps references to all. Threads, as ThreadTeam has them, of the preparation alone.
  EyePathTracer(const Scene& scene, const RenderSettings& settings, const SceneNeeds& needs,
                const Intersector& intersector, const LightSet& lights, int threads = 1,
                DirectLight direct_light = DirectLight::kEverywhere);

  // What is known of the first thing that an eye path meets.
  struct First {
    std::uint32_t* shape = nullptr;  // nullptr: cache disabled
    bool is_known = false;
  };
  // The eye path of a pixel of the crop window in one pass. Threads: any.
  [[nodiscard]] EyePath Trace(int x, int y, std::uint64_t pass, First first) const;
  // Path `number` of the `count` that the pixel has in the pass beside that one.
  [[nodiscard]] EyePath TraceMore(int x, int y, std::uint64_t pass, int number, int count) const;

  // EyePath::bright alone, also of pixels outside the crop window.
  [[nodiscard]] Rgb TraceBright(int x, int y, std::uint64_t pass) const;
  // Where an eye path begins, from the pixel's centre [pixels], and on the lens, in the
  // unit disc.
  struct FilmOffset {
    float x = 0, y = 0;
    Vec3 on_lens;
  };
  // One of `count` paths of a pixel and pass that are traced for their bright part alone.
  struct BrightPath {
    Rgb bright;
    FilmOffset from;
  };
  [[nodiscard]] BrightPath TraceBrightPath(int x, int y, std::uint64_t pass, int number,
                                           int count) const;
  // What EyePath::bright would be of a light straight ahead of the pixel's centre. The same in
  // every pass.
  [[nodiscard]] Rgb BrightAtCentre(int x, int y) const;
  // Of the eye path of a pixel.
  [[nodiscard]] FilmOffset FilmOffsetOf(int x, int y, std::uint64_t pass) const;
  // Whether EyePath::bright can be anything but black.
  [[nodiscard]] bool MeetsBright() const { return white_ < HUGE_VALF; }
  [[nodiscard]] bool IsBright(Rgb emitted) const { return MaxChannel(emitted) > white_; }
  // Where the middle of the lens sees a point, in pixels of the whole image; absent for points that
  // are not in front of the camera.
  struct FilmPoint {
    double x = 0, y = 0;
    double blur = 0;               // half the width of what the lens makes of the point [pixels]
    double pixels_per_length = 0;  // of something at the point that faces the camera
  };
  [[nodiscard]] std::optional<FilmPoint> OnFilm(Vec3 point) const;
  // In the unit disc, of two numbers in [0, 1); its middle without a lens.
  [[nodiscard]] Vec3 OnLens(float u, float v) const;
  // Through a point of the film [pixels of the whole image] and one of the lens, in the unit disc.
  [[nodiscard]] Ray CameraRayThrough(double film_x, double film_y, Vec3 on_lens) const;
  // The bright part of what a camera's ray meets; `rng` for branches of smooth surfaces.
  [[nodiscard]] Rgb BrightOf(const Ray& ray, KeyedRng rng, PathWavelength wavelength) const;
  // Of a number in [0, 1); none where no glass disperses.
  [[nodiscard]] PathWavelength WavelengthOf(float u) const {
    return parts_.dispersion ? PathWavelength(u, scene_.uplift) : PathWavelength();
  }
  // A reflection (`lobe` 0) or refraction (1) at a smooth surface.
  struct SmoothBranch {
    // Scatters to the side of the surface that it means.
    bool exists = false;
    bool transmits = false;
    Vec3 wi;
    // Of the radiance that comes from `wi`, `weight` times `share` leaves.
    Rgb weight;
    float share = 0;
  };
  static constexpr int kSmoothLobes = 2;
  // Of a surface as it was met; none where it does not scatter smoothly.
  [[nodiscard]] std::array<SmoothBranch, kSmoothLobes> SmoothBranches(const SurfacePoint& surface,
                                                                      Vec3 wo) const;
  [[nodiscard]] bool ScattersSmoothly(const SurfacePoint& surface) const {
    return properties_[surface.material].scatters_smoothly;
  }
  [[nodiscard]] const Scene& scene() const { return scene_; }
  [[nodiscard]] const Intersector& intersector() const { return intersector_; }
  [[nodiscard]] const LightSet& lights() const { return lights_; }
  [[nodiscard]] bool has_lens() const { return has_lens_; }
  [[nodiscard]] const FilterSampler& filter() const { return filter_; }
  [[nodiscard]] const RenderSettings& settings() const { return settings_; }

 private:
  // Row-major in the whole image.
  [[nodiscard]] std::uint64_t PixelNumber(int x, int y) const;
  [[nodiscard]] PixelSampler SamplerOf(int x, int y, std::uint64_t pass) const;
  [[nodiscard]] EyePath PathOf(int x, int y, const PixelSampler& sampler, First first) const;
  [[nodiscard]] FilmOffset FilmOffsetOf(const SobolPoint& u) const;
  [[nodiscard]] Ray CameraRay(const PixelSampler& sampler, int x, int y, float& weight) const;
  // The part of emitted radiance that is brighter than the image's white.
  [[nodiscard]] Rgb BrightPart(Rgb emitted) const;
  // What a walk may meet. Tested at run time: a walk compiled for each combination was no faster
  // (docs/lean.md).
  struct WalkParts {
    bool textures = false;
    bool shading_normals = false;
    bool lobes = false;     // other scattering than diffuse
    bool lights = false;    // that are sampled
    bool caustics = false;  // hitpoints for caustic photons
    bool media = false;
    bool dispersion = false;
  };
  [[nodiscard]] static WalkParts WalkPartsFor(const SceneNeeds& needs);
  // Whether direct light was found where chains of smooth surfaces end that the camera sees, or too
  // few chains were seen to say so. Always the same for a scene and an image size.
  [[nodiscard]] bool FindsLightThroughChains() const;
  [[nodiscard]] EyePath Walk(Ray ray, const PixelSampler& sampler, First first) const;
  // The path of a pixel that is no more than a sensor.
  [[nodiscard]] EyePath AtSensor(std::size_t number, const PixelSampler& sampler) const;
  // Radiance of the lights that a ray from a gathering surface meets: the half of direct light that
  // is not drawn from the lights. `weight` includes the sample's, `pdf` is its density [sr⁻¹].
  [[nodiscard]] Rgb ScatteredDirect(const SurfacePoint& surface, const LitPoint& lit, Vec3 wi,
                                    float pdf, std::int32_t medium, Rgb weight, int& rays) const;
  // The unit of radii at a hitpoint, from the width of the pixel there.
  [[nodiscard]] float RadiusUnit(const SurfacePoint& surface, float footprint) const;
  // What the camera's ray meets. False when that is nothing.
  [[nodiscard]] bool FindFirst(const Ray& ray, First first, Hit& hit) const;
  // Of a surface with its material where it was met (MaterialAt).
  [[nodiscard]] std::array<SmoothBranch, kSmoothLobes> SmoothBranches(const SurfacePoint& surface,
                                                                      const Material& whole,
                                                                      Vec3 wo) const;
  // Where a path meets the first of a chain of smooth surfaces.
  struct SmoothChain {
    const SurfacePoint& surface;
    const Material& material;  // applied to `surface` (MaterialAt)
    Vec3 wo;
    std::int32_t medium = kNoMedium;  // in which `wo` leaves
    PathWavelength wavelength;        // has met `material`
    Rgb weight;                       // of the path so far
    int vertex = 0;
    FacetSides sides = {};
    // Whether the surface before it gathers caustic photons: which share of the light that comes
    // through the chain is theirs follows from the cosine and the density [sr⁻¹] of its scattering.
    bool is_shared = false;
    float cosine = 0, scatter_pdf = 0;
  };
  // Radiance, times the weight of the path, that a chain of smooth surfaces brings from where its
  // branches end: reflections and refractions are all followed, not drawn.
  struct ChainLight {
    Rgb emitted;    // by lights that branches meet
    Rgb scattered;  // direct light at surfaces where each eye path ends
  };
  // What rays of the first branches met: the path itself takes one of them.
  struct TracedRay {
    Ray ray;
    bool is_met = false;
    float t = 0;
    SurfacePoint surface;
  };
  using TracedRays = absl::InlinedVector<TracedRay, 6>;
  // Direct light is left out where `sampler` is nullptr. Outside of media `traced`, where there is
  // one, is filled up to its inlined size.
  [[nodiscard]] ChainLight LightThrough(const SmoothChain& chain, const PixelSampler* sampler,
                                        KeyedRng& rng, TracedRays* traced, int& rays) const;
  // Adds direct light at a point where an eye path of `weight` ends: a sample of the lights, and
  // one of the BSDF.
  void AddDirect(const ShadingPoint& point, Rgb weight, const SobolPoint& u, Rgb& direct,
                 int& rays) const;
  [[nodiscard]] PathWavelength WavelengthOf(const PixelSampler& sampler) const {
    return WavelengthOf(sampler.ForWavelength());
  }
  // What a ray in `medium` meets, behind interfaces; with media, what is left of light on the way.
  [[nodiscard]] bool FindThroughMedia(Ray& ray, Hit& hit, std::int32_t& medium, Rgb& transmittance,
                                      int& rays) const;
  // A path of `weight` and `length` ends at this point, whose material is `here`.
  [[nodiscard]] EyeHitpoint HitpointAt(const SurfacePoint& surface, const Material& here, Vec3 wo,
                                       Rgb weight, float length, bool is_glossy) const;
  // A path of `weight` and `length` goes below the surface of `entered`, which has that part alone,
  // and ends where it comes out, with a hitpoint and, where `is_lit_here`, direct light.
  void EndBelow(const ShadingPoint& entered, Rgb weight, float length, const SobolPoint& below,
                const SobolPoint& u, bool is_lit_here, EyePath& path) const;
  // A part of an eye path that ends after `t`.
  // `border`: EyeSegment's.
  [[nodiscard]] EyeSegment SegmentOf(const Ray& ray, float t, std::int32_t medium, Rgb weight,
                                     float length_before, Vec3 border) const;

  const Scene& scene_;
  const RenderSettings& settings_;
  const DirectLight direct_light_;
  const int eye_sets_;  // see EyeSetOf
  const WalkParts parts_;
  const std::vector<MaterialProperties> properties_;  // [materials]
  const bool has_lens_;
  const bool rays_find_lights_;  // some have an extent
  // Direct light where a chain of smooth surfaces ends is sampled for all its branches.
  bool lights_ends_of_chains_;
  const CausticWeight caustic_weight_;
  const float branch_weight_;  // see BranchWeight
  // Radiance above which emission is spread over the film; infinite where none is.
  const float white_;
  const Intersector& intersector_;
  const LightSet& lights_;
  const Media media_;
  std::optional<BendRadii> bends_;  // of automatic radii
  FilterSampler filter_;
  Transform world_to_camera_;
  double window_low_x_, window_high_y_;  // of the whole image on the plane z = 1
  double pixel_width_, pixel_height_;    // on that plane
  float footprint_, footprint_slope_;    // of a pixel on a surface: at no distance, and per length
};

}  // namespace lucerna
