#include "server/job_estimator.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "absl/strings/str_format.h"

#include "render/analysis/prepared_scene.h"
#include "render/base/parallel.h"
#include "render/base/text.h"
#include "render/estimate/evidence.h"
#include "render/estimate/missing_light.h"
#include "render/estimate/noise_layer.h"
#include "render/estimate/photon_steps.h"
#include "render/estimate/pixel_radii.h"
#include "render/estimate/relative_error.h"
#include "render/film/film.h"
#include "render/film/layers.h"
#include "render/math/color_space.h"
#include "render/scene/shape_lists.h"
#include "render/tracing/eye_path.h"
#include "server/state/sums_codec.h"

namespace lucerna {
namespace {

constexpr double kPi64 = std::numbers::pi;
// Photons of a pass over those of the first ones, at most.
constexpr std::uint64_t kMostPhotonFactor = 8;
// The variance is known well enough after so many passes; a power of two.
constexpr std::uint64_t kFirstPhotonChoice = 4;
// Between the best number and a half of it lies the one from which twice as many are better.
constexpr double kWorthDoubling = std::numbers::sqrt2;

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
  float initial_radius = 0;  // [unit radii]
  std::unique_ptr<EyePathTracer> tracer;
  std::unique_ptr<RadiusController> controller;
  std::unique_ptr<PixelRadii> radii;
  std::unique_ptr<ImageSums> sums;
  // What rounds follow from that are planned by the state after so many passes.
  struct After {
    std::shared_ptr<const RadiusColumn> radii;
    std::uint64_t photons_per_pass = 0;
  };
  std::map<std::uint64_t, After> after;
  std::shared_ptr<const RadiusColumn> last_radii;  // of the last round added
  // Of the last estimate, and after how many passes that was.
  double noise_area = 1;
  std::uint64_t noise_area_after = 0;
  // For light that may not have been found.
  bool has_smooth_surfaces = false;
  Bounds view;              // of the hitpoints of the first pass
  float widest_radius = 0;  // of these hitpoints
  double hit_share = 0;     // of the pixels that have one

  // How many photons later passes have, given how many they would have by what was known before.
  // Looks at the variance now and then, each time twice as many passes later.
  [[nodiscard]] std::uint64_t ChoosePhotons(std::uint64_t before) const {
    const std::uint64_t passes = sums->whole_passes();
    const auto base = static_cast<std::uint64_t>(settings.photons_per_pass);
    if (!settings.adaptive_photons || before >= kMostPhotonFactor * base ||
        passes < kFirstPhotonChoice || !std::has_single_bit(passes)) {
      return before;
    }
    const auto reach = static_cast<double>(ReachOf(EvidenceOf(settings.radius_controller)));
    const double kernel_noise = kPi64 * Kernel{settings.kernel}.Moments().roughness * reach * reach;
    const double per_pixel = static_cast<double>(before) / static_cast<double>(sums->pixels());
    const double factor = BestPhotonFactor(SplitVariance(*sums, kernel_noise), per_pixel);
    return factor >= kWorthDoubling ? 2 * before : before;
  }

  // Radiance over all passes, Rec. 709.
  [[nodiscard]] RgbSum Sum(std::size_t pixel) const { return ToRec709(sums->At(pixel).radiance()); }
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
  state->initial_radius = initial;
  state->controller = MakeRadiusController(state->settings, initial);
  state->radii = std::make_unique<PixelRadii>(pixels, initial, *state->controller);
  state->sums = std::make_unique<ImageSums>(pixels);
  state->last_radii = std::make_shared<const RadiusColumn>(state->radii->Current());
  state->after[0] = {.radii = state->last_radii,
                     .photons_per_pass = static_cast<std::uint64_t>(settings.photons_per_pass)};
  state->has_smooth_surfaces = HasSmoothSurfaces(prepared.scene());
  return std::unique_ptr<JobEstimator>(new JobEstimator(std::move(state)));
}

EyePass JobEstimator::TraceEyePaths(std::uint64_t pass) const {
  return TraceHitpointPass(*state_->tracer, pass, state_->first_hits.Of(pass), state_->team);
}

std::optional<RoundPlan> JobEstimator::PlanFor(const PassRange& round) const {
  const auto after = state_->after.find(RadiiFrom(round));
  if (after == state_->after.end() || round.first < whole_passes()) return std::nullopt;
  // Narrow lobes weigh photons so unevenly that a second derivative is lost in noise, and radii
  // that follow it fall until single photons are seen: the radii of caustic hitpoints follow a
  // schedule that asks for no evidence.
  return RoundPlan{.photons_per_pass = after->second.photons_per_pass,
                   .radii = after->second.radii,
                   .caustic_radius = static_cast<float>(
                       static_cast<double>(state_->initial_radius) *
                       ScheduledShrink(state_->settings.alpha, {0, round.first}))};
}

SliceShape JobEstimator::ShapeOf(const PassRange& round, const RoundPlan& plan) const {
  return {.passes = round,
          .pixels = state_->sums->pixels(),
          .evidence = ControllerColumns(state_->settings.radius_controller),
          .photons_per_pass = plan.photons_per_pass};
}

SliceSums JobEstimator::SliceOf(const EyePass& pass, const RoundPlan& plan,
                                const PassSums& sums) const {
  return SliceOfPass(pass, plan, sums, state_->settings, state_->prepared.flux_scale());
}

void JobEstimator::LookAtFirstPass(const EyePass& pass, const RoundPlan& plan) {
  const RadiusColumn radii = HitpointRadii(pass, plan);
  for (std::size_t row = 0; row < pass.block.size(); ++row) {
    state_->view.Add(pass.block.positions[row]);
    state_->widest_radius = std::max(state_->widest_radius, radii[row]);
  }
  state_->hit_share =
      static_cast<double>(pass.block.size()) / static_cast<double>(pass.direct.size());
}

void JobEstimator::AddRound(const SliceSums& round, const RoundPlan& plan) {
  LUCERNA_CHECK(round.passes == RoundOf(whole_passes()));
  State& state = *state_;
  state.sums->Add(round);
  state.radii->Step(round, *plan.radii, state.team);
  state.last_radii = plan.radii;
  const std::uint64_t passes = whole_passes();
  state.after[passes] = {
      .radii = std::make_shared<const RadiusColumn>(state.radii->Current()),
      .photons_per_pass = state.ChoosePhotons(state.after.rbegin()->second.photons_per_pass)};
  // Rounds that are still to be planned, or to be planned again by a job that goes on, need these.
  state.after.erase(state.after.begin(), state.after.lower_bound(RadiiFrom(RoundOf(passes))));
}

void JobEstimator::SetTail(ImageSums::Slices tail, const RoundPlan& plan) {
  if (!tail.empty()) state_->last_radii = plan.radii;
  state_->sums->SetTail(std::move(tail));
}

const SceneNeeds& JobEstimator::needs() const {
  return state_->prepared.needs();
}

std::size_t JobEstimator::faint_lights() const {
  return state_->prepared.lights().faint_lights();
}

std::int64_t JobEstimator::passes() const {
  return static_cast<std::int64_t>(state_->sums->passes());
}

std::uint64_t JobEstimator::whole_passes() const {
  return state_->sums->whole_passes();
}

const BatchTally& JobEstimator::whole_tally() const {
  return state_->sums->whole().tally;
}

std::uint64_t JobEstimator::photons() const {
  return state_->sums->tally().photons;
}

std::uint64_t JobEstimator::eye_rays() const {
  return state_->sums->eye_rays();
}

Image JobEstimator::MakeImage() const {
  const State& state = *state_;
  const Scene& scene = state.prepared.scene();
  const ImageSums& sums = *state.sums;
  Image image = MakeFilmImage({.width = state.settings.crop_width(),
                               .height = state.settings.crop_height(),
                               .exposure = scene.film.exposure,
                               .max_component = scene.film.max_component},
                              sums, *state.last_radii, *state.radii, *state.controller,
                              Kernel{state.settings.kernel});
  ToFileUnit(image, scene.unit);
  if (passes() < 2) return image;
  const auto passes_so_far = static_cast<double>(passes());
  const double exposure = scene.film.exposure;
  const double even_passes = std::ceil(passes_so_far / 2);
  const double odd_passes = passes_so_far - even_passes;
  const double noise_area = state.noise_area_after == state.sums->passes()
                                ? state.noise_area
                                : EstimateError(1).noise_area;
  std::vector<PixelNoise> noise(sums.pixels());
  std::vector<float> bias(sums.pixels());
  for (std::size_t pixel = 0; pixel < sums.pixels(); ++pixel) {
    const ImageSums::Pixel of_pixel = sums.At(pixel);
    const double sum = exposure * LuminanceOf(ToRec709(of_pixel.radiance()));
    const double even_sum =
        0.5 * (sum + exposure * LuminanceOf(ToRec709(of_pixel.half_difference)));
    bias[pixel] =
        static_cast<float>(exposure * (of_pixel.even_bias + of_pixel.odd_bias) / passes_so_far);
    const double variance = exposure * exposure * of_pixel.squared_deviations / passes_so_far;
    if (!(variance > 0)) continue;
    const double difference = even_sum / even_passes - (sum - even_sum) / odd_passes;
    const double largest = exposure * static_cast<double>(of_pixel.largest) - sum / passes_so_far;
    noise[pixel] = {.of_halves = difference * difference * even_passes * odd_passes /
                                 (passes_so_far * passes_so_far),
                    .of_passes = variance / (passes_so_far - 1),
                    .largest_share = std::min(1.0, largest * largest / (passes_so_far * variance))};
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
  const double exposure = state_->prepared.scene().film.exposure;
  const auto passes_so_far = static_cast<double>(passes());
  const auto sums_at = [&](std::size_t pixel) {
    const ImageSums::Pixel of_pixel = state_->sums->At(pixel);
    PixelSums sums;
    const RgbSum all = ToRec709(of_pixel.radiance());
    const RgbSum difference = ToRec709(of_pixel.half_difference);
    // Bias is known as a luminance: it has the colour that the photons have.
    const double luminance = LuminanceOf(of_pixel.photons);
    const RgbSum photons = ToRec709(of_pixel.photons);
    for (std::size_t c = 0; c < 3; ++c) {
      sums.all[c] = exposure * all[c];
      sums.even[c] = 0.5 * exposure * (all[c] + difference[c]);
      sums.bias_color[c] = luminance > 0 ? photons[c] / luminance : 0;
    }
    sums.even_bias = exposure * of_pixel.even_bias;
    sums.odd_bias = exposure * of_pixel.odd_bias;
    const double sum = LuminanceOf(sums.all);
    sums.square = exposure * exposure * of_pixel.squared_deviations + sum * sum / passes_so_far;
    return sums;
  };
  ErrorEstimate estimate = lucerna::EstimateError(
      state_->settings.crop_width(), state_->settings.crop_height(), passes(), look, sums_at);
  state_->noise_area = estimate.noise_area;
  state_->noise_area_after = state_->sums->passes();
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
  const std::size_t pixels = state_->sums->pixels();
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    if (LuminanceOf(state_->Sum(pixel)) > 0) return false;
  }
  return true;
}

MissingLight JobEstimator::FindMissingLight() const {
  const State& state = *state_;
  const auto passes_so_far = static_cast<double>(passes());
  const std::size_t pixels = state.sums->pixels();
  const auto pixel_count = static_cast<double>(pixels);
  std::vector<double> luminances(pixels);
  double sum = 0;
  double photon_sum = 0;
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    const ImageSums::Pixel of_pixel = state.sums->At(pixel);
    luminances[pixel] = std::max(0.0, LuminanceOf(ToRec709(of_pixel.radiance())) / passes_so_far);
    sum += luminances[pixel];
    photon_sum += LuminanceOf(ToRec709(of_pixel.photons)) / passes_so_far;
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
  const std::vector<LightTally> tallies = state.sums->tally().lights;
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
  const double to_pixel = state_->prepared.scene().film.exposure / static_cast<double>(passes());
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

void JobEstimator::Save(ByteWriter& writer) const {
  const State& state = *state_;
  WriteSums(writer, state.sums->whole());
  WriteNumbers(writer, state.radii->numbers());
  WriteRadii(writer, *state.last_radii);
  writer.Varint(state.after.size());
  for (const auto& [passes, after] : state.after) {
    writer.Varint(passes);
    writer.Varint(after.photons_per_pass);
    WriteRadii(writer, *after.radii);
  }
  WriteDouble(writer, state.noise_area);
  writer.Varint(state.noise_area_after);
  for (const Vec3& corner : {state.view.low, state.view.high}) {
    for (const float coordinate : {corner.x, corner.y, corner.z})
      WriteFloat(writer, coordinate);
  }
  WriteFloat(writer, state.widest_radius);
  WriteDouble(writer, state.hit_share);
}

Status JobEstimator::Restore(ByteReader& reader) {
  State& state = *state_;
  const std::size_t pixels = state.sums->pixels();
  LUCERNA_ASSIGN_OR_RETURN(ImageSums::Whole sums, ReadSums(reader, pixels));
  LUCERNA_ASSIGN_OR_RETURN(PixelRadii::Numbers numbers,
                           ReadNumbers(reader, state.radii->numbers()));
  const auto read_radii = [&]() -> StatusOr<std::shared_ptr<const RadiusColumn>> {
    LUCERNA_ASSIGN_OR_RETURN(RadiusColumn radii, ReadRadii(reader, pixels));
    return std::make_shared<const RadiusColumn>(std::move(radii));
  };
  LUCERNA_ASSIGN_OR_RETURN(std::shared_ptr<const RadiusColumn> last_radii, read_radii());
  std::map<std::uint64_t, State::After> after;
  for (std::uint64_t left = reader.Varint(); left > 0; --left) {
    const std::uint64_t passes = reader.Varint();
    State::After& of_passes = after[passes];
    of_passes.photons_per_pass = reader.Varint();
    LUCERNA_ASSIGN_OR_RETURN(of_passes.radii, read_radii());
  }
  const double noise_area = ReadDouble(reader);
  const std::uint64_t noise_area_after = reader.Varint();
  Bounds view;
  for (Vec3* const corner : {&view.low, &view.high}) {
    for (float* const coordinate : {&corner->x, &corner->y, &corner->z})
      *coordinate = ReadFloat(reader);
  }
  const float widest_radius = ReadFloat(reader);
  const double hit_share = ReadDouble(reader);
  if (!reader.finished() || !after.contains(sums.passes)) {
    return absl::InvalidArgumentError("malformed checkpoint: it ends too soon or too late");
  }
  state.sums->Restore(std::move(sums));
  state.radii->Restore(std::move(numbers));
  state.last_radii = std::move(last_radii);
  state.after = std::move(after);
  state.noise_area = noise_area;
  state.noise_area_after = noise_area_after;
  state.view = view;
  state.widest_radius = widest_radius;
  state.hit_share = hit_share;
  return absl::OkStatus();
}

}  // namespace lucerna
