#include "server/job_estimator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "absl/strings/str_format.h"

#include "render/analysis/pass_time.h"
#include "render/analysis/prepared_scene.h"
#include "render/base/memory.h"
#include "render/base/mutex.h"
#include "render/base/parallel.h"
#include "render/base/text.h"
#include "render/estimate/evidence.h"
#include "render/estimate/eye_path_counts.h"
#include "render/estimate/missing_light.h"
#include "render/estimate/noise_layer.h"
#include "render/estimate/photon_noise.h"
#include "render/estimate/photon_steps.h"
#include "render/estimate/pixel_radii.h"
#include "render/estimate/radius_scale.h"
#include "render/estimate/relative_error.h"
#include "render/estimate/without_blur.h"
#include "render/film/film.h"
#include "render/film/image_color.h"
#include "render/film/layers.h"
#include "render/math/color_space.h"
#include "render/math/warp.h"
#include "render/scene/shape_lists.h"
#include "render/tracing/eye_path.h"
#include "server/job_guides.h"
#include "server/state/sums_codec.h"

namespace lucerna {
namespace {

// The number of photons of later passes is chosen after so many passes. What variance the choice
// follows from is seen in rounds of one pass alone.
struct PhotonChoice {
  std::uint64_t passes;
  // Over the photons of the first passes, at most. A number never falls again, and few passes have
  // seldom met rare light.
  std::uint64_t most;
};
constexpr std::array kPhotonChoices = {PhotonChoice{2, 2}, PhotonChoice{4, 4}, PhotonChoice{8, 8}};
static_assert(kPhotonChoices.back().passes <= kFirstLongRound);
static_assert(kPhotonChoices.back().passes == kEyePathsCompared);

// Whether a path may be bent by a smooth surface.
bool HasSmoothSurfaces(const Scene& scene) {
  bool is_any_smooth = false;
  ForEachShapeTraits(scene, [&](const ShapeTraits& traits) {
    is_any_smooth |= ScattersSmoothly(scene.materials[static_cast<std::size_t>(traits.material)]);
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

// Of pixels that are `to_pixel` times `values`.
TrueError TrueErrorOf(const ReferenceImage& reference,
                      const std::array<std::vector<float>, 3>& values, double to_pixel) {
  std::vector<double> luminances(reference.size());
  for (std::size_t pixel = 0; pixel < reference.size(); ++pixel) {
    const Rgb right = reference[pixel];
    luminances[pixel] = LuminanceOf(
        {static_cast<double>(right.r), static_cast<double>(right.g), static_cast<double>(right.b)});
  }
  const double floor = RelativeErrorFloor(luminances);
  std::vector<TrueError> pixels(reference.size());
  for (std::size_t pixel = 0; pixel < reference.size(); ++pixel) {
    for (std::size_t c = 0; c < 3; ++c) {
      const auto right = static_cast<double>(reference[pixel][static_cast<int>(c)]);
      const double off = static_cast<double>(values[c][pixel]) * to_pixel - right;
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

}  // namespace

struct JobEstimator::State {
  State(Scene s, RenderSettings r, const SceneNeeds& needs, int threads)
      : prepared(std::move(s), threads),
        settings(r),
        team(threads),
        first_hits(needs.eye_sample_sets(), static_cast<std::size_t>(r.crop_width()) *
                                                static_cast<std::size_t>(r.crop_height())) {}

  PreparedScene prepared;
  // Of jobs that carry wavelengths: held where the scene has the colours of a pass, and where its
  // three colours are used meanwhile.
  Mutex colors_mutex;
  RenderSettings settings;
  ThreadTeam team;
  FirstHits first_hits;
  float initial_radius = 0;  // [unit radii]
  std::unique_ptr<EyePathTracer> tracer;
  std::unique_ptr<FilmSpread> film_spread;
  std::unique_ptr<RadiusController> controller;
  std::unique_ptr<PixelRadii> radii;
  std::unique_ptr<ImageSums> sums;
  double blur_noise_share = 1;             // of the whole passes
  std::unique_ptr<PassVariance> variance;  // of the rounds of one pass, while they come
  // What rounds follow from that are planned by the state after so many passes.
  struct After {
    std::shared_ptr<const RadiusColumn> radii;
    std::uint64_t photons_per_pass = 0;
    std::shared_ptr<const PhotonGuide> guide = nullptr;        // nullptr: photons are drawn evenly
    std::shared_ptr<const EyePathCounts> eye_paths = nullptr;  // nullptr: one for each pixel
  };
  std::map<std::uint64_t, After> after;
  std::unique_ptr<JobGuides> guides;               // of jobs whose photons are drawn by them
  std::shared_ptr<const RadiusColumn> last_radii;  // of the last round added
  // Of the last estimate, and after how many passes that was.
  Mutex noise_area_mutex;
  double noise_area LUCERNA_GUARDED_BY(noise_area_mutex) = 1;
  std::int64_t noise_area_after LUCERNA_GUARDED_BY(noise_area_mutex) = 0;
  // For light that may not have been found.
  bool has_smooth_surfaces = false;
  Bounds view;              // of the hitpoints of the first pass
  float widest_radius = 0;  // of these hitpoints
  double hit_share = 0;     // of the pixels that have one

  // The image as it is shown.
  [[nodiscard]] WithoutBlur Shown() const {
    const bool media_scatter = std::ranges::any_of(prepared.scene().media, &Medium::Scatters);
    return {*sums, *controller, blur_noise_share, media_scatter};
  }
  [[nodiscard]] std::size_t pixels() const {
    return static_cast<std::size_t>(settings.crop_width()) *
           static_cast<std::size_t>(settings.crop_height());
  }

  // Not where pixels follow from no others, so that tiles match the whole image, not of sensors, of
  // which each is a point, and not of images so large that memory would be short.
  [[nodiscard]] bool chooses_eye_paths() const {
    return !settings.unguided && pixels() <= kMostPixelsWithMore &&
           prepared.scene().camera.kind != Camera::Kind::kSensors;
  }

  [[nodiscard]] std::shared_ptr<const EyePathCounts> EyePathsOf(const PassRange& round,
                                                                const After& known) const {
    if (!chooses_eye_paths() || !ComparesEyePaths(round.first)) return known.eye_paths;
    return std::make_shared<const EyePathCounts>(
        ComparedEyePaths(pixels(), static_cast<std::size_t>(settings.crop_width()), round.first));
  }

  // Of no passes.
  void BeginSums() {
    radii = std::make_unique<PixelRadii>(pixels(), initial_radius, *controller);
    sums = std::make_unique<ImageSums>(pixels());
    blur_noise_share = 1;
    if (settings.adaptive_photons || chooses_eye_paths())
      variance = std::make_unique<PassVariance>(pixels());
  }

  // As JobEstimator::Restore, but for sums, radii and variance: those are gone when it fails.
  [[nodiscard]] Status RestoreSums(ByteReader& reader);

  [[nodiscard]] std::unique_ptr<const MutexLock> HoldColors() {
    return prepared.needs().Uses(Part::kSpectra) ? std::make_unique<const MutexLock>(colors_mutex)
                                                 : nullptr;
  }

  // Passes of `plan` come next; takes the tail away.
  void Weigh(const RoundPlan& plan) {
    const double factor = sums->WeighBy(plan.photons_per_pass);
    if (variance != nullptr) variance->Discount(factor);
  }

  // How many photons and eye paths later passes have once `round` has been added: into `next`,
  // which has those by what was known before.
  void ChooseSamples(const PassRange& round, After& next) {
    if (variance == nullptr) return;
    const auto choice = std::ranges::find(kPhotonChoices, round.last, &PhotonChoice::passes);
    if (choice == kPhotonChoices.end()) return;
    const auto reach = static_cast<double>(ReachOf(EvidenceOf(settings.radius_controller)));
    const double kernel_noise = kPi64 * Kernel{settings.kernel}.Moments().roughness * reach * reach;
    const std::uint64_t most = choice->most * static_cast<std::uint64_t>(settings.photons_per_pass);
    const bool is_last = round.last == kPhotonChoices.back().passes;
    if (is_last && chooses_eye_paths()) {
      const Samples samples =
          lucerna::ChooseSamples(*variance, *sums, kernel_noise, next.photons_per_pass,
                                 settings.adaptive_photons ? most : next.photons_per_pass,
                                 static_cast<std::size_t>(settings.crop_width()));
      next.photons_per_pass = samples.photons_per_pass;
      next.eye_paths = samples.eye_paths;
    } else if (settings.adaptive_photons) {
      next.photons_per_pass =
          NextPhotons(next.photons_per_pass, most, variance->BestPhotons(*sums, kernel_noise));
    }
    if (is_last) variance.reset();
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
                                      prepared.intersector(), prepared.lights(), threads);
  state->film_spread = std::make_unique<FilmSpread>(*state->tracer);
  const auto initial = static_cast<float>(settings.initial_radius > 0
                                              ? settings.initial_radius / prepared.scene().unit
                                              : settings.initial_footprints);
  state->initial_radius = initial;
  state->controller = MakeRadiusController(state->settings, initial);
  state->BeginSums();
  state->last_radii = std::make_shared<const RadiusColumn>(state->radii->Current());
  const auto photons_per_pass = static_cast<std::uint64_t>(settings.photons_per_pass);
  state->after[0] = {.radii = state->last_radii, .photons_per_pass = photons_per_pass};
  if (!settings.unguided && prepared.needs().Uses(Part::kPhotons)) {
    state->guides =
        std::make_unique<JobGuides>(prepared, state->settings, *state->tracer, state->team);
    state->after[0].guide = state->guides->First(photons_per_pass);
  }
  state->has_smooth_surfaces = HasSmoothSurfaces(prepared.scene());
  const HitpointExtent extent = SampleExtent(*state->tracer);
  state->view = extent.bounds;
  state->widest_radius = HitpointRadius(initial, extent.widest_unit_radius);
  state->hit_share = extent.rows_per_pixel;
  return std::unique_ptr<JobEstimator>(new JobEstimator(std::move(state)));
}

StatusOr<EyePass> JobEstimator::TraceEyePaths(std::uint64_t pass, const EyePathCounts* counts,
                                              const std::function<bool()>& shall_stop) const {
  const auto lock = state_->HoldColors();
  const SceneMotion& motion = state_->prepared.scene().motion;
  if (motion.Moves()) {
    // The scene of this job stays as it is when the shutter opens: others read it meanwhile.
    LUCERNA_ASSIGN_OR_RETURN(const std::unique_ptr<PreparedScene> then,
                             state_->prepared.At(TimeOfPass(motion, state_->settings.seed, pass)));
    const EyePathTracer tracer(then->scene(), state_->settings, then->needs(), then->intersector(),
                               then->lights(), state_->team.threads());
    FilmSpread spread(tracer);
    if (needs().Uses(Part::kSpectra)) spread.Prepare(state_->team);
    const PreparedScene::AtPass at_pass(*then, state_->settings.seed, pass);
    return TraceHitpointPass(tracer, pass, nullptr, spread, state_->team, shall_stop, counts);
  }
  if (needs().Uses(Part::kSpectra)) state_->film_spread->Prepare(state_->team);
  const PreparedScene::AtPass at_pass(state_->prepared, state_->settings.seed, pass);
  return TraceHitpointPass(*state_->tracer, pass, state_->first_hits.Of(pass), *state_->film_spread,
                           state_->team, shall_stop, counts);
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
                       ScheduledShrink(state_->settings.alpha, {0, round.first})),
                   .guide = after->second.guide,
                   .eye_paths = state_->EyePathsOf(round, after->second)};
}

SliceShape JobEstimator::ShapeOf(const PassRange& round, const RoundPlan& plan) const {
  return {.passes = round,
          .pixels = state_->sums->pixels(),
          .evidence = ControllerColumns(state_->settings.radius_controller),
          .photons_per_pass = plan.photons_per_pass};
}

ThreadTeam& JobEstimator::team() {
  return state_->team;
}

SliceSums JobEstimator::SliceOf(EyePass pass, const RoundPlan& plan, PassSums sums) const {
  return SliceOfPass(std::move(pass), plan, std::move(sums), state_->settings, needs(),
                     state_->prepared.flux_scale(), state_->team);
}

void JobEstimator::AddRound(std::shared_ptr<const SliceSums> round, const RoundPlan& plan) {
  LUCERNA_CHECK(round->passes == RoundOf(whole_passes()));
  State& state = *state_;
  state.Weigh(plan);
  if (state.variance != nullptr) state.variance->Add(*round, *state.sums);
  state.sums->Add(*round, state.team);
  // Without a guide nothing of a pixel follows from others, so that tiles match the whole image.
  PixelRadii::OfImage image = {.noise_share = kUnguidedNoiseShare};
  if (!state.settings.unguided) {
    const NoiseSample sample = SampleNoise(*state.sums);
    state.blur_noise_share = BlurNoiseShare(*state.sums, sample);
    image = {.noise_share = PhotonNoiseShare(*state.sums, sample),
             .scale = RadiusScale(*state.sums, *state.radii, sample,
                                  static_cast<std::size_t>(state.settings.crop_width()))};
  }
  state.radii->Step({*round, *plan.radii, plan.photons_per_pass}, image, state.team);
  state.last_radii = plan.radii;
  const std::uint64_t passes = whole_passes();
  const State::After before = state.after.rbegin()->second;
  State::After& after = state.after[passes];
  after.radii = std::make_shared<const RadiusColumn>(state.radii->Current());
  const PassRange of_round = round->passes;
  const std::vector<EmissionReport> reports = round->reports;
  const std::uint64_t photons = round->tally.photons;
  round.reset();
  after.photons_per_pass = before.photons_per_pass;
  after.guide = before.guide;
  after.eye_paths = before.eye_paths;
  state.ChooseSamples(of_round, after);
  if (state.guides != nullptr) {
    state.guides->Add(reports, plan.guide, photons);
    if (JobGuides::IsTimeForNext(passes, *before.guide)) {
      const auto lock = state.HoldColors();
      after.guide = state.guides->Next({*state.sums, *plan.radii}, passes, after.photons_per_pass,
                                       *before.guide);
    }
  }
  // Rounds that are still to be planned, or to be planned again by a job that goes on, need these;
  // the newest is what the next choice of photons follows from.
  std::set<std::uint64_t> needed = {passes};
  for (PassRange next = RoundOf(passes); RadiiFrom(next) < passes; next = RoundOf(next.last))
    needed.insert(RadiiFrom(next));
  std::erase_if(state.after, [&](const auto& entry) { return !needed.contains(entry.first); });
}

void JobEstimator::SetTail(ImageSums::Slices tail, const RoundPlan& plan) {
  if (!tail.empty()) {
    state_->Weigh(plan);
    state_->last_radii = plan.radii;
  }
  state_->sums->SetTail(std::move(tail));
}

const SceneNeeds& JobEstimator::needs() const {
  return state_->prepared.needs();
}

EmissionCheck JobEstimator::emission_check() const {
  return EmissionCheck(state_->prepared.lights(), state_->prepared.largest_power());
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

BandedImage JobEstimator::MakeBands(std::shared_ptr<const DenoisedImage> denoised) const {
  BandedImage image;
  image.head.width = state_->settings.crop_width();
  image.head.height = state_->settings.crop_height();
  const bool has_noise = passes() >= 2;
  // Of all pixels, since those around count.
  const auto noise =
      std::make_shared<const std::vector<float>>(has_noise ? NoiseLayer() : std::vector<float>());
  image.rows = [this, noise, has_noise, denoised = std::move(denoised)](int first_row,
                                                                        int last_row) {
    const State& state = *state_;
    const Scene& scene = state.prepared.scene();
    const ImageSums& sums = *state.sums;
    const WithoutBlur shown = state.Shown();
    const auto width = static_cast<std::size_t>(state.settings.crop_width());
    const std::size_t first = static_cast<std::size_t>(first_row) * width;
    const std::size_t last = static_cast<std::size_t>(last_row) * width;
    std::vector<ImageChannel> band =
        MakeFilmPixels({.exposure = scene.film.exposure,
                        .white_balance = scene.film.white_balance,
                        .max_component = scene.film.max_component,
                        .has_coverage = state.settings.coverage},
                       first, last, sums, shown, *state.last_radii, *state.radii, *state.controller,
                       Kernel{state.settings.kernel}, state_->team);
    ToFileUnit(band, scene.unit);
    if (!has_noise) return band;
    const double weight = sums.weights().all();
    const auto errors_of = [&](std::size_t offset) {
      const ImageSums::Pixel of_pixel = shown.At(first + offset);
      PixelValues values;
      values.noise = static_cast<double>((*noise)[first + offset]);
      values.bias = scene.film.exposure * (of_pixel.even_bias + of_pixel.odd_bias) / weight;
      return values;
    };
    AddLayers(LayerSource::kPasses, errors_of, last - first, state_->team, band);
    if (denoised == nullptr) return band;
    const auto denoised_of = [&](std::size_t offset) {
      PixelValues values;
      double largest = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        values.denoised[c] = static_cast<double>(denoised->pixels[c][first + offset]);
        largest = std::max(largest, values.denoised[c]);
      }
      values.limit = LimitOf(largest, scene.film.max_component);
      return values;
    };
    AddLayers(LayerSource::kDenoised, denoised_of, last - first, state_->team, band);
    return band;
  };
  return image;
}

NoisyImage JobEstimator::MakeNoisyImage() const {
  const State& state = *state_;
  const ImageSums& sums = *state.sums;
  const PassWeights weights = sums.weights();
  const double exposure = state.prepared.scene().film.exposure;
  const ImageColor color(state.prepared.scene().film.white_balance);
  const WithoutBlur shown = state.Shown();
  NoisyImage image;
  image.width = state.settings.crop_width();
  image.height = state.settings.crop_height();
  image.even_share = weights.even / weights.all();
  image.noise = NoiseLayer();
  image.feature_share =
      static_cast<double>(std::min(sums.passes(), kFeaturePasses)) / static_cast<double>(passes());
  const auto resize = [&](ColorColumns& columns) {
    for (std::vector<float>& column : columns)
      column.resize(sums.pixels());
  };
  for (ColorColumns& half : image.halves)
    resize(half);
  resize(image.features.albedo);
  resize(image.features.normal);
  image.features.normal_variance.resize(sums.pixels());
  image.features.distance.resize(sums.pixels());
  constexpr std::size_t kPixelsAtOnce = 4096;
  state_->team.For(sums.pixels(), kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t pixel = begin; pixel < end; ++pixel) {
      const ImageSums::Pixel of_pixel = shown.At(pixel);
      const std::array<double, 3> all = color(of_pixel.radiance());
      const std::array<double, 3> difference = color(of_pixel.half_difference);
      const FilmFeatures features = FeaturesOf(sums.FeaturesAt(pixel));
      for (std::size_t c = 0; c < 3; ++c) {
        const double even = 0.5 * (all[c] + difference[c]);
        image.halves[0][c][pixel] = static_cast<float>(exposure * even / weights.even);
        image.halves[1][c][pixel] = static_cast<float>(exposure * (all[c] - even) / weights.odd);
        image.features.albedo[c][pixel] = static_cast<float>(features.albedo[c]);
        image.features.normal[c][pixel] = static_cast<float>(features.normal[c]);
      }
      image.features.normal_variance[pixel] = static_cast<float>(features.normal_variance);
      image.features.distance[pixel] = static_cast<float>(features.distance);
    }
  });
  return image;
}

DenoisedImage JobEstimator::Denoise(NoisyImage image) const {
  return lucerna::Denoise(std::move(image), state_->team);
}

std::vector<float> JobEstimator::NoiseLayer() const {
  const ImageSums& sums = *state_->sums;
  const PassWeights weights = sums.weights();
  const double weight = weights.all();
  const double exposure = state_->prepared.scene().film.exposure;
  const ImageColor color(state_->prepared.scene().film.white_balance);
  const double noise_area = NoiseArea();
  const WithoutBlur shown = state_->Shown();
  std::vector<PixelNoise> noise(sums.pixels());
  constexpr std::size_t kPixelsAtOnce = 4096;
  state_->team.For(noise.size(), kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t pixel = begin; pixel < end; ++pixel) {
      const ImageSums::Pixel of_pixel = shown.At(pixel);
      const double sum = exposure * LuminanceOf(color(of_pixel.radiance()));
      const double even_sum = 0.5 * (sum + exposure * LuminanceOf(color(of_pixel.half_difference)));
      const double variance = exposure * exposure * of_pixel.squared_deviations / weight;
      if (!(variance > 0)) continue;
      const double difference = even_sum / weights.even - (sum - even_sum) / weights.odd;
      const double largest = exposure * static_cast<double>(of_pixel.largest) - sum / weight;
      noise[pixel] = {
          .of_halves = difference * difference * weights.even * weights.odd / (weight * weight),
          .of_passes = variance / static_cast<double>(passes() - 1),
          .largest_share = std::min(1.0, largest * largest / (weight * variance))};
    }
  });
  return NoiseOfPixels(state_->settings.crop_width(), state_->settings.crop_height(), noise_area,
                       noise);
}

double JobEstimator::NoiseArea() const {
  {
    const MutexLock lock(state_->noise_area_mutex);
    if (state_->noise_area_after == passes()) return state_->noise_area;
  }
  return EstimateError(Snapshot(), {}, 1).noise_area;
}

EstimatorSnapshot JobEstimator::Snapshot() const {
  const State& state = *state_;
  const double exposure = state.prepared.scene().film.exposure;
  const ImageColor color(state.prepared.scene().film.white_balance);
  const std::size_t pixels = state.sums->pixels();
  EstimatorSnapshot snapshot;
  const WithoutBlur shown = state.Shown();
  snapshot.photons = photons();
  snapshot.lights = state.sums->tally().lights;
  snapshot.image =
      ImageStatistics(state.settings.crop_width(), state.settings.crop_height(), passes());
  snapshot.image.weights = state.sums->weights();
  const auto scaled = [](const RgbSum& c, double factor) {
    return std::array<float, 3>{static_cast<float>(factor * c[0]),
                                static_cast<float>(factor * c[1]),
                                static_cast<float>(factor * c[2])};
  };
  // Luminances and those by photons, of pieces of the image: added up in their order.
  constexpr std::size_t kPixelsAtOnce = 4096;
  std::vector<std::array<double, 2>> luminances((pixels + kPixelsAtOnce - 1) / kPixelsAtOnce);
  state_->team.For(luminances.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t piece = begin; piece < end; ++piece) {
      const std::size_t last = std::min(pixels, (piece + 1) * kPixelsAtOnce);
      for (std::size_t pixel = piece * kPixelsAtOnce; pixel < last; ++pixel) {
        const ImageSums::Pixel of_pixel = shown.At(pixel);
        const RgbSum all = color(of_pixel.radiance());
        const RgbSum photons = color(of_pixel.photons);
        const double photon_luminance = LuminanceOf(photons);
        PixelStatistics statistics;
        statistics.all = scaled(all, exposure);
        statistics.half_difference = scaled(color(of_pixel.half_difference), exposure);
        statistics.squared_deviations =
            static_cast<float>(exposure * exposure * of_pixel.squared_deviations);
        statistics.even_bias = static_cast<float>(exposure * of_pixel.even_bias);
        statistics.odd_bias = static_cast<float>(exposure * of_pixel.odd_bias);
        // Bias is known as a luminance: it has the colour that the photons have.
        if (photon_luminance > 0) statistics.bias_color = scaled(photons, 1 / photon_luminance);
        snapshot.image.Set(pixel, statistics);
        luminances[piece][0] += std::max(0.0, LuminanceOf(all));
        luminances[piece][1] += photon_luminance;
      }
    }
  });
  for (const std::array<double, 2>& of_piece : luminances) {
    snapshot.luminance += of_piece[0];
    snapshot.photon_luminance += of_piece[1];
  }
  const double per_pixel = 1 / (static_cast<double>(pixels) * snapshot.image.weights.all());
  snapshot.luminance *= per_pixel;
  snapshot.photon_luminance *= per_pixel;
  return snapshot;
}

ErrorEstimate JobEstimator::EstimateError(EstimatorSnapshot snapshot, const MissingLight& missing,
                                          int look) const {
  const std::int64_t passes = snapshot.image.passes;
  ErrorEstimate estimate = lucerna::EstimateError(std::move(snapshot.image), look, state_->team);
  {
    const MutexLock lock(state_->noise_area_mutex);
    state_->noise_area = estimate.noise_area;
    state_->noise_area_after = passes;
  }
  // Without any light a black image is exact.
  if (lucerna::IsBlack(state_->prepared.lights().TotalPower())) {
    estimate.relative = {};
    estimate.untrimmed = 0;
  }
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

MissingLight JobEstimator::FindMissingLight(const EstimatorSnapshot& snapshot) const {
  const State& state = *state_;
  const double exposure = state.prepared.scene().film.exposure;
  const auto pixel_count = static_cast<double>(snapshot.image.pixels());
  PhotonView view;
  view.takes_photons = state.prepared.needs().Uses(Part::kPhotons) &&
                       state.settings.max_depth > 1 && state.hit_share > 0;
  view.has_caustics = state.has_smooth_surfaces;
  view.photon_radiance = snapshot.photon_luminance;
  // What relative errors are relative to, as their mean over pixels has it: dark pixels weigh most,
  // down to a tenth of the mean.
  const double mean = snapshot.luminance;
  if (mean > 0) {
    const double to_mean = 1 / (mean * exposure * snapshot.image.weights.all());
    double inverse = 0;
    const std::array<std::vector<float>, 3>& all = snapshot.image.all;
    for (std::size_t pixel = 0; pixel < snapshot.image.pixels(); ++pixel) {
      const double of_mean =
          to_mean * std::max(0.0, LuminanceOf({static_cast<double>(all[0][pixel]),
                                               static_cast<double>(all[1][pixel]),
                                               static_cast<double>(all[2][pixel])}));
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
  const std::vector<LightTally>& tallies = snapshot.lights;
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
  missing.nothing_found = !state.prepared.lights().empty() && !(mean > 0);
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

TrueError JobEstimator::ErrorAgainst(const ReferenceImage& reference,
                                     const EstimatorSnapshot& snapshot) {
  return TrueErrorOf(reference, snapshot.image.all, 1 / snapshot.image.weights.all());
}

TrueError JobEstimator::ErrorAgainst(const ReferenceImage& reference,
                                     const DenoisedImage& denoised) {
  return TrueErrorOf(reference, denoised.pixels, 1);
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
    if (state.guides != nullptr) WriteGuide(writer, *after.guide);
    // They are chosen once, so that all which have some have the same.
    writer.Byte(after.eye_paths != nullptr ? 1 : 0);
  }
  if (const auto& newest = state.after.rbegin()->second; newest.eye_paths != nullptr)
    WriteEyePaths(writer, *newest.eye_paths);
  if (state.guides != nullptr) WriteLearned(writer, state.guides->learned());
  {
    const MutexLock lock(state_->noise_area_mutex);
    WriteDouble(writer, state_->noise_area);
    writer.Varint(static_cast<std::uint64_t>(state_->noise_area_after));
  }
  writer.Byte(state.variance != nullptr ? 1 : 0);
  if (state.variance != nullptr) WriteVariance(writer, *state.variance);
}

Status JobEstimator::Restore(ByteReader& reader) {
  Status restored = state_->RestoreSums(reader);
  if (!restored.ok()) state_->BeginSums();
  return restored;
}

Status JobEstimator::State::RestoreSums(ByteReader& reader) {
  // The zeros go before as much is read.
  sums = nullptr;
  radii = nullptr;
  variance = nullptr;
  LUCERNA_ASSIGN_OR_RETURN(ImageSums::Whole read_sums, ReadSums(reader, pixels()));
  LUCERNA_ASSIGN_OR_RETURN(PixelRadii::Numbers numbers,
                           ReadNumbers(reader, pixels(), controller->MemoryPerPixel()));
  const auto read_radii = [&]() -> StatusOr<std::shared_ptr<const RadiusColumn>> {
    LUCERNA_ASSIGN_OR_RETURN(RadiusColumn column, ReadRadii(reader, pixels()));
    return std::make_shared<const RadiusColumn>(std::move(column));
  };
  LUCERNA_ASSIGN_OR_RETURN(std::shared_ptr<const RadiusColumn> read_last_radii, read_radii());
  std::map<std::uint64_t, After> read_after;
  std::set<std::uint64_t> with_eye_paths;
  for (std::uint64_t left = reader.Varint(); left > 0; --left) {
    const std::uint64_t passes = reader.Varint();
    After& of_passes = read_after[passes];
    of_passes.photons_per_pass = reader.Varint();
    LUCERNA_ASSIGN_OR_RETURN(of_passes.radii, read_radii());
    if (guides != nullptr) {
      LUCERNA_ASSIGN_OR_RETURN(PhotonGuide guide, ReadGuide(reader));
      of_passes.guide = std::make_shared<const PhotonGuide>(std::move(guide));
    }
    if (reader.Byte() != 0) with_eye_paths.insert(passes);
  }
  if (!with_eye_paths.empty()) {
    LUCERNA_ASSIGN_OR_RETURN(EyePathCounts counts, ReadEyePaths(reader, pixels()));
    const auto shared = std::make_shared<const EyePathCounts>(std::move(counts));
    for (const std::uint64_t passes : with_eye_paths)
      read_after[passes].eye_paths = shared;
  }
  GuideLearner::Numbers learned;
  if (guides != nullptr) {
    LUCERNA_ASSIGN_OR_RETURN(learned, ReadLearned(reader, pixels()));
  }
  const double read_noise_area = ReadDouble(reader);
  const auto read_noise_area_after = static_cast<std::int64_t>(reader.Varint());
  std::unique_ptr<PassVariance> read_variance;
  if (reader.Byte() != 0) {
    LUCERNA_ASSIGN_OR_RETURN(PassVariance read, ReadVariance(reader, pixels()));
    read_variance = std::make_unique<PassVariance>(std::move(read));
  }
  if (!reader.finished() || !read_after.contains(read_sums.passes)) {
    return absl::InvalidArgumentError("malformed checkpoint: it ends too soon or too late");
  }
  sums = std::make_unique<ImageSums>(std::move(read_sums));
  blur_noise_share = settings.unguided ? 1 : BlurNoiseShare(*sums, SampleNoise(*sums));
  radii = std::make_unique<PixelRadii>(std::move(numbers), *controller);
  variance = std::move(read_variance);
  last_radii = std::move(read_last_radii);
  after = std::move(read_after);
  if (guides != nullptr) guides->Restore(std::move(learned));
  {
    const MutexLock lock(noise_area_mutex);
    noise_area = read_noise_area;
    noise_area_after = read_noise_area_after;
  }
  return absl::OkStatus();
}

}  // namespace lucerna
