#include "tests/support/light_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "render/analysis/needs.h"
#include "render/analysis/prepared_scene.h"
#include "render/base/parallel.h"
#include "render/math/color_space.h"
#include "render/transport/material_at.h"
#include "tests/support/local_render.h"
#include "worker/photon_path.h"

namespace lucerna {
namespace {

// A surface that the camera sees is the one on which a photon landed when it is not farther from it
// than this share of its distance.
constexpr float kSamePlace = 1e-4F;
// A pixel shows diffuse surfaces alone when so many points along each side do, corners among them.
constexpr int kPointsAlongSide = 5;
constexpr std::size_t kPhotonsAtOnce = 8192;

using RgbSums = std::vector<std::array<double, 3>>;  // [pixels]

class LightTracer {
 public:
  LightTracer(const PreparedScene& prepared, const RenderSettings& settings)
      : prepared_(prepared),
        settings_(settings),
        camera_to_world_(prepared.scene().camera.camera_to_world),
        world_to_camera_(camera_to_world_.Inverse().value()),
        window_(ScreenWindow(prepared.scene().camera, settings.width, settings.height)),
        eye_(camera_to_world_.Point({})),
        ahead_(Normalize(camera_to_world_.Vector({0, 0, 1}))) {}

  // Adds what the photons of a pass bring to `pixels`, which is radiance in the working space.
  void AddPass(std::uint64_t pass, const RoundPlan& plan, ThreadTeam& team, RgbSums& pixels) const {
    const auto photons = static_cast<std::size_t>(plan.photons_per_pass);
    const PhotonPathTracer tracer(prepared_.scene(), prepared_.intersector(), prepared_.lights(),
                                  settings_, prepared_.needs(), /*spectra=*/nullptr, kEverywhere,
                                  plan.photons_per_pass, /*media_region=*/{}, plan.guide.get());
    const std::size_t pieces = (photons + kPhotonsAtOnce - 1) / kPhotonsAtOnce;
    std::vector<std::vector<Splat>> splats(pieces);
    team.For(pieces, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t piece = begin; piece < end; ++piece) {
        PhotonPathTracer::Landed landed;
        for (std::size_t i = piece * kPhotonsAtOnce;
             i < std::min(photons, (piece + 1) * kPhotonsAtOnce); ++i) {
          tracer.Trace(pass, i, landed);
        }
        const Deposits& deposits = landed.deposits;
        for (std::size_t i = 0; i < deposits.size(); ++i) {
          const Vec3* const normal = deposits.normals.empty() ? nullptr : &deposits.normals[i];
          if (const auto splat = SplatOf(deposits.rows[i], normal)) splats[piece].push_back(*splat);
        }
      }
    });
    // In their order: the same bits with any number of threads.
    const double share = 1 / static_cast<double>(photons);
    for (const std::vector<Splat>& of_piece : splats) {
      for (const Splat& splat : of_piece) {
        for (int c = 0; c < 3; ++c) {
          pixels[splat.pixel][static_cast<std::size_t>(c)] +=
              share * static_cast<double>(splat.radiance[c]);
        }
      }
    }
  }

  // Whether all that is seen through the pixel are diffuse surfaces that gather photons.
  [[nodiscard]] bool ShowsDiffuseSurfacesAlone(int x, int y) const {
    for (int j = 0; j < kPointsAlongSide; ++j) {
      for (int i = 0; i < kPointsAlongSide; ++i) {
        const auto along = [](int k) { return k / (kPointsAlongSide - 1.0); };
        if (!SeenAt(x + along(i), y + along(j))) return false;
      }
    }
    return true;
  }

 private:
  struct Splat {
    std::size_t pixel = 0;
    Rgb radiance;
  };
  struct Seen {
    SurfacePoint surface;
    Rgb albedo;
  };
  static constexpr Bounds kEverywhere = {{-HUGE_VALF, -HUGE_VALF, -HUGE_VALF},
                                         {HUGE_VALF, HUGE_VALF, HUGE_VALF}};

  // The diffuse surface that is seen into a direction [unit]; absent where there is none.
  [[nodiscard]] std::optional<Seen> SeenAlong(Vec3 direction) const {
    const Ray ray = {eye_, direction};
    Hit hit;
    if (!prepared_.intersector().Intersect(ray, hit)) return std::nullopt;
    Seen seen;
    seen.surface = prepared_.intersector().SurfaceAt(ray, hit);
    std::optional<Material> storage;
    const Material& material = MaterialAt(prepared_.scene(), seen.surface, -direction, storage);
    if (material.kind != Material::Kind::kDiffuse) return std::nullopt;
    if (seen.surface.area_light != kNoAreaLight) return std::nullopt;
    seen.albedo = material.reflectance;
    return seen;
  }
  // The same at a place of the image [pixels, from the upper left].
  [[nodiscard]] std::optional<Seen> SeenAt(double x, double y) const {
    const Vec3 through = {static_cast<float>(window_.low_x + x * StepX()),
                          static_cast<float>(window_.high_y - y * StepY()), 1};
    return SeenAlong(Normalize(camera_to_world_.Vector(through)));
  }
  // What a photon adds to the mean radiance of the pixel in which it is seen, if all photons of a
  // pass were like it. A pixel's area on the plane one length ahead of the eye is seen from the eye
  // as a solid angle cos³ times as large.
  [[nodiscard]] std::optional<Splat> SplatOf(const Deposit& deposit, const Vec3* normal) const {
    const Vec3 in_camera = world_to_camera_.Point(deposit.position);
    if (!(in_camera.z > 0)) return std::nullopt;
    const auto z = static_cast<double>(in_camera.z);
    const double x = (static_cast<double>(in_camera.x) / z - window_.low_x) / StepX();
    const double y = (window_.high_y - static_cast<double>(in_camera.y) / z) / StepY();
    if (!(x >= 0 && x < settings_.width && y >= 0 && y < settings_.height)) return std::nullopt;
    const Vec3 to_photon = deposit.position - eye_;
    const float distance = Length(to_photon);
    const Vec3 direction = to_photon / distance;
    if (normal != nullptr && !(Dot(*normal, direction) < 0)) return std::nullopt;
    const std::optional<Seen> seen = SeenAlong(direction);
    if (!seen) return std::nullopt;
    if (Length(seen->surface.position - deposit.position) > kSamePlace * distance)
      return std::nullopt;
    const double cosine =
        std::abs(static_cast<double>(Dot(seen->surface.geometric_normal, direction)));
    const double from_axis = static_cast<double>(Dot(ahead_, direction));
    const double d2 = static_cast<double>(distance) * static_cast<double>(distance);
    const double per_area =
        cosine / (d2 * from_axis * from_axis * from_axis * StepX() * StepY() * std::numbers::pi);
    return Splat{static_cast<std::size_t>(y) * static_cast<std::size_t>(settings_.width) +
                     static_cast<std::size_t>(x),
                 seen->albedo * deposit.flux * static_cast<float>(per_area)};
  }
  [[nodiscard]] double StepX() const { return (window_.high_x - window_.low_x) / settings_.width; }
  [[nodiscard]] double StepY() const { return (window_.high_y - window_.low_y) / settings_.height; }

  const PreparedScene& prepared_;
  const RenderSettings& settings_;
  Transform camera_to_world_, world_to_camera_;
  Window window_;
  Vec3 eye_, ahead_;
};

}  // namespace

LightTracedImage TraceLight(const Scene& scene, const RenderSettings& settings, int passes,
                            int threads) {
  const bool has_pinhole =
      scene.camera.kind == Camera::Kind::kPerspective && !(scene.camera.lens_radius > 0);
  const PixelFilter& filter = scene.filter;
  const bool has_box =
      filter.kind == PixelFilter::Kind::kBox && filter.radius_x == 0.5F && filter.radius_y == 0.5F;
  const bool is_whole =
      settings.crop_width() == settings.width && settings.crop_height() == settings.height;
  const SceneNeeds needs = NeedsOf(scene, settings);
  LUCERNA_CHECK(has_pinhole && has_box && is_whole && scene.media.empty() &&
                !scene.motion.Moves() && !needs.Uses(Part::kSpectra));
  LUCERNA_CHECK(static_cast<std::uint64_t>(passes) > kFirstLongRound);
  ThreadTeam team(threads);
  LocalRender render(scene, settings, threads);
  PreparedScene prepared(scene);
  LUCERNA_CHECK(prepared.PrepareFor(needs).ok());
  const LightTracer tracer(prepared, settings);
  const std::size_t pixels =
      static_cast<std::size_t>(settings.width) * static_cast<std::size_t>(settings.height);
  RgbSums traced(pixels);
  double traced_passes = 0;
  std::optional<RoundPlan> plan;
  for (std::uint64_t pass = 0; pass < static_cast<std::uint64_t>(passes); ++pass) {
    if (pass == RoundOf(pass).first) plan = render.estimator().PlanFor(RoundOf(pass));
    // The first guides send few photons to what is seen.
    if (pass >= kFirstLongRound) {
      tracer.AddPass(pass, *plan, team, traced);
      ++traced_passes;
    }
    render.AddPass(/*batches=*/0);
  }
  const Image image = render.MakeImage();
  const double scale = prepared.scene().film.exposure / traced_passes;
  LightTracedImage traced_image;
  traced_image.image.width = image.width;
  traced_image.image.height = image.height;
  for (const char* channel : {"R", "G", "B"})
    traced_image.image.channels.push_back(*image.Find(channel));
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    const auto width = static_cast<std::size_t>(settings.width);
    if (!tracer.ShowsDiffuseSurfacesAlone(static_cast<int>(pixel % width),
                                          static_cast<int>(pixel / width))) {
      continue;
    }
    ++traced_image.traced_pixels;
    const std::array<double, 3> photons = ToRec709(traced[pixel]);
    for (std::size_t c = 0; c < 3; ++c) {
      ImageChannel& channel = traced_image.image.channels[c];
      channel.pixels[pixel] = image.Find("direct." + channel.name)->pixels[pixel] +
                              static_cast<float>(scale * photons[c]);
    }
  }
  traced_image.photons = render.tally().photons;
  return traced_image;
}

}  // namespace lucerna
