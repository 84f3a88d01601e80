#include "server/job_estimator.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "render/base/parallel.h"
#include "render/estimate/noise_layer.h"
#include "render/estimate/relative_error.h"
#include "render/estimate/statistics.h"
#include "render/film/film.h"
#include "render/math/color_space.h"
#include "render/transport/working_space.h"
#include "server/eye_path.h"

namespace lucerna {
namespace {

// Layers that are lengths, or one over a length, as the scene's file measures them.
void ToFileUnit(Image& image, double unit) {
  if (unit == 1) return;
  for (ImageChannel& channel : image.channels) {
    const bool is_length =
        channel.name == "Z" || channel.name == "radius" || channel.name == "min_radius";
    if (!is_length && channel.name != "bandwidth") continue;
    const double factor = is_length ? unit : 1 / unit;
    for (float& value : channel.pixels)
      value = static_cast<float>(static_cast<double>(value) * factor);
  }
}

Status CheckPower(Rgb power_w) {
  if (IsFinite(power_w) && std::isfinite(Luminance(power_w))) return absl::OkStatus();
  return absl::InvalidArgumentError(
      "the lights of the scene emit more power than a number holds (3e38 W); make all of them "
      "dimmer by the same factor, and the image brighter by it with the film's iso");
}

}  // namespace

struct JobEstimator::State {
  State(Scene s, RenderSettings r, SceneNeeds n, int threads)
      : scene(InWorkingSpace(std::move(s))),
        settings(r),
        needs(std::move(n)),
        team(threads),
        first_hits(needs.eye_sample_sets(), static_cast<std::size_t>(r.crop_width()) *
                                                static_cast<std::size_t>(r.crop_height())) {}

  Scene scene;
  RenderSettings settings;
  SceneNeeds needs;
  ThreadTeam team;
  FirstHits first_hits;
  std::unique_ptr<Intersector> intersector;
  std::unique_ptr<LightSet> lights;
  std::unique_ptr<EyePathTracer> tracer;
  std::unique_ptr<RadiusController> controller;
  FluxScale scale;
  std::unique_ptr<PixelStatistics> statistics;
  std::unique_ptr<Film> film;
  std::unique_ptr<ErrorStatistics> errors;
  std::uint64_t eye_rays = 0;

  // Radiance over all passes, Rec. 709.
  [[nodiscard]] RgbSum Sum(std::size_t pixel) const {
    RgbSum sum = film->direct_sum()[pixel];
    for (std::size_t c = 0; c < 3; ++c)
      sum[c] += statistics->radiance_sum()[pixel][c];
    return ToRec709(sum);
  }
};

JobEstimator::JobEstimator(std::unique_ptr<State> state) : state_(std::move(state)) {}
JobEstimator::~JobEstimator() = default;

StatusOr<std::unique_ptr<JobEstimator>> JobEstimator::Create(Scene scene, RenderSettings settings,
                                                             SceneNeeds needs, int threads) {
  auto state = std::make_unique<State>(std::move(scene), settings, std::move(needs), threads);
  LUCERNA_ASSIGN_OR_RETURN(state->intersector,
                           Intersector::Create(state->scene, state->needs.rays()));
  state->lights = std::make_unique<LightSet>(state->scene, *state->intersector, state->needs);
  LUCERNA_RETURN_IF_ERROR(CheckPower(state->lights->TotalPower()));
  state->tracer = std::make_unique<EyePathTracer>(state->scene, state->settings, state->needs,
                                                  *state->intersector, *state->lights);
  state->scale = FluxScale::ForPower(state->lights->TotalPower());
  const int width = settings.crop_width();
  const int height = settings.crop_height();
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const auto initial =
      static_cast<float>(settings.initial_radius > 0 ? settings.initial_radius / state->scene.unit
                                                     : settings.initial_footprints);
  state->controller = MakeRadiusController(state->settings, initial);
  state->statistics =
      std::make_unique<PixelStatistics>(pixels, initial, state->controller->MemoryPerPixel());
  state->film = std::make_unique<Film>(width, height, state->scene.film.exposure,
                                       state->scene.film.max_component);
  state->errors = std::make_unique<ErrorStatistics>(pixels);
  return std::unique_ptr<JobEstimator>(new JobEstimator(std::move(state)));
}

EyePass JobEstimator::TraceEyePaths(std::uint64_t pass) const {
  return TraceHitpointPass(*state_->tracer, pass, state_->first_hits.Of(pass), state_->team);
}

RadiusColumn JobEstimator::Radii(const EyePass& pass) const {
  return state_->statistics->Radii(pass.rows(), pass.pass);
}

void JobEstimator::Apply(const EyePass& pass, const RadiusColumn& radii, const PassSums& sums) {
  LUCERNA_CHECK(static_cast<std::int64_t>(pass.pass) == passes_applied());
  std::vector<RgbSum> photons(pass.direct.size());
  std::vector<double> bias(photons.size());
  state_->statistics->AddPhotons(pass.rows(), radii, sums, state_->scale,
                                 Kernel{state_->settings.kernel}, state_->settings.photons_per_pass,
                                 *state_->controller, photons, bias);
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
}

const SceneNeeds& JobEstimator::needs() const {
  return state_->needs;
}

std::size_t JobEstimator::faint_lights() const {
  return state_->lights->faint_lights();
}

std::int64_t JobEstimator::passes_applied() const {
  return state_->statistics->passes();
}

std::uint64_t JobEstimator::eye_rays() const {
  return state_->eye_rays;
}

Image JobEstimator::MakeImage() const {
  Image image = state_->film->MakeImage(*state_->statistics, *state_->controller,
                                        Kernel{state_->settings.kernel});
  ToFileUnit(image, state_->scene.unit);
  if (passes_applied() < 2) return image;
  const ErrorStatistics& errors = *state_->errors;
  const auto passes = static_cast<double>(passes_applied());
  const double exposure = state_->scene.film.exposure;
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
  image.channels.push_back({"noise", NoiseOfPixels(image.width, image.height, noise_area, noise)});
  image.channels.push_back({"bias", std::move(bias)});
  return image;
}

ErrorEstimate JobEstimator::EstimateError(int look) const {
  const ErrorStatistics& errors = *state_->errors;
  const double exposure = state_->scene.film.exposure;
  const auto sums_at = [&](std::size_t pixel) {
    PixelSums sums;
    const RgbSum all = state_->Sum(pixel);
    // Bias is known as a luminance: it has the colour that the photons have.
    RgbSum photons = state_->statistics->radiance_sum()[pixel];
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
  if (lucerna::IsBlack(state_->lights->TotalPower())) estimate.relative = {}, estimate.untrimmed = 0;
  return estimate;
}

TrueError JobEstimator::ErrorAgainst(const ReferenceImage& reference) const {
  const double to_pixel = state_->scene.film.exposure / static_cast<double>(passes_applied());
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
  const auto kept =
      pixels.size() - static_cast<std::size_t>(kTrimmedShare * static_cast<double>(pixels.size()));
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
