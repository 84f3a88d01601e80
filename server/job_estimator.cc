#include "server/job_estimator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/str_format.h"

#include "render/analysis/prepared_scene.h"
#include "render/base/parallel.h"
#include "render/base/text.h"
#include "render/estimate/missing_light.h"
#include "render/estimate/noise_layer.h"
#include "render/estimate/relative_error.h"
#include "render/estimate/statistics.h"
#include "render/film/film.h"
#include "render/film/layers.h"
#include "render/math/color_space.h"
#include "render/scene/shape_lists.h"
#include "render/tracing/eye_path.h"

namespace lucerna {
namespace {

constexpr double kPi64 = std::numbers::pi;

// Whether a path may be bent by a smooth surface.
bool HasSmoothSurfaces(const Scene& scene) {
  bool is_any_smooth = false;
  ForEachShapeTraits(scene, [&](const ShapeTraits& traits) {
    is_any_smooth |= IsSmooth(scene.materials[static_cast<std::size_t>(traits.material)]);
  });
  return is_any_smooth;
}

// "light 2 (a point light at (0, 1, 2))", in the units of the scene's file.
std::string NameOf(const LightGroup& light, std::size_t number, double unit) {
  if (light.lights > 1) return Concat("the faintest ", light.lights, " lights together");
  const auto at = [&](double scale) {
    return absl::StrFormat("(%.4g, %.4g, %.4g)", static_cast<double>(light.position.x) * scale,
                           static_cast<double>(light.position.y) * scale,
                           static_cast<double>(light.position.z) * scale);
  };
  const auto described = [&]() -> std::string {
    switch (light.kind) {
      case EmitterKind::kTriangle:
        return Concat("an area light of ", light.emitters,
                      light.emitters == 1 ? " triangle" : " triangles", " around ", at(unit));
      case EmitterKind::kSphere:
        return Concat("an area light, a sphere around ", at(unit));
      case EmitterKind::kDisk:
        return Concat("an area light, a disk around ", at(unit));
      case EmitterKind::kInfinite:
        return "the constant environment light";
      case EmitterKind::kEnvironment:
        return "an environment map";
      default:
        return Concat("a ", NameOf(light.kind),
                      light.is_at_infinity ? " that shines towards " : " at ",
                      at(light.is_at_infinity ? 1 : unit));
    }
  };
  return Concat("light ", number, " (", described(), ")");
}

Status CheckPower(Rgb power_w) {
  if (IsFinite(power_w) && std::isfinite(Luminance(power_w))) return absl::OkStatus();
  return absl::InvalidArgumentError(
      "the lights of the scene emit more power than a number holds (3e38 W); make all of them "
      "dimmer by the same factor, and the image brighter by it with the film's iso");
}

}  // namespace

struct JobEstimator::State {
  State(Scene s, RenderSettings r, const SceneNeeds& needs, int threads)
      : prepared(std::move(s)),
        settings(r),
        team(threads),
        first_hits(needs.eye_sample_sets(), static_cast<std::size_t>(r.crop_width()) *
                                                static_cast<std::size_t>(r.crop_height())) {}

  PreparedScene prepared;
  RenderSettings settings;
  ThreadTeam team;
  FirstHits first_hits;
  std::unique_ptr<EyePathTracer> tracer;
  std::unique_ptr<RadiusController> controller;
  std::unique_ptr<PixelStatistics> statistics;
  // Of the hitpoints that gather caustic photons; nullptr where there are none.
  std::unique_ptr<PixelStatistics> caustics;
  // Theirs: a rule that asks for no evidence. Narrow lobes weigh photons so unevenly that a second
  // derivative is lost in noise, and radii that follow it fall until single photons are seen.
  std::unique_ptr<RadiusController> caustic_controller;
  std::unique_ptr<Film> film;
  std::unique_ptr<ErrorStatistics> errors;
  std::uint64_t eye_rays = 0;
  // For light that may not have been found.
  BatchTally tally;
  bool has_smooth_surfaces = false;
  Bounds view;              // of the hitpoints of the first pass
  float widest_radius = 0;  // of these hitpoints
  double hit_share = 0;     // of the pixels that have one

  // Radiance over all passes that photons brought, in the working space.
  [[nodiscard]] RgbSum PhotonSum(std::size_t pixel) const {
    RgbSum sum = statistics->radiance_sum()[pixel];
    if (caustics == nullptr) return sum;
    for (std::size_t c = 0; c < 3; ++c)
      sum[c] += caustics->radiance_sum()[pixel][c];
    return sum;
  }
  // Radiance over all passes, Rec. 709.
  [[nodiscard]] RgbSum Sum(std::size_t pixel) const {
    RgbSum sum = PhotonSum(pixel);
    for (std::size_t c = 0; c < 3; ++c)
      sum[c] += film->direct_sum()[pixel][c];
    return ToRec709(sum);
  }
};

JobEstimator::JobEstimator(std::unique_ptr<State> state) : state_(std::move(state)) {}
JobEstimator::~JobEstimator() = default;

StatusOr<std::unique_ptr<JobEstimator>> JobEstimator::Create(Scene scene, RenderSettings settings,
                                                             SceneNeeds needs, int threads) {
  auto state = std::make_unique<State>(std::move(scene), settings, needs, threads);
  const PreparedScene& prepared = state->prepared;
  LUCERNA_RETURN_IF_ERROR(state->prepared.PrepareFor(needs));
  LUCERNA_RETURN_IF_ERROR(CheckPower(prepared.lights().TotalPower()));
  state->tracer =
      std::make_unique<EyePathTracer>(prepared.scene(), state->settings, prepared.needs(),
                                      prepared.intersector(), prepared.lights());
  const int width = settings.crop_width();
  const int height = settings.crop_height();
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const auto initial = static_cast<float>(settings.initial_radius > 0
                                              ? settings.initial_radius / prepared.scene().unit
                                              : settings.initial_footprints);
  state->controller = MakeRadiusController(state->settings, initial);
  state->statistics =
      std::make_unique<PixelStatistics>(pixels, initial, state->controller->MemoryPerPixel());
  if (prepared.needs().Uses(Part::kCausticHitpoints)) {
    RenderSettings schedule = state->settings;
    schedule.radius_controller = RadiusControllerKind::kPppm;
    state->caustic_controller = MakeRadiusController(schedule, initial);
    state->caustics = std::make_unique<PixelStatistics>(
        pixels, initial, state->caustic_controller->MemoryPerPixel());
  }
  state->film = std::make_unique<Film>(width, height, prepared.scene().film.exposure,
                                       prepared.scene().film.max_component);
  state->errors = std::make_unique<ErrorStatistics>(pixels);
  state->has_smooth_surfaces = HasSmoothSurfaces(prepared.scene());
  return std::unique_ptr<JobEstimator>(new JobEstimator(std::move(state)));
}

EyePass JobEstimator::TraceEyePaths(std::uint64_t pass) const {
  return TraceHitpointPass(*state_->tracer, pass, state_->first_hits.Of(pass), state_->team);
}

RadiusColumn JobEstimator::Radii(const EyePass& pass) const {
  RadiusColumn radii = state_->statistics->Radii(pass.rows(), pass.pass);
  if (pass.block.caustic_rows > 0) {
    const RadiusColumn caustic = state_->caustics->Radii(pass.caustic_rows(), pass.pass);
    radii.insert(radii.end(), caustic.begin(), caustic.end());
  }
  return radii;
}

void JobEstimator::Apply(const EyePass& pass, const RadiusColumn& radii, const PassSums& sums) {
  LUCERNA_CHECK(static_cast<std::int64_t>(pass.pass) == passes_applied());
  std::vector<RgbSum> photons(pass.direct.size());
  std::vector<double> bias(photons.size());
  const auto add = [&](PixelStatistics& statistics, const RadiusController& controller,
                       const HitpointRows& rows) {
    statistics.AddPhotons(rows, radii, sums, state_->prepared.flux_scale(),
                          Kernel{state_->settings.kernel}, state_->settings.photons_per_pass,
                          controller, photons, bias);
  };
  add(*state_->statistics, *state_->controller, pass.rows());
  if (state_->caustics != nullptr) {
    add(*state_->caustics, *state_->caustic_controller, pass.caustic_rows());
  }
  std::vector<RgbSum> radiance(photons.size());
  for (std::size_t pixel = 0; pixel < radiance.size(); ++pixel) {
    photons[pixel] = ToRec709(photons[pixel]);
    const Rgb direct = pass.direct[pixel];
    radiance[pixel] = ToRec709({static_cast<double>(direct.r), static_cast<double>(direct.g),
                                static_cast<double>(direct.b)});
    for (std::size_t c = 0; c < 3; ++c)
      radiance[pixel][c] += photons[pixel][c];
  }
  state_->errors->AddPass(pass.pass, radiance, bias);
  for (std::size_t pixel = 0; pixel < pass.direct.size(); ++pixel) {
    const EyeFeatures& features = pass.features[pixel];
    state_->film->Add(pixel, pass.direct[pixel], features.albedo, features.normal,
                      features.distance);
  }
  state_->eye_rays += pass.rays;
  state_->tally += sums.tally();
  if (pass.pass > 0) return;
  for (std::size_t row = 0; row < pass.block.size(); ++row) {
    state_->view.Add(pass.block.positions[row]);
    state_->widest_radius = std::max(state_->widest_radius, radii[row]);
  }
  state_->hit_share =
      static_cast<double>(pass.block.size()) / static_cast<double>(pass.direct.size());
}

const SceneNeeds& JobEstimator::needs() const {
  return state_->prepared.needs();
}

std::size_t JobEstimator::faint_lights() const {
  return state_->prepared.lights().faint_lights();
}

std::int64_t JobEstimator::passes_applied() const {
  return state_->statistics->passes();
}

std::uint64_t JobEstimator::eye_rays() const {
  return state_->eye_rays;
}

Image JobEstimator::MakeImage() const {
  Image image = state_->film->MakeImage(*state_->statistics, state_->caustics.get(),
                                        *state_->controller, Kernel{state_->settings.kernel});
  ToFileUnit(image, state_->prepared.scene().unit);
  if (passes_applied() < 2) return image;
  const ErrorStatistics& errors = *state_->errors;
  const auto passes = static_cast<double>(passes_applied());
  const double exposure = state_->prepared.scene().film.exposure;
  const double even_passes = std::ceil(passes / 2);
  const double odd_passes = passes - even_passes;
  const double noise_area = EstimateError(1).noise_area;
  std::vector<PixelNoise> noise(image.channels[0].pixels.size());
  std::vector<float> bias(noise.size());
  for (std::size_t pixel = 0; pixel < noise.size(); ++pixel) {
    const double sum = exposure * LuminanceOf(state_->Sum(pixel));
    const double even_sum = exposure * LuminanceOf(errors.even_sum()[pixel]);
    const double mean = sum / passes;
    const double square = exposure * exposure * errors.square_sum()[pixel] / passes;
    bias[pixel] = static_cast<float>(
        exposure * (errors.even_bias()[pixel] + errors.odd_bias()[pixel]) / passes);
    // Less than this is rounding of a pixel that is the same in every pass.
    constexpr double kRounding = 1e-12;
    if (!(square - mean * mean > kRounding * square)) continue;
    const double difference = even_sum / even_passes - (sum - even_sum) / odd_passes;
    const double largest = exposure * static_cast<double>(errors.largest()[pixel]) - mean;
    noise[pixel] = {
        .of_halves = difference * difference * even_passes * odd_passes / (passes * passes),
        .of_passes = (square - mean * mean) / (passes - 1),
        .largest_share = std::min(1.0, largest * largest / (passes * (square - mean * mean)))};
  }
  const std::vector<float> noise_layer =
      NoiseOfPixels(image.width, image.height, noise_area, noise);
  const auto errors_of = [&](std::size_t pixel) {
    PixelValues values;
    values.noise = static_cast<double>(noise_layer[pixel]);
    values.bias = static_cast<double>(bias[pixel]);
    return values;
  };
  AddLayers(LayerSource::kPasses, errors_of, image);
  return image;
}

ErrorEstimate JobEstimator::EstimateError(int look) const {
  const ErrorStatistics& errors = *state_->errors;
  const double exposure = state_->prepared.scene().film.exposure;
  const auto sums_at = [&](std::size_t pixel) {
    PixelSums sums;
    const RgbSum all = state_->Sum(pixel);
    // Bias is known as a luminance: it has the colour that the photons have.
    RgbSum photons = state_->PhotonSum(pixel);
    const double luminance = LuminanceOf(photons);
    photons = ToRec709(photons);
    for (std::size_t c = 0; c < 3; ++c) {
      sums.all[c] = exposure * all[c];
      sums.even[c] = exposure * errors.even_sum()[pixel][c];
      sums.bias_color[c] = luminance > 0 ? photons[c] / luminance : 0;
    }
    sums.even_bias = exposure * errors.even_bias()[pixel];
    sums.odd_bias = exposure * errors.odd_bias()[pixel];
    sums.square = exposure * exposure * errors.square_sum()[pixel];
    return sums;
  };
  ErrorEstimate estimate =
      lucerna::EstimateError(state_->settings.crop_width(), state_->settings.crop_height(),
                             passes_applied(), look, sums_at);
  // Without any light a black image is exact.
  if (lucerna::IsBlack(state_->prepared.lights().TotalPower())) {
    estimate.relative = {};
    estimate.untrimmed = 0;
  }
  const MissingLight missing = FindMissingLight();
  estimate.relative.high += missing.relative;
  estimate.absolute.high += missing.absolute;
  return estimate;
}

bool JobEstimator::IsBlack() const {
  const std::size_t pixels = state_->film->direct_sum().size();
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    if (LuminanceOf(state_->Sum(pixel)) > 0) return false;
  }
  return true;
}

MissingLight JobEstimator::FindMissingLight() const {
  const State& state = *state_;
  const auto passes = static_cast<double>(passes_applied());
  const std::size_t pixels = state.film->direct_sum().size();
  const auto pixel_count = static_cast<double>(pixels);
  std::vector<double> luminances(pixels);
  double sum = 0;
  double photon_sum = 0;
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    luminances[pixel] = std::max(0.0, LuminanceOf(state.Sum(pixel)) / passes);
    sum += luminances[pixel];
    photon_sum += LuminanceOf(ToRec709(state.PhotonSum(pixel))) / passes;
  }
  PhotonView view;
  view.takes_photons = state.prepared.needs().Uses(Part::kPhotons) &&
                       state.settings.max_depth > 1 && state.hit_share > 0;
  view.has_caustics = state.has_smooth_surfaces;
  view.photon_radiance = photon_sum / pixel_count;
  // What relative errors are relative to, as their mean over pixels has it: dark pixels weigh most,
  // down to a tenth of the mean.
  const double mean = sum / pixel_count;
  if (mean > 0) {
    double inverse = 0;
    for (const double luminance : luminances) {
      const double of_mean = luminance / mean;
      inverse += 1 / (of_mean * of_mean + 0.01);
    }
    view.brightness = mean / std::sqrt(inverse / pixel_count);
  }
  // The visible surfaces are at least about as large as the larger side of their box, and no
  // smaller than what a hitpoint gathers from; white ones scatter 1/pi of what falls on them per
  // steradian.
  const Vec3 box = state.hit_share > 0 ? state.view.high - state.view.low : Vec3{};
  std::array<double, 3> sides = {static_cast<double>(box.x), static_cast<double>(box.y),
                                 static_cast<double>(box.z)};
  std::ranges::sort(sides);
  const auto radius = static_cast<double>(state.widest_radius);
  const double area = std::max(sides[1] * sides[2], kPi64 * radius * radius);
  view.radiance_per_watt = area > 0 ? state.hit_share / (kPi64 * area) : 0;

  MissingLight missing;
  std::vector<LightPhotons> lights;
  const auto total_power = static_cast<double>(Luminance(state.prepared.lights().TotalPower()));
  const std::vector<LightTally>& tallies = state.tally.lights;
  for (std::size_t i = 0; i < state.prepared.lights().lights().size(); ++i) {
    const LightGroup& light = state.prepared.lights().lights()[i];
    lights.push_back({.power_w = static_cast<double>(Luminance(light.power)),
                      .tally = i < tallies.size() ? tallies[i] : LightTally()});
    missing.lights.push_back({.name = NameOf(light, i + 1, state.prepared.scene().unit),
                              .power_share = lights[i].power_w / total_power,
                              .photons = lights[i].tally});
  }
  const std::vector<double> shares = MissingShares(lights, view);
  for (std::size_t i = 0; i < shares.size(); ++i) {
    missing.lights[i].missing_share = shares[i];
    missing.share += shares[i];
  }
  missing.nothing_found = !state.prepared.lights().empty() && !(sum > 0);
  if (missing.nothing_found) {
    missing.relative = HUGE_VAL;
    missing.absolute = HUGE_VAL;
  } else if (missing.share > 0) {
    missing.relative = LargestRelativeError(missing.share);
    const double brightness = state.prepared.scene().film.exposure * view.brightness;
    missing.absolute = brightness * brightness * LargestAbsoluteError(missing.share);
  }
  return missing;
}

TrueError JobEstimator::ErrorAgainst(const ReferenceImage& reference) const {
  const double to_pixel =
      state_->prepared.scene().film.exposure / static_cast<double>(passes_applied());
  std::vector<double> luminances(reference.size());
  for (std::size_t pixel = 0; pixel < reference.size(); ++pixel) {
    const Rgb right = reference[pixel];
    luminances[pixel] = LuminanceOf(
        {static_cast<double>(right.r), static_cast<double>(right.g), static_cast<double>(right.b)});
  }
  const double floor = RelativeErrorFloor(luminances);
  std::vector<TrueError> pixels(reference.size());
  for (std::size_t pixel = 0; pixel < reference.size(); ++pixel) {
    const RgbSum sum = state_->Sum(pixel);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto right = static_cast<double>(reference[pixel][static_cast<int>(c)]);
      const double off = sum[c] * to_pixel - right;
      pixels[pixel].absolute += off * off;
      pixels[pixel].relative += RelativeSquare(off * off, right, floor);
    }
  }
  double untrimmed = 0;
  for (const TrueError& pixel : pixels)
    untrimmed += pixel.relative;
  const std::size_t kept = KeptPixels(pixels.size());
  std::ranges::nth_element(pixels, pixels.begin() + static_cast<std::ptrdiff_t>(kept) - 1, {},
                           &TrueError::relative);
  pixels.resize(kept);
  TrueError error = {.untrimmed = untrimmed / (3 * static_cast<double>(reference.size()))};
  for (const TrueError& pixel : pixels) {
    error.absolute += pixel.absolute;
    error.relative += pixel.relative;
  }
  const double terms = 3 * static_cast<double>(kept);
  error.relative /= terms;
  error.absolute /= terms;
  return error;
}

}  // namespace lucerna
