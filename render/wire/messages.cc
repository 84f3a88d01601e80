#include "render/wire/messages.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace lucerna {
namespace {

constexpr int kLargestSide = 65'536;                      // [pixels]
constexpr std::int64_t kMostPhotons = 1'000'000'000'000;  // per pass
constexpr int kLargestDepth = 10'000;
constexpr int kMostEyeSets = 65'536;
constexpr std::int64_t kLongestSeconds = 9'000'000'000;  // fits in Duration
constexpr std::int64_t kNanosPerSecond = 1'000'000'000;

Status Outside(std::string_view field) {
  return absl::InvalidArgumentError(
      absl::StrCat("the settings' ", std::string(field), " is out of range"));
}

bool IsBetween(double value, double low, double high) {
  return value >= low && value <= high;
}

}  // namespace

v1::SceneManifest ToProto(const SceneManifest& manifest) {
  v1::SceneManifest message;
  message.set_main_path(manifest.main_path);
  for (const auto& [path, entry] : manifest.entries) {
    v1::SceneManifest::Entry& item = *message.add_entries();
    item.set_path(path);
    item.set_digest(std::string(entry.digest.Bytes()));
    item.set_size_bytes(entry.size_bytes);
  }
  return message;
}

StatusOr<SceneManifest> FromProto(const v1::SceneManifest& message, const SceneLimits& limits) {
  if (static_cast<std::uint64_t>(message.entries_size()) > limits.max_files) {
    return absl::InvalidArgumentError(absl::StrCat("a scene of ", message.entries_size(),
                                                   " files has more than the ", limits.max_files,
                                                   " that are allowed"));
  }
  SceneManifest manifest;
  manifest.main_path = message.main_path();
  std::uint64_t total_bytes = 0;
  for (const v1::SceneManifest::Entry& item : message.entries()) {
    LUCERNA_RETURN_IF_ERROR(CheckLogicalPath(item.path()));
    LUCERNA_ASSIGN_OR_RETURN(const Digest digest, Digest::FromBytes(item.digest()));
    if (item.size_bytes() > limits.max_total_bytes - total_bytes) {
      return absl::InvalidArgumentError(absl::StrCat(
          "the scene has more than the ", limits.max_total_bytes, " bytes that are allowed"));
    }
    total_bytes += item.size_bytes();
    if (!manifest.entries.emplace(item.path(), SceneManifest::Entry{digest, item.size_bytes()})
             .second) {
      return absl::InvalidArgumentError(absl::StrCat("the scene lists ", item.path(), " twice"));
    }
  }
  if (!manifest.entries.contains(manifest.main_path)) {
    return absl::InvalidArgumentError("the scene's main file is not among its files");
  }
  return manifest;
}

v1::RenderOverrides ToProto(const RenderOverrides& overrides) {
  v1::RenderOverrides message;
  if (overrides.width) message.set_width(*overrides.width);
  if (overrides.height) message.set_height(*overrides.height);
  if (overrides.passes) message.set_passes(*overrides.passes);
  if (overrides.photons_per_pass) message.set_photons_per_pass(*overrides.photons_per_pass);
  if (overrides.time_s) message.set_time_s(*overrides.time_s);
  if (overrides.error) message.set_error(*overrides.error);
  if (overrides.photons) message.set_photons(*overrides.photons);
  if (overrides.seed) message.set_seed(*overrides.seed);
  if (overrides.radius_controller) {
    message.set_radius_controller(std::string(NameOf(*overrides.radius_controller)));
  }
  if (overrides.alpha) message.set_alpha(*overrides.alpha);
  if (overrides.kernel) message.set_kernel(std::string(NameOf(*overrides.kernel)));
  if (overrides.bias) message.set_bias(*overrides.bias);
  if (overrides.frequency_share) message.set_frequency_share(*overrides.frequency_share);
  if (overrides.initial_radius) message.set_initial_radius(*overrides.initial_radius);
  if (overrides.initial_footprints) {
    message.set_initial_footprints(*overrides.initial_footprints);
  }
  if (overrides.max_depth) message.set_max_depth(*overrides.max_depth);
  if (overrides.use_everything) message.set_use_everything(*overrides.use_everything);
  return message;
}

StatusOr<RenderOverrides> FromProto(const v1::RenderOverrides& message) {
  RenderOverrides overrides;
  if (message.has_width()) overrides.width = message.width();
  if (message.has_height()) overrides.height = message.height();
  if (message.has_passes()) overrides.passes = message.passes();
  if (message.has_photons_per_pass()) overrides.photons_per_pass = message.photons_per_pass();
  if (message.has_seed()) overrides.seed = message.seed();
  if (message.has_max_depth()) overrides.max_depth = message.max_depth();
  if (message.has_use_everything()) overrides.use_everything = message.use_everything();
  if (message.has_time_s()) {
    if (!std::isfinite(message.time_s())) return Outside("time");
    overrides.time_s = message.time_s();
  }
  if (message.has_error()) {
    if (!std::isfinite(message.error())) return Outside("error");
    overrides.error = message.error();
  }
  if (message.has_photons()) overrides.photons = message.photons();
  if (message.has_alpha()) {
    if (!std::isfinite(message.alpha())) return Outside("alpha");
    overrides.alpha = message.alpha();
  }
  if (message.has_initial_radius()) {
    if (!std::isfinite(message.initial_radius())) return Outside("initial radius");
    overrides.initial_radius = message.initial_radius();
  }
  if (message.has_initial_footprints()) {
    if (!std::isfinite(message.initial_footprints())) return Outside("initial radius");
    overrides.initial_footprints = message.initial_footprints();
  }
  if (message.has_radius_controller()) {
    LUCERNA_ASSIGN_OR_RETURN(overrides.radius_controller,
                             ParseRadiusController(message.radius_controller()));
  }
  if (message.has_kernel()) {
    LUCERNA_ASSIGN_OR_RETURN(overrides.kernel, ParseKernel(message.kernel()));
  }
  if (message.has_bias()) {
    if (!std::isfinite(message.bias())) return Outside("bias");
    overrides.bias = message.bias();
  }
  if (message.has_frequency_share()) {
    if (!std::isfinite(message.frequency_share())) return Outside("frequency_share");
    overrides.frequency_share = message.frequency_share();
  }
  return overrides;
}

v1::RenderSettings ToProto(const RenderSettings& settings) {
  v1::RenderSettings message;
  message.set_width(settings.width);
  message.set_height(settings.height);
  message.set_crop_x0(settings.crop_x0);
  message.set_crop_y0(settings.crop_y0);
  message.set_crop_x1(settings.crop_x1);
  message.set_crop_y1(settings.crop_y1);
  message.set_passes(settings.passes);
  message.set_time_s(settings.time_s);
  message.set_error(settings.error);
  message.set_photons(settings.photons);
  message.set_photons_per_pass(settings.photons_per_pass);
  message.set_seed(settings.seed);
  message.set_radius_controller(std::string(NameOf(settings.radius_controller)));
  message.set_alpha(settings.alpha);
  message.set_kernel(std::string(NameOf(settings.kernel)));
  message.set_bias(settings.bias);
  message.set_frequency_share(settings.frequency_share);
  message.set_initial_radius(settings.initial_radius);
  message.set_initial_footprints(settings.initial_footprints);
  message.set_max_depth(settings.max_depth);
  message.set_use_everything(settings.use_everything);
  return message;
}

StatusOr<RenderSettings> FromProto(const v1::RenderSettings& message) {
  RenderSettings settings;
  settings.width = message.width();
  settings.height = message.height();
  if (!IsBetween(settings.width, 1, kLargestSide)) return Outside("width");
  if (!IsBetween(settings.height, 1, kLargestSide)) return Outside("height");
  settings.crop_x0 = message.crop_x0();
  settings.crop_y0 = message.crop_y0();
  settings.crop_x1 = message.crop_x1();
  settings.crop_y1 = message.crop_y1();
  if (settings.crop_x0 < 0 || settings.crop_x0 >= settings.crop_x1 ||
      settings.crop_x1 > settings.width || settings.crop_y0 < 0 ||
      settings.crop_y0 >= settings.crop_y1 || settings.crop_y1 > settings.height) {
    return Outside("crop window");
  }
  settings.passes = message.passes();
  if (settings.passes < 0) return Outside("number of passes");
  settings.time_s = message.time_s();
  if (!(settings.time_s >= 0) || !std::isfinite(settings.time_s)) return Outside("time");
  settings.error = message.error();
  if (!IsBetween(settings.error, 0, 10)) return Outside("error");
  settings.photons = message.photons();
  settings.photons_per_pass = message.photons_per_pass();
  if (settings.photons_per_pass < 1 || settings.photons_per_pass > kMostPhotons) {
    return Outside("number of photons per pass");
  }
  settings.seed = message.seed();
  LUCERNA_ASSIGN_OR_RETURN(settings.radius_controller,
                           ParseRadiusController(message.radius_controller()));
  settings.alpha = message.alpha();
  if (!(settings.alpha > 0 && settings.alpha < 1)) return Outside("alpha");
  LUCERNA_ASSIGN_OR_RETURN(settings.kernel, ParseKernel(message.kernel()));
  settings.bias = message.bias();
  if (!(settings.bias > 0 && settings.bias <= 1)) return Outside("bias");
  settings.frequency_share = message.frequency_share();
  if (!(settings.frequency_share > 0 && settings.frequency_share <= 1)) {
    return Outside("frequency_share");
  }
  settings.initial_radius = message.initial_radius();
  if (!(settings.initial_radius >= 0) || !std::isfinite(settings.initial_radius)) {
    return Outside("initial radius");
  }
  settings.initial_footprints = message.initial_footprints();
  if (!(settings.initial_footprints > 0) || !std::isfinite(settings.initial_footprints)) {
    return Outside("initial radius");
  }
  settings.max_depth = message.max_depth();
  if (!IsBetween(settings.max_depth, 1, kLargestDepth)) return Outside("depth");
  settings.use_everything = message.use_everything();
  return settings;
}

v1::SceneNeeds ToProto(const SceneNeeds& needs) {
  v1::SceneNeeds message;
  message.set_parts(needs.parts());
  message.set_eye_sample_sets(needs.eye_sample_sets());
  const UnreachableLights& lights = needs.unreachable_lights();
  message.mutable_lights_without_photons()->Assign(lights.of_photons.begin(),
                                                   lights.of_photons.end());
  message.mutable_lights_without_sampling()->Assign(lights.of_sampling.begin(),
                                                    lights.of_sampling.end());
  return message;
}

StatusOr<SceneNeeds> FromProto(const v1::SceneNeeds& message) {
  if (message.parts() >> kParts != 0) {
    return absl::InvalidArgumentError("the job needs parts that this program does not know");
  }
  if (!IsBetween(message.eye_sample_sets(), 0, kMostEyeSets)) {
    return absl::InvalidArgumentError("the job has an impossible number of sets of eye paths");
  }
  UnreachableLights lights;
  lights.of_photons.assign(message.lights_without_photons().begin(),
                           message.lights_without_photons().end());
  lights.of_sampling.assign(message.lights_without_sampling().begin(),
                            message.lights_without_sampling().end());
  if (!std::ranges::is_sorted(lights.of_photons) || !std::ranges::is_sorted(lights.of_sampling)) {
    return absl::InvalidArgumentError("the lights that a job leaves out are not in order");
  }
  return SceneNeeds(message.parts(), message.eye_sample_sets(), std::move(lights));
}

v1::Tally ToProto(const BatchTally& tally) {
  v1::Tally message;
  message.set_photons(tally.photons);
  message.set_rays(tally.rays);
  message.set_deposits(tally.deposits);
  message.set_pairs(tally.pairs);
  message.set_dropped(tally.dropped);
  message.set_excess(tally.excess);
  v1::Energy& energy = *message.mutable_energy();
  energy.set_emitted(tally.energy.emitted);
  energy.set_roulette_gave(tally.energy.roulette_gave);
  energy.set_roulette_took(tally.energy.roulette_took);
  energy.set_absorbed(tally.energy.absorbed);
  energy.set_escaped(tally.energy.escaped);
  energy.set_smoothing(tally.energy.smoothing);
  energy.set_cut_off(tally.energy.cut_off);
  energy.set_dropped(tally.energy.dropped);
  for (const LightTally& light : tally.lights) {
    v1::LightTally& item = *message.add_lights();
    item.set_sent(light.sent);
    item.set_in_view_caustic(light.InView(PathClass::kCaustic));
    item.set_in_view_other(light.InView(PathClass::kOther));
  }
  return message;
}

BatchTally FromProto(const v1::Tally& message) {
  const v1::Energy& energy = message.energy();
  std::vector<LightTally> lights;
  for (const v1::LightTally& light : message.lights()) {
    if (lights.size() == kMaxLightTallies) break;
    lights.push_back({light.sent(), {light.in_view_caustic(), light.in_view_other()}});
  }
  return {.photons = message.photons(),
          .rays = message.rays(),
          .deposits = message.deposits(),
          .pairs = message.pairs(),
          .dropped = message.dropped(),
          .excess = message.excess(),
          .energy = {.emitted = energy.emitted(),
                     .roulette_gave = energy.roulette_gave(),
                     .roulette_took = energy.roulette_took(),
                     .absorbed = energy.absorbed(),
                     .escaped = energy.escaped(),
                     .smoothing = energy.smoothing(),
                     .cut_off = energy.cut_off(),
                     .dropped = energy.dropped()},
          .lights = std::move(lights)};
}

google::protobuf::Duration ToProto(Duration duration) {
  google::protobuf::Duration message;
  message.set_seconds(duration.count() / kNanosPerSecond);
  message.set_nanos(static_cast<std::int32_t>(duration.count() % kNanosPerSecond));
  return message;
}

Duration FromProto(const google::protobuf::Duration& message) {
  if (message.seconds() < 0 || message.nanos() < 0) return Duration::zero();
  return std::chrono::seconds(std::min(message.seconds(), kLongestSeconds)) +
         std::chrono::nanoseconds(
             std::min(message.nanos(), static_cast<std::int32_t>(kNanosPerSecond - 1)));
}

google::protobuf::Timestamp ToProto(WallTime time) {
  const Duration since_epoch = time.time_since_epoch();
  google::protobuf::Timestamp message;
  message.set_seconds(since_epoch.count() / kNanosPerSecond);
  message.set_nanos(static_cast<std::int32_t>(since_epoch.count() % kNanosPerSecond));
  return message;
}

}  // namespace lucerna
