#include "render/tracing/eye_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "render/math/equal_area_square.h"
#include "render/math/octahedral.h"
#include "render/math/warp.h"
#include "render/tracing/direct_light.h"
#include "render/transport/bsdf.h"
#include "render/transport/coat.h"
#include "render/transport/material_at.h"
#include "render/transport/subsurface.h"

namespace lucerna {
namespace {

// Eye paths weaker than this end by roulette more often than they go on.
constexpr float kRouletteWeight = 0.5F;
// What lies within a disc of this many radii of curvature on a round surface is turned by less than
// 45 degrees from its middle: 2 sin(45°/2).
constexpr float kMostBend = 0.765F;
// But a first disc is no narrower than so many pixels: what is thinner than a pixel would be noise.
constexpr float kLeastFootprints = 1;
// Branches of the specular tree weaker than `BranchWeight` end by roulette. What survives and finds
// the brightest light adds no more than kWhite times the mean radiance of the scene, so that a
// small light seen by way of several inner reflections of glass (about 0.04 each) is no bright
// speck in one pass of a hundred. Relative to the scene's own light: the same bits however bright
// it is.
constexpr float kLargestBranchWeight = 0.01F;
constexpr float kSmallestBranchWeight = 0x1p-16F;
// About what a film shows as white over what it shows as middle grey.
constexpr double kWhite = 5;

// Requires that the bounds are not empty.
double WhiteRadiance(const Intersector& intersector, const LightSet& lights) {
  // All power spread over a sphere around the scene, and scattered evenly.
  const auto diameter = static_cast<double>(intersector.bounds().Diagonal());
  const double area = std::numbers::pi * diameter * diameter;
  const double mean =
      static_cast<double>(MaxChannel(lights.TotalPower())) / (std::numbers::pi * area);
  return kWhite * mean;
}

// Direct light at the end of a weaker branch is sampled in some of the passes alone.
constexpr float kSurelyLit = 0.1F;

// Camera rays that look for direct light at the ends of chains before the first pass, and how many
// must meet a chain for them to say that there is none.
constexpr std::uint64_t kPilotRays = 1024;
constexpr int kFewestChains = 64;

// Whether all eye paths end there.
bool EndsPaths(const MaterialProperties& properties) {
  return properties.gathers && !properties.has_parts;
}

float BranchWeight(const Intersector& intersector, const LightSet& lights) {
  const auto brightest = static_cast<double>(lights.LargestRadiance());
  if (!(brightest > 0) || intersector.bounds().empty()) return kLargestBranchWeight;
  return static_cast<float>(std::clamp(WhiteRadiance(intersector, lights) / brightest,
                                       static_cast<double>(kSmallestBranchWeight),
                                       static_cast<double>(kLargestBranchWeight)));
}

// Radius of a pixel filter up to which lights are spread [pixels]. The cost grows with its square:
// with 4 some 200 pixels count for each one near a light, with 16 a pass took four times as long.
constexpr float kWidestSpread = 4;

// Radiance above which emission that the camera sees is spread over the film. Infinite where no
// light is so bright, for very wide filters, and where light is lost in media on its way.
float SpreadAbove(const Scene& scene, bool rays_find_lights, const Intersector& intersector,
                  const LightSet& lights) {
  const float radius = std::max(scene.filter.radius_x, scene.filter.radius_y);
  // A sensor sees no light itself.
  const bool can_be_spread =
      radius <= kWidestSpread && scene.media.empty() && scene.camera.kind != Camera::Kind::kSensors;
  if (!can_be_spread || !rays_find_lights || intersector.bounds().empty()) return HUGE_VALF;
  const double white = WhiteRadiance(intersector, lights);
  if (!(static_cast<double>(lights.LargestRadiance()) > white)) return HUGE_VALF;
  return static_cast<float>(white);
}

// The direction in camera space of a place on the film, in [0, 1]² unless a filter reaches beyond.
// As in pbrt-v4's spherical camera.
Vec3 SphericalDirection(Camera::Kind kind, double x, double y) {
  Vec3 z_up;
  if (kind == Camera::Kind::kEquirectangular) {
    const double theta = std::numbers::pi * y;
    const double phi = 2 * std::numbers::pi * x;
    z_up = {static_cast<float>(std::sin(theta) * std::cos(phi)),
            static_cast<float>(std::sin(theta) * std::sin(phi)),
            static_cast<float>(std::cos(theta))};
  } else {
    // Beyond an edge of the square lies what is on its other half, mirrored.
    const auto mirror = [](double& across, double& along) {
      if (across < 0)
        across = -across;
      else if (across > 1)
        across = 2 - across;
      else
        return;
      along = 1 - along;
    };
    mirror(x, y);
    mirror(y, x);
    z_up = EqualAreaDirection({static_cast<float>(x), static_cast<float>(y)});
  }
  return {z_up.x, z_up.z, z_up.y};
}

// Samples of direct light in a bucket, in each pass: a bright spot may fill a small part of a large
// bucket, and where there are many buckets each is small.
int BucketSamples(std::size_t buckets) {
  constexpr std::size_t kMostInAll = std::size_t{1} << 19;
  constexpr std::size_t kMost = 16;
  return static_cast<int>(std::clamp(kMostInAll / buckets, std::size_t{1}, kMost));
}

// A point of a bucket, from two numbers in [0, 1): uniform in its triangle, on a ball uniform in
// the triangle under it.
Sensor PointOf(const SensorBucket& bucket, const Sensor& sensor, float u, float v) {
  const float root = std::sqrt(u);
  const auto& [a, b, c] = bucket.corners;
  Sensor at = sensor;
  at.position = a * (1 - root) + b * (root * (1 - v)) + c * (root * v);
  if (bucket.ball_radius > 0) {
    const Vec3 out = Normalize(at.position - bucket.ball_center);
    at.position = bucket.ball_center + out * bucket.ball_radius;
    at.normal = Dot(out, sensor.normal) < 0 ? -out : out;
  }
  return at;
}

}  // namespace

EyePathTracer::EyePathTracer(const Scene& scene, const RenderSettings& settings,
                             const SceneNeeds& needs, const Intersector& intersector,
                             const LightSet& lights, int threads, DirectLight direct_light)
    : scene_(scene),
      settings_(settings),
      direct_light_(direct_light),
      eye_sets_(needs.eye_sample_sets()),
      parts_(WalkPartsFor(needs)),
      properties_(PropertiesOf(scene.materials)),
      has_lens_(needs.Uses(Part::kLens)),
      rays_find_lights_(needs.Uses(Part::kAreaLights) || needs.Uses(Part::kEnvironment)),
      lights_ends_of_chains_(parts_.lights && direct_light == DirectLight::kEverywhere),
      caustic_weight_(scene, settings, intersector.bounds()),
      branch_weight_(BranchWeight(intersector, lights)),
      white_(SpreadAbove(scene, rays_find_lights_, intersector, lights)),
      intersector_(intersector),
      lights_(lights),
      media_(scene, intersector),
      filter_(scene.filter) {
  // Other radii do not ask.
  if (settings.initial_radius == 0 && needs.Uses(Part::kPhotons)) bends_.emplace(scene, threads);
  // Readers let only invertible transforms pass.
  world_to_camera_ = scene.camera.camera_to_world.Inverse().value_or(Transform());
  const Window window = ScreenWindow(scene.camera, settings.width, settings.height);
  window_low_x_ = window.low_x;
  window_high_y_ = window.high_y;
  pixel_width_ = (window.high_x - window.low_x) / settings.width;
  pixel_height_ = (window.high_y - window.low_y) / settings.height;
  footprint_ = static_cast<float>(PixelFootprint(scene.camera, settings.width, settings.height, 0));
  footprint_slope_ =
      static_cast<float>(PixelFootprint(scene.camera, settings.width, settings.height, 1) -
                         PixelFootprint(scene.camera, settings.width, settings.height, 0));
  // Under water a sun lights nothing but by caustics, and following all branches of what the camera
  // sees through the waves costs a tenth of a pass. Where lights have an extent branches are
  // followed for their emission anyway.
  if (lights_ends_of_chains_ && !rays_find_lights_ && !parts_.media &&
      scene.camera.kind != Camera::Kind::kSensors) {
    lights_ends_of_chains_ = FindsLightThroughChains();
  }
}

bool EyePathTracer::FindsLightThroughChains() const {
  constexpr std::uint64_t kPilotKey = 0x50494C4F54524159ULL;
  int chains = 0;
  for (std::uint64_t i = 0; i < kPilotRays; ++i) {
    const SobolPoint u = OwenSobol(i, kPilotKey);
    const Ray ray =
        CameraRayThrough(static_cast<double>(u[0]) * settings_.width,
                         static_cast<double>(u[1]) * settings_.height, OnLens(u[2], u[3]));
    Hit hit;
    if (!FindFirst(ray, {}, hit)) continue;
    SurfacePoint surface = intersector_.SurfaceAt(ray, hit);
    if (!properties_[surface.material].scatters_smoothly) continue;
    ++chains;
    const Vec3 wo = -ray.direction;
    const PixelSampler sampler(kPilotKey, i, 0, 0);
    const PathWavelength wavelength = WavelengthOf(u[4]);
    std::optional<Material> storage;
    const Material& material = MaterialAt(scene_, surface, wo, storage, wavelength);
    KeyedRng rng = sampler.ForBranches();
    int rays = 0;
    const ChainLight light = LightThrough({.surface = surface,
                                           .material = material,
                                           .wo = wo,
                                           .wavelength = wavelength,
                                           .weight = Gray(1)},
                                          &sampler, rng, nullptr, rays);
    if (!IsBlack(light.scattered)) return true;
  }
  return chains < kFewestChains;
}

Ray EyePathTracer::CameraRay(const PixelSampler& sampler, int x, int y, float& weight) const {
  const SobolPoint u = sampler.ForCamera();
  const FilterSampler::Draw drawn = filter_.Sample(u[0], u[1]);
  weight *= drawn.weight;
  return CameraRayThrough(settings_.crop_x0 + x + 0.5 + static_cast<double>(drawn.x),
                          settings_.crop_y0 + y + 0.5 + static_cast<double>(drawn.y),
                          OnLens(u[2], u[3]));
}

Vec3 EyePathTracer::OnLens(float u, float v) const {
  return has_lens_ ? SquareToDisk(u, v) : Vec3{};
}

Ray EyePathTracer::CameraRayThrough(double film_x, double film_y, Vec3 on_lens) const {
  const Camera& camera = scene_.camera;
  const auto ray_from = [&](Vec3 from, Vec3 towards) {
    return Ray{camera.camera_to_world.Point(from),
               Normalize(camera.camera_to_world.Vector(towards)), HUGE_VALF};
  };
  if (camera.kind == Camera::Kind::kEqualArea || camera.kind == Camera::Kind::kEquirectangular) {
    return ray_from(
        {}, SphericalDirection(camera.kind, film_x / settings_.width, film_y / settings_.height));
  }
  Vec3 origin;
  Vec3 direction = {static_cast<float>(window_low_x_ + film_x * pixel_width_),
                    static_cast<float>(window_high_y_ - film_y * pixel_height_), 1};
  if (camera.kind == Camera::Kind::kOrthographic) {
    origin = {direction.x, direction.y, 0};
    direction = {0, 0, 1};
    if (!has_lens_) return ray_from(origin, direction);
    const Vec3 focus = origin + direction * static_cast<float>(camera.focal_distance);
    origin = origin + on_lens * static_cast<float>(camera.lens_radius);
    return ray_from(origin, focus - origin);
  }
  if (has_lens_) {
    // A thin lens: all rays of one film point meet on the plane of focus.
    const Vec3 focus = direction * static_cast<float>(camera.focal_distance);
    origin = on_lens * static_cast<float>(camera.lens_radius);
    direction = focus - origin;
  }
  return ray_from(origin, direction);
}

std::uint64_t EyePathTracer::PixelNumber(int x, int y) const {
  return static_cast<std::uint64_t>(settings_.crop_y0 + y) *
             static_cast<std::uint64_t>(settings_.width) +
         static_cast<std::uint64_t>(settings_.crop_x0 + x);
}

PixelSampler EyePathTracer::SamplerOf(int x, int y, std::uint64_t pass) const {
  return {settings_.seed, PixelNumber(x, y), pass, EyeSetOf(pass, eye_sets_)};
}

EyePathTracer::FilmOffset EyePathTracer::FilmOffsetOf(int x, int y, std::uint64_t pass) const {
  return FilmOffsetOf(SamplerOf(x, y, pass).ForCamera());
}

EyePathTracer::FilmOffset EyePathTracer::FilmOffsetOf(const SobolPoint& u) const {
  const FilterSampler::Draw drawn = filter_.Sample(u[0], u[1]);
  return {drawn.x, drawn.y, OnLens(u[2], u[3])};
}

Rgb EyePathTracer::BrightPart(Rgb emitted) const {
  const float strength = MaxChannel(emitted);
  return strength > white_ ? emitted * (1 - white_ / strength) : Rgb{};
}

Rgb EyePathTracer::BrightOf(const Ray& ray, KeyedRng rng, PathWavelength wavelength) const {
  Hit hit;
  if (!FindFirst(ray, {}, hit))
    return BrightPart(lights_.InfiniteRadiance(ray.origin, ray.direction));
  SurfacePoint surface = intersector_.SurfaceAt(ray, hit);
  const Vec3 wo = -ray.direction;
  const Rgb bright = BrightPart(lights_.EmittedRadiance(surface, wo));
  if (!properties_[surface.material].scatters_smoothly) return bright;
  int rays = 0;
  std::optional<Material> storage;
  const Material& material = MaterialAt(scene_, surface, wo, storage, wavelength);
  const Rgb color = wavelength.IsFirstUsedAt(material) ? wavelength.color() : Gray(1);
  const ChainLight light = LightThrough({.surface = surface,
                                         .material = material,
                                         .wo = wo,
                                         .wavelength = wavelength,
                                         .weight = color},
                                        nullptr, rng, nullptr, rays);
  return bright + BrightPart(light.emitted);
}

Rgb EyePathTracer::TraceBright(int x, int y, std::uint64_t pass) const {
  const PixelSampler sampler = SamplerOf(x, y, pass);
  float filter_weight = 1;
  const Ray ray = CameraRay(sampler, x, y, filter_weight);
  return BrightOf(ray, sampler.ForBranches(), WavelengthOf(sampler));
}

EyePathTracer::BrightPath EyePathTracer::TraceBrightPath(int x, int y, std::uint64_t pass,
                                                         int number, int count) const {
  const BrightSample sample = SamplerOf(x, y, pass).ForBright(number, count);
  BrightPath path;
  path.from = FilmOffsetOf(sample.camera);
  const Ray ray = CameraRayThrough(settings_.crop_x0 + x + 0.5 + static_cast<double>(path.from.x),
                                   settings_.crop_y0 + y + 0.5 + static_cast<double>(path.from.y),
                                   path.from.on_lens);
  path.bright = BrightOf(ray, sample.branches, WavelengthOf(sample.wavelength()));
  return path;
}

std::optional<EyePathTracer::FilmPoint> EyePathTracer::OnFilm(Vec3 point) const {
  // Outlines are only followed where they are straight on the film and grow with nearness.
  if (scene_.camera.kind != Camera::Kind::kPerspective) return std::nullopt;
  const Vec3 p = world_to_camera_.Point(point);
  if (!(p.z > 0)) return std::nullopt;
  const auto z = static_cast<double>(p.z);
  FilmPoint film;
  film.x = (static_cast<double>(p.x) / z - window_low_x_) / pixel_width_;
  film.y = (window_high_y_ - static_cast<double>(p.y) / z) / pixel_height_;
  const double per_tangent = 1 / std::min(pixel_width_, pixel_height_);
  film.pixels_per_length = per_tangent / z;
  const Camera& camera = scene_.camera;
  film.blur = camera.lens_radius * std::abs(1 / z - 1 / camera.focal_distance) * per_tangent;
  if (!std::isfinite(film.x) || !std::isfinite(film.y)) return std::nullopt;
  return film;
}

Rgb EyePathTracer::BrightAtCentre(int x, int y) const {
  const Ray ray =
      CameraRayThrough(settings_.crop_x0 + x + 0.5, settings_.crop_y0 + y + 0.5, Vec3{});
  Hit hit;
  if (!intersector_.Intersect(ray, hit)) {
    return BrightPart(lights_.InfiniteRadiance(ray.origin, ray.direction));
  }
  return BrightPart(lights_.EmittedRadiance(intersector_.SurfaceAt(ray, hit), -ray.direction));
}

EyePath EyePathTracer::Trace(int x, int y, std::uint64_t pass, First first) const {
  return PathOf(x, y, SamplerOf(x, y, pass), first);
}

EyePath EyePathTracer::TraceMore(int x, int y, std::uint64_t pass, int number, int count) const {
  return PathOf(x, y, PixelSampler::ForMore(settings_.seed, PixelNumber(x, y), pass, number, count),
                {});
}

EyePath EyePathTracer::PathOf(int x, int y, const PixelSampler& sampler, First first) const {
  if (scene_.camera.kind == Camera::Kind::kSensors) {
    return AtSensor(static_cast<std::size_t>(PixelNumber(x, y)), sampler);
  }
  // The filter's weight is kept out of the walk, because it can be negative.
  float filter_weight = 1;
  EyePath path = Walk(CameraRay(sampler, x, y, filter_weight), sampler, first);
  path.direct *= filter_weight;
  path.hitpoint.weight *= filter_weight;
  path.caustic.weight *= path.caustic_strength * filter_weight;
  path.segment.weight *= filter_weight;
  return path;
}

bool EyePathTracer::FindThroughMedia(Ray& ray, Hit& hit, std::int32_t& medium, Rgb& transmittance,
                                     int& rays) const {
  ++rays;
  const bool is_met = intersector_.Intersect(ray, hit);
  if (!parts_.media) return is_met;
  return media_.Follow(
      ray, is_met, hit, medium, rays,
      [&](const Ray& leg, float t, std::int32_t of_leg, const SurfacePoint* /*entered*/) {
        if (of_leg != kNoMedium) transmittance *= media_.TransmittanceOf(of_leg, leg, t);
      });
}

EyeSegment EyePathTracer::SegmentOf(const Ray& ray, float t, std::int32_t medium, Rgb weight,
                                    float length_before, Vec3 border) const {
  // What lies so many mean free paths away is not seen, and nothing lies far outside of the scene.
  constexpr float kMostFreePaths = 40;
  constexpr float kMostDiagonals = 8;
  const Medium& through = media_[medium];
  const Rgb extinction = through.Extinction();
  const float least = std::min({extinction.r, extinction.g, extinction.b});
  float end = std::min(t, kMostDiagonals * intersector_.bounds().Diagonal());
  if (least > 0)
    end = through.Travel(ray.origin, ray.direction, end, kMostFreePaths / least).length;
  const auto footprint_at = [&](float length) { return footprint_ + footprint_slope_ * length; };
  return {.from = ray.origin,
          .to = ray.origin + ray.direction * end,
          .medium = medium,
          .weight = weight,
          .from_footprint = footprint_at(length_before),
          .to_footprint = footprint_at(length_before + end),
          .border = Dot(border, ray.direction) < 0 ? border : -border,
          .free_path = 1 / (MaxChannel(extinction) * through.GreatestDensity())};
}

std::array<EyePathTracer::SmoothBranch, EyePathTracer::kSmoothLobes> EyePathTracer::SmoothBranches(
    const SurfacePoint& surface, Vec3 wo) const {
  SurfacePoint completed = surface;
  std::optional<Material> storage;
  const Material& material = MaterialAt(scene_, completed, wo, storage);
  return SmoothBranches(completed, material, wo);
}

std::array<EyePathTracer::SmoothBranch, EyePathTracer::kSmoothLobes> EyePathTracer::SmoothBranches(
    const SurfacePoint& surface, const Material& whole, Vec3 wo) const {
  std::array<SmoothBranch, kSmoothLobes> branches;
  const MaterialProperties changed =
      whole.DependsOnPlace() ? PropertiesOf(whole) : MaterialProperties();
  const MaterialProperties& properties =
      whole.DependsOnPlace() ? changed : properties_[surface.material];
  if (!properties.scatters_smoothly) return branches;
  Material part;
  const Material& material = properties.has_parts ? PartOf(whole, Parts::kFirst, part) : whole;
  const Frame frame = ShadingFrame(surface);
  const Vec3 wo_local = frame.ToLocal(wo);
  const float reflectance = ReflectedShare(material, wo_local.z);
  for (std::size_t lobe = 0; lobe < kSmoothLobes; ++lobe) {
    SmoothBranch& branch = branches[lobe];
    branch.share = lobe == 0 ? reflectance : 1 - reflectance;
    if (!(branch.share > 0)) continue;
    BsdfSample sample;
    // 0 draws the reflection and 1 - ulp the refraction.
    const float u = lobe == 0 ? 0.0F : 0x1.fffffep-1F;
    if (!SampleBsdf(material, wo_local, u, 0, 0, Carried::kRadiance, sample)) {
      branch.share = 0;
      continue;
    }
    branch.wi = frame.ToWorld(sample.wi);
    branch.weight = sample.weight;
    branch.transmits = wo_local.z * sample.wi.z < 0;
    branch.exists = SidesAgree(surface, wo, branch.wi, branch.transmits);
  }
  return branches;
}

EyePathTracer::ChainLight EyePathTracer::LightThrough(const SmoothChain& chain,
                                                      const PixelSampler* sampler, KeyedRng& rng,
                                                      TracedRays* traced, int& rays) const {
  struct Branch {
    Ray ray;
    std::int32_t medium;
    PathWavelength wavelength;
    Rgb weight;
    int vertex;
    std::uint64_t number;  // in the tree: twice that of the vertex before, plus one if refracted
    FacetSides sides;
  };
  const auto share_of_rays = [&](float emission_density) {
    if (!chain.is_shared) return 1.0F;
    return caustic_weight_.OfRays(emission_density, chain.cosine, chain.scatter_pdf);
  };
  // A pair at each vertex, of which one is followed at once: the stack grows by one a vertex.
  absl::InlinedVector<Branch, 8> branches;
  const auto branch_at = [&](const SurfacePoint& surface, const Material& whole, Vec3 wo,
                             std::int32_t before, const PathWavelength& of_path, Rgb weight,
                             int vertex, std::uint64_t number, const FacetSides& sides_before) {
    if (vertex >= settings_.max_depth) return;
    const auto smooth = SmoothBranches(surface, whole, wo);
    for (std::size_t lobe = 0; lobe < smooth.size(); ++lobe) {
      const SmoothBranch& branch = smooth[lobe];
      if (!(branch.share > 0)) continue;
      FacetSides sides = sides_before;
      if (!sides.Scatter(surface, whole, wo, branch.wi, branch.transmits)) continue;
      Rgb next = weight * branch.weight * branch.share;
      const float strength = MaxChannel(next);
      if (strength < branch_weight_) {
        if (!(rng.Uniform() * branch_weight_ < strength)) continue;
        next *= branch_weight_ / strength;
      }
      const std::int32_t after =
          parts_.media ? media_.After(surface, wo, branch.wi, before) : before;
      branches.push_back({{LeavingPoint(surface, branch.wi), branch.wi, HUGE_VALF},
                          after,
                          of_path,
                          next,
                          vertex + 1,
                          2 * number + lobe,
                          sides});
    }
  };
  ChainLight light;
  branch_at(chain.surface, chain.material, chain.wo, chain.medium, chain.wavelength, chain.weight,
            chain.vertex, /*number=*/1, chain.sides);
  while (!branches.empty()) {
    Branch branch = branches.back();
    branches.pop_back();
    Hit hit;
    const Ray ray = branch.ray;
    const Vec3 from = ray.origin;
    const bool is_met = FindThroughMedia(branch.ray, hit, branch.medium, branch.weight, rays);
    SurfacePoint surface;
    if (is_met) surface = intersector_.SurfaceAt(branch.ray, hit);
    if (traced != nullptr && !parts_.media && traced->size() < traced->capacity())
      traced->push_back({ray, is_met, hit.t, surface});
    if (!is_met) {
      if (branch.sides.is_behind()) continue;
      const Vec3 direction = branch.ray.direction;
      light.emitted += branch.weight * lights_.InfiniteRadiance(from, direction) *
                       share_of_rays(lights_.EmissionDensityInfinite(from, direction));
      continue;
    }
    const Vec3 wo = -branch.ray.direction;
    const Rgb emitted = branch.sides.is_behind() ? Rgb() : lights_.EmittedRadiance(surface, wo);
    if (!IsBlack(emitted))
      light.emitted += branch.weight * emitted * share_of_rays(lights_.EmissionDensity(surface));
    const bool may_end = sampler != nullptr && properties_[surface.material].gathers;
    if (!may_end && !properties_[surface.material].scatters_smoothly) continue;
    std::optional<Material> storage;
    const Material& material = MaterialAt(scene_, surface, wo, storage, branch.wavelength);
    if (!branch.sides.MayMeet(surface, material)) continue;
    if (branch.wavelength.IsFirstUsedAt(material)) branch.weight *= branch.wavelength.color();
    if (may_end && branch.vertex < settings_.max_depth &&
        EndsPaths(storage ? PropertiesOf(*storage) : properties_[surface.material])) {
      const SobolPoint u = sampler->ForBranchEnd(chain.vertex, branch.number);
      const float strength = MaxChannel(branch.weight);
      if (!(u[6] * kSurelyLit < strength)) continue;
      const Frame frame = ShadingFrame(surface);
      AddDirect({.surface = surface,
                 .material = material,
                 .frame = frame,
                 .wo = wo,
                 .media = parts_.media ? &media_ : nullptr,
                 .medium = branch.medium,
                 .sides = branch.sides},
                branch.weight * std::max(1.0F, kSurelyLit / strength), u, light.scattered, rays);
      continue;
    }
    branch_at(surface, material, wo, branch.medium, branch.wavelength, branch.weight, branch.vertex,
              branch.number, branch.sides);
  }
  return light;
}

void EyePathTracer::AddDirect(const ShadingPoint& point, Rgb weight, const SobolPoint& u,
                              Rgb& direct, int& rays) const {
  direct += weight * LightSampledRadiance(intersector_, lights_, point, u, rays);
  if (!rays_find_lights_) return;
  const Vec3 wo = point.frame.ToLocal(point.wo);
  BsdfSample sample;
  const bool scattered =
      parts_.lobes ? SampleBsdf(point.material, wo, u[0], u[1], u[2], Carried::kRadiance, sample)
                   : SampleDiffuse(point.material, wo, u[1], u[2], sample);
  if (!scattered) return;
  const Vec3 wi = point.frame.ToWorld(sample.wi);
  FacetSides sides = point.sides;
  if (parts_.shading_normals && !sides.Scatter(point.surface, point.material, point.wo, wi,
                                               sample.wi.z * Dot(point.frame.n, point.wo) < 0)) {
    return;
  }
  const std::int32_t medium =
      parts_.media ? media_.After(point.surface, point.wo, wi, point.medium) : point.medium;
  direct += ScatteredDirect(point.surface, LitPointOf(point.surface, point.material, point.wo), wi,
                            sample.pdf, medium, weight * sample.weight, rays);
}

bool EyePathTracer::FindFirst(const Ray& ray, First first, Hit& hit) const {
  std::uint32_t shape = kNoShape;
  if (first.is_known) {
    shape = *first.shape;
  } else {
    if (intersector_.Intersect(ray, hit)) shape = intersector_.ShapeOf(hit);
    if (first.shape != nullptr) *first.shape = shape;
  }
  if (shape == kNoShape) return false;
  // Found or known, the hit has the same bits.
  hit = intersector_.HitOn(shape, ray);
  return true;
}

Rgb EyePathTracer::ScatteredDirect(const SurfacePoint& surface, const LitPoint& lit, Vec3 wi,
                                   float pdf, std::int32_t medium, Rgb weight, int& rays) const {
  Ray probe = {LeavingPoint(surface, wi), wi, HUGE_VALF};
  Hit hit;
  if (!FindThroughMedia(probe, hit, medium, weight, rays)) {
    return weight * lights_.InfiniteRadiance(surface.position, wi) *
           PowerHeuristic(pdf, lights_.PdfDirectInfinite(lit, wi));
  }
  const SurfacePoint light = intersector_.SurfaceAt(probe, hit);
  const Rgb radiance = lights_.EmittedRadiance(light, -wi);
  if (IsBlack(radiance)) return {};
  return weight * radiance * PowerHeuristic(pdf, lights_.PdfDirect(lit, light));
}

EyePath EyePathTracer::AtSensor(std::size_t number, const PixelSampler& sampler) const {
  EyePath path;
  // The last row may be longer than there are sensors.
  if (number >= scene_.sensors.size()) return path;
  const Sensor& sensor = scene_.sensors[number];
  static const Material white = [] {
    Material material;
    material.reflectance = Gray(1);
    return material;
  }();
  constexpr Vec3 kUp = {0, 0, 1};
  const auto direct_at = [&](const Sensor& at, const SobolPoint& u) {
    SurfacePoint surface;
    surface.position = at.position;
    surface.geometric_normal = at.normal;
    surface.shading_normal = at.normal;
    // The surface under it is not known: as far off as for one that is as large as the scene.
    surface.clearance = kClearance * (MaxAbs(at.position) + intersector_.bounds().Diagonal());
    const Frame frame = ShadingFrame(surface);
    const std::int32_t medium =
        parts_.media ? media_.AtLight(LeavingPoint(surface, at.normal), scene_.camera.medium)
                     : kNoMedium;
    const ShadingPoint point = {surface, white, frame, at.normal, parts_.media ? &media_ : nullptr,
                                medium};
    Rgb direct = LightSampledRadiance(intersector_, lights_, point, u, path.rays);
    BsdfSample sample;
    if (rays_find_lights_ && SampleDiffuse(white, kUp, u[1], u[2], sample)) {
      direct +=
          ScatteredDirect(surface, LitPointOf(surface, white, at.normal), frame.ToWorld(sample.wi),
                          sample.pdf, medium, sample.weight, path.rays);
    }
    return direct;
  };
  path.features = {white.reflectance, sensor.normal, 0};
  if (parts_.lights && scene_.sensor_buckets.empty()) {
    path.direct += direct_at(sensor, sampler.ForVertex(0));
  } else if (parts_.lights) {
    const int count = BucketSamples(scene_.sensor_buckets.size());
    for (int i = 0; i < count; ++i) {
      // A sensor sees no bright lights, for which these numbers are elsewhere.
      const SobolPoint u = sampler.ForBright(i, count).camera;
      path.direct += direct_at(PointOf(scene_.sensor_buckets[number], sensor, u[0], u[6]), u) *
                     (1.0F / static_cast<float>(count));
    }
  }
  path.hitpoint.position = sensor.position;
  path.hitpoint.normal = sensor.normal;
  path.hitpoint.weight = EyeFactor(white, kUp);
  path.hitpoint.footprint = sensor.spacing;
  return path;
}

float EyePathTracer::RadiusUnit(const SurfacePoint& surface, float footprint) const {
  if (!bends_) return footprint;
  const float widest = std::max(kMostBend * bends_->At(surface), kLeastFootprints * footprint);
  return std::min(footprint, widest / static_cast<float>(settings_.initial_footprints));
}

EyeHitpoint EyePathTracer::HitpointAt(const SurfacePoint& surface, const Material& here, Vec3 wo,
                                      Rgb weight, float length, bool is_glossy) const {
  EyeHitpoint hitpoint;
  hitpoint.position = surface.position;
  hitpoint.normal = FaceForward(surface.geometric_normal, wo);
  hitpoint.is_glossy = is_glossy;
  hitpoint.material = surface.material;
  hitpoint.to_eye = wo;
  hitpoint.shading_normal = surface.shading_normal;
  if (is_glossy && here.DependsOnPlace()) {
    hitpoint.place = {TexturedParameter(here), NumbersOf(here),
                      surface.tangent == Vec3() ? kNoTangent : EncodeOctahedral(surface.tangent)};
  }
  hitpoint.weight = weight;
  hitpoint.footprint = RadiusUnit(surface, footprint_ + footprint_slope_ * length);
  return hitpoint;
}

void EyePathTracer::EndBelow(const ShadingPoint& entered, Rgb weight, float length,
                             const SobolPoint& below, const SobolPoint& u, bool is_lit_here,
                             EyePath& path) const {
  LeftBelow left;
  if (!SampleBelow(scene_, intersector_, entered.material, entered.surface, entered.wo, below[0],
                   below[1], below[2], below[3], left, path.rays)) {
    return;
  }
  // Seen from here, light leaves along the normal; what the surface lets through towards the eye is
  // known where the path went below.
  constexpr Vec3 kUp = {0, 0, 1};
  weight *= left.weight * (CoatEntering(entered.material, Up(entered.frame.ToLocal(entered.wo))) /
                           CoatEntering(entered.material, kUp));
  if (parts_.lights && is_lit_here) {
    const Frame frame = ShadingFrame(left.surface);
    AddDirect({left.surface, entered.material, frame, left.up, entered.media, entered.medium, -1,
               entered.sides},
              weight, u, path.direct, path.rays);
  }
  const bool is_glossy = !PropertiesOf(entered.material).is_separable;
  path.hitpoint = HitpointAt(left.surface, entered.material, left.up, weight, length, is_glossy);
  if (!is_glossy) path.hitpoint.weight *= EyeFactor(entered.material, kUp);
}

EyePath EyePathTracer::Walk(Ray ray, const PixelSampler& sampler, First first) const {
  EyePath path;
  Rgb weight = Gray(1);
  float length = 0;
  // The density of the last scattering [sr⁻¹] when the lights were sampled there too, and where.
  float scatter_pdf = 0;
  LitPoint scatter_point;
  // Emission and direct light at the end of a chain of smooth surfaces are collected from the whole
  // tree of their branches where the chain begins: a small light seen in glass would otherwise be
  // one bright speck in thousands of passes.
  bool was_collected = false;
  KeyedRng branch_rng = sampler.ForBranches();
  TracedRays traced;
  // The last surface that gathers caustic photons, as long as only smooth ones have come since.
  struct Receiver {
    float scatter_pdf = 0, cosine = 0;
    bool is_last = false;
    bool was_left_smoothly = false;
  };
  Receiver receiver;
  const auto share_of_rays = [&](float emission_density) {
    if (!parts_.caustics || !receiver.was_left_smoothly) return 1.0F;
    return caustic_weight_.OfRays(emission_density, receiver.cosine, receiver.scatter_pdf);
  };
  KeyedRng caustic_rng = sampler.ForCaustics();
  std::int32_t medium = parts_.media ? media_.AtCamera() : kNoMedium;
  KeyedRng segment_rng = sampler.ForSegments();
  float segment_strength = 0;       // sum over the segments so far
  std::optional<Vec3> left_normal;  // of the surface that the path has left last
  const auto pass_leg = [&](const Ray& leg, float t, std::int32_t of_leg,
                            const SurfacePoint* entered) {
    if (of_leg != kNoMedium) {
      const Rgb transmittance = media_.TransmittanceOf(of_leg, leg, t);
      if (media_[of_leg].Scatters()) {
        // One of them is drawn in proportion to about what it scatters, and stands for all.
        const float strength =
            MaxChannel(weight * (Gray(1) - transmittance) * media_[of_leg].ScatteredShare());
        segment_strength += strength;
        if (segment_rng.Uniform() * segment_strength < strength) {
          const Vec3 border =
              entered != nullptr ? entered->geometric_normal : left_normal.value_or(-leg.direction);
          path.segment = SegmentOf(leg, t, of_leg, weight * (1 / strength), length, border);
        }
      }
      weight *= transmittance;
    }
    if (t < HUGE_VALF) length += t;
  };
  // After the walk.
  const auto finish = [&]() -> EyePath& {
    path.segment.weight *= segment_strength;
    return path;
  };
  PathWavelength wavelength = WavelengthOf(sampler);
  FacetSides sides;
  bool has_features = false;  // of a gathering surface
  const auto add_first_emission = [&](Rgb emitted) {
    const Rgb bright = BrightPart(emitted);
    path.bright += bright;
    path.direct += emitted - bright;
  };

  for (int vertex = 0;; ++vertex) {
    Hit hit;
    const Vec3 from = ray.origin;
    const auto known = std::ranges::find_if(traced, [&](const TracedRay& other) {
      return other.ray.origin == ray.origin && other.ray.direction == ray.direction;
    });
    const bool is_known = known != traced.end();
    bool is_met = false;
    if (is_known) {
      is_met = known->is_met;
      hit.t = known->t;
    } else {
      ++path.rays;
      is_met = vertex == 0 ? FindFirst(ray, first, hit) : intersector_.Intersect(ray, hit);
    }
    if (parts_.media) {
      is_met = media_.Follow(ray, is_met, hit, medium, path.rays, pass_leg);
    } else if (is_met) {
      length += hit.t;
    }
    if (!is_met) {
      if (was_collected || sides.is_behind()) return finish();
      if (vertex == 0) {
        add_first_emission(weight * lights_.InfiniteRadiance(from, ray.direction));
        return finish();
      }
      const float mis =
          scatter_pdf > 0
              ? PowerHeuristic(scatter_pdf, lights_.PdfDirectInfinite(scatter_point, ray.direction))
              : 1;
      path.direct += weight * lights_.InfiniteRadiance(from, ray.direction) *
                     (mis * share_of_rays(lights_.EmissionDensityInfinite(from, ray.direction)));
      return finish();
    }
    SurfacePoint surface = is_known ? known->surface : intersector_.SurfaceAt(ray, hit);
    const Vec3 wo = -ray.direction;
    const Rgb emitted = sides.is_behind() ? Rgb() : lights_.EmittedRadiance(surface, wo);
    if (vertex == 0) {
      add_first_emission(weight * emitted);
    } else if (!IsBlack(emitted) && !was_collected) {
      const float mis = scatter_pdf > 0
                            ? PowerHeuristic(scatter_pdf, lights_.PdfDirect(scatter_point, surface))
                            : 1;
      path.direct += weight * emitted * (mis * share_of_rays(lights_.EmissionDensity(surface)));
    }
    std::optional<Material> textured;
    const Material& whole = [&]() -> const Material& {
      if (parts_.textures) return MaterialAt(scene_, surface, wo, textured, wavelength);
      return scene_.materials[surface.material];
    }();
    if (parts_.shading_normals && !sides.MayMeet(surface, whole)) return finish();
    if (parts_.dispersion && wavelength.IsFirstUsedAt(whole)) weight *= wavelength.color();
    MaterialProperties changed = textured ? PropertiesOf(*textured) : MaterialProperties();
    const MaterialProperties& whole_properties = textured ? changed : properties_[surface.material];
    if (!has_features && (vertex == 0 || whole_properties.gathers)) {
      path.features = {AlbedoOf(whole), FaceForward(surface.shading_normal, wo), length};
      has_features = whole_properties.gathers;
    }
    if (vertex >= settings_.max_depth) return finish();

    const Frame frame = ShadingFrame(surface);
    const SobolPoint u = sampler.ForVertex(vertex);
    const Vec3 wo_local = frame.ToLocal(wo);
    const bool has_parts = parts_.lobes && whole_properties.has_parts;
    const float share_of_first = has_parts ? ShareOfFirst(whole, wo_local) : -1;
    const bool was_lit_before = was_collected && lights_ends_of_chains_;
    if (parts_.lobes && whole_properties.scatters_smoothly &&
        (rays_find_lights_ || lights_ends_of_chains_) && !was_collected) {
      traced.clear();
      const ChainLight light =
          LightThrough({.surface = surface,
                        .material = whole,
                        .wo = wo,
                        .medium = medium,
                        .wavelength = wavelength,
                        .weight = weight,
                        .vertex = vertex,
                        .sides = sides,
                        .is_shared = parts_.caustics && receiver.is_last,
                        .cosine = receiver.cosine,
                        .scatter_pdf = receiver.scatter_pdf},
                       lights_ends_of_chains_ ? &sampler : nullptr, branch_rng, &traced, path.rays);
      if (vertex == 0) {
        add_first_emission(light.emitted);
      } else {
        path.direct += light.emitted;
      }
      path.direct += light.scattered;
      was_collected = true;
    }
    const bool is_lit_otherwise =
        (direct_light_ == DirectLight::kWherePathsGoOn && whole_properties.gathers) ||
        (was_lit_before && EndsPaths(whole_properties));
    if (parts_.lights && !is_lit_otherwise && !(parts_.lobes && whole_properties.is_smooth)) {
      const ShadingPoint point = {
          surface, whole,          frame, wo, parts_.media ? &media_ : nullptr,
          medium,  share_of_first, sides};
      path.direct += weight * LightSampledRadiance(intersector_, lights_, point, u, path.rays);
    }

    // From here on the surface has the chosen part alone.
    std::optional<Material> part;
    float share = 1;
    if (has_parts) {
      const bool is_first = u[0] < share_of_first;
      share = is_first ? share_of_first : 1 - share_of_first;
      if (!(share > 0)) return finish();
      changed =
          PropertiesOf(PartOf(whole, is_first ? Parts::kFirst : Parts::kSecond, part.emplace()));
      weight *= 1 / share;
    }
    const Material& material = part ? *part : whole;
    const MaterialProperties& properties = part ? changed : whole_properties;
    if (!(parts_.lobes && properties.is_smooth)) was_collected = false;

    if (properties.scatters_below) {
      EndBelow({surface, material, frame, wo, parts_.media ? &media_ : nullptr, medium, -1, sides},
               weight, length, sampler.ForBelow(vertex), u, !is_lit_otherwise, path);
      return finish();
    }

    BsdfSample sample;
    bool scattered = [&] {
      if (parts_.lobes) {
        return SampleBsdf(material, wo_local, u[0], u[1], u[2], Carried::kRadiance, sample);
      }
      return SampleDiffuse(material, wo_local, u[1], u[2], sample);
    }();
    Vec3 wi;
    std::int32_t medium_after = medium;
    const bool was_behind = sides.is_behind();
    if (scattered) {
      wi = frame.ToWorld(sample.wi);
      if (parts_.shading_normals) {
        scattered = sides.Scatter(surface, whole, wo, wi, sample.wi.z * Dot(frame.n, wo) < 0);
      }
      if (parts_.media) medium_after = media_.After(surface, wo, wi, medium);
    }

    const auto hitpoint_here = [&](bool is_glossy) {
      return HitpointAt(surface, material, wo, weight, length, is_glossy);
    };
    if (properties.gathers) {
      if (parts_.lights && !is_lit_otherwise && scattered && rays_find_lights_) {
        path.direct +=
            ScatteredDirect(surface, LitPointOf(surface, whole, wo), wi, share * sample.pdf,
                            medium_after, weight * sample.weight, path.rays);
      }
      const bool is_glossy = parts_.lobes && !properties.is_separable;
      path.hitpoint = hitpoint_here(is_glossy);
      if (!is_glossy) path.hitpoint.weight *= EyeFactor(material, wo_local);
      // Light comes from the other side.
      if (!is_glossy && properties.transmits) path.hitpoint.normal = -path.hitpoint.normal;
      return finish();
    }
    if (parts_.caustics) {
      if (properties.is_smooth) {
        receiver.was_left_smoothly = receiver.is_last;
      } else if (properties.is_thin || was_behind) {
        receiver = {};
      } else {
        receiver = {sample.pdf, sample.wi.z, true, false};
        // One of them is drawn in proportion to what it weighs, and stands for all.
        const float strength = MaxChannel(weight);
        path.caustic_strength += strength;
        if (caustic_rng.Uniform() * path.caustic_strength < strength) {
          path.caustic = hitpoint_here(true);
          path.caustic.weight *= 1 / strength;
        }
      }
    }

    if (!scattered) return finish();
    weight *= sample.weight;
    scatter_pdf = sample.is_delta || is_lit_otherwise ? 0 : share * sample.pdf;
    if (scatter_pdf > 0) scatter_point = LitPointOf(surface, whole, wo);
    const float strength = MaxChannel(weight);
    if (!(strength > 0)) return finish();
    if (vertex > 3 && strength < kRouletteWeight) {
      if (!(u[6] < strength)) return finish();
      weight *= 1 / strength;
    }
    ray = {LeavingPoint(surface, wi), wi, HUGE_VALF};
    medium = medium_after;
    left_normal = surface.geometric_normal;
  }
}

EyePathTracer::WalkParts EyePathTracer::WalkPartsFor(const SceneNeeds& needs) {
  const bool caustics = needs.Uses(Part::kCausticHitpoints);
  return {.textures = needs.Uses(Part::kTextures),
          .shading_normals = needs.Uses(Part::kShadingNormals),
          .lobes = needs.Uses(Part::kSpecular) || needs.Uses(Part::kGlossy) || caustics,
          .lights = needs.Uses(Part::kDirectSampling),
          .caustics = caustics,
          .media = needs.Uses(Part::kMedia),
          .dispersion = needs.Uses(Part::kDispersion)};
}

}  // namespace lucerna
