#include "client/bake/mesh_render.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "client/bake/baked_light.h"
#include "render/analysis/needs.h"
#include "render/analysis/prepared_scene.h"
#include "render/base/parallel.h"
#include "render/film/film.h"
#include "render/film/image_color.h"
#include "render/film/layers.h"
#include "render/math/color_space.h"
#include "render/math/double3.h"
#include "render/scene/setting_table.h"
#include "render/tracing/eye_path.h"
#include "render/tracing/film_spread.h"
#include "render/transport/bsdf.h"

namespace lucerna {
namespace {

constexpr std::size_t kGrain = 256;  // pixels

// Sums over passes, of one pixel.
struct PixelSums {
  std::array<double, 3> direct{}, of_mesh{};
  std::array<double, 3> albedo{}, normal{};
  double distance = 0;
  std::int64_t hits = 0;
};

void Add(Rgb value, std::array<double, 3>& sums) {
  for (int c = 0; c < 3; ++c)
    sums[static_cast<std::size_t>(c)] += static_cast<double>(value[c]);
}

// From irradiance to radiance, but for the path's weight where the hitpoint's weight has no BSDF.
Rgb RadianceFactor(const Scene& scene, const EyeHitpoint& hitpoint) {
  if (!hitpoint.is_glossy) return hitpoint.weight;
  // Broad lobes count as if they were diffuse.
  const Material& whole = scene.materials[hitpoint.material];
  Rgb albedo;
  if (whole.DependsOnPlace()) {
    Material at_place = whole;
    SetTexturedParameter(at_place, hitpoint.place.color);
    albedo = AlbedoOf(at_place);
  } else {
    albedo = AlbedoOf(whole);
  }
  return hitpoint.weight * albedo * std::numbers::inv_pi_v<float>;
}

}  // namespace

StatusOr<MeshRender> RenderFromMesh(const Scene& scene, const RenderSettings& settings,
                                    const BakedMesh& mesh, int threads) {
  const SceneNeeds needs = NeedsOf(scene, settings);
  PreparedScene prepared(scene, threads);
  LUCERNA_RETURN_IF_ERROR(prepared.PrepareFor(needs));
  const EyePathTracer tracer(prepared.scene(), settings, prepared.needs(), prepared.intersector(),
                             prepared.lights(), threads,
                             mesh.is_indirect ? EyePathTracer::DirectLight::kEverywhere
                                              : EyePathTracer::DirectLight::kWherePathsGoOn);
  FilmSpread spread(tracer);
  const BakedLight light(mesh);
  ThreadTeam team(threads);
  const int width = settings.crop_width();
  const int height = settings.crop_height();
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::vector<PixelSums> sums(pixels);
  std::vector<Rgb> direct(pixels);
  std::vector<Rgb> bright(spread.is_needed() ? pixels : 0);
  std::atomic<std::int64_t> ends = 0;
  std::atomic<std::int64_t> unknown = 0;
  const double unit = prepared.scene().unit;
  for (std::int64_t pass = 0; pass < settings.passes; ++pass) {
    team.For(pixels, kGrain, [&](std::size_t begin, std::size_t end) {
      std::int64_t ends_here = 0;
      std::int64_t unknown_here = 0;
      for (std::size_t pixel = begin; pixel < end; ++pixel) {
        const int x = static_cast<int>(pixel % static_cast<std::size_t>(width));
        const int y = static_cast<int>(pixel / static_cast<std::size_t>(width));
        const EyePath path = tracer.Trace(x, y, static_cast<std::uint64_t>(pass), {});
        direct[pixel] = path.direct;
        if (!bright.empty()) bright[pixel] = path.bright;
        PixelSums& to = sums[pixel];
        if (path.features.distance < HUGE_VALF) {
          Add(path.features.albedo, to.albedo);
          const Vec3 n = path.features.normal;
          Add({n.x, n.y, n.z}, to.normal);
          to.distance += static_cast<double>(path.features.distance);
          ++to.hits;
        }
        const EyeHitpoint& hitpoint = path.hitpoint;
        if (IsBlack(hitpoint.weight)) continue;
        ++ends_here;
        const std::optional<Rgb> irradiance =
            light.At(prepared.scene().materials[hitpoint.material].name,
                     ToFloat(Double3(hitpoint.position) * unit), hitpoint.normal);
        if (!irradiance) {
          ++unknown_here;
          continue;
        }
        Add(RadianceFactor(prepared.scene(), hitpoint) * ToWorking(*irradiance), to.of_mesh);
      }
      ends += ends_here;
      unknown += unknown_here;
    });
    spread.Add(static_cast<std::uint64_t>(pass), bright, direct, team);
    for (std::size_t pixel = 0; pixel < pixels; ++pixel)
      Add(direct[pixel], sums[pixel].direct);
  }

  MeshRender render;
  render.share_unknown =
      ends > 0 ? static_cast<double>(unknown) / static_cast<double>(ends.load()) : 0;
  Image& image = render.image;
  image.width = width;
  image.height = height;
  SetImageWindow(settings, image);
  const double to_pixel = scene.film.exposure / static_cast<double>(settings.passes);
  const ImageColor color(scene.film.white_balance);
  const auto values_of = [&](std::size_t pixel) {
    const PixelSums& of = sums[pixel];
    PixelValues values;
    values.direct = color(of.direct);
    values.photons = color(of.of_mesh);
    values.albedo = ToRec709(of.albedo);
    const double per_hit = of.hits > 0 ? 1 / static_cast<double>(of.hits) : 0;
    double largest = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      values.direct[c] *= to_pixel;
      values.photons[c] *= to_pixel;
      values.albedo[c] *= per_hit;
      values.normal[c] = of.normal[c] * per_hit;
      largest = std::max(largest, values.direct[c] + values.photons[c]);
    }
    if (largest > scene.film.max_component) values.limit = scene.film.max_component / largest;
    values.distance = of.hits > 0 ? of.distance * per_hit : HUGE_VAL;
    return values;
  };
  AddLayers(LayerSource::kEveryImage, values_of, pixels, team, image.channels);
  ToFileUnit(image.channels, scene.unit);
  image.metadata["lucerna.settings"] = SettingsText(settings);
  image.metadata["lucerna.seed"] = std::to_string(settings.seed);
  image.metadata["lucerna.passes"] = std::to_string(settings.passes);
  image.metadata["lucerna.mesh_of"] = mesh.scene;
  return render;
}

}  // namespace lucerna
