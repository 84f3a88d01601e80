#include "render/wire/messages.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/unknown_field_set.h>

#include "render/base/text.h"
#include "render/scene/setting_table.h"
#include "render/wire/photon_guide_codec.h"

namespace lucerna {
namespace {

constexpr int kMostEyeSets = 65'536;
constexpr std::int64_t kLongestSeconds = 9'000'000'000;  // fits in Duration
constexpr std::int64_t kNanosPerSecond = 1'000'000'000;

bool IsBetween(double value, double low, double high) {
  return value >= low && value <= high;
}

// Texts from outside are shown up to this length.
constexpr std::size_t kMaxShownText = 64;

Status OtherVersion(std::string_view what) {
  return absl::InvalidArgumentError(
      Concat(what, "; the programs are of different versions, use the same build everywhere"));
}

using SettingList = google::protobuf::RepeatedPtrField<v1::Setting>;

void AddSetting(const Setting& setting, std::string text, SettingList& list) {
  v1::Setting& item = *list.Add();
  item.set_name(std::string(setting.name));
  item.set_value(std::move(text));
}

// Fields of older versions would be overlooked otherwise.
template <typename Message>
Status CheckHasNoOtherFields(const Message& message) {
  if (message.GetReflection()->GetUnknownFields(message).empty()) return absl::OkStatus();
  return OtherVersion("the job has settings in another form");
}

Status ReadSettings(const SettingList& list, RenderOverrides& overrides) {
  for (const v1::Setting& item : list) {
    const Setting* setting = FindSetting(item.name());
    if (setting == nullptr) {
      return OtherVersion(Concat("unknown setting \"", item.name().substr(0, kMaxShownText), "\""));
    }
    LUCERNA_RETURN_IF_ERROR(ParseSetting(*setting, item.value(), overrides));
  }
  return absl::OkStatus();
}

// The fields of a message that have the names of counters (estimate/accumulation.h).
template <typename Message>
const google::protobuf::FieldDescriptor* FieldOf(const Message& message, std::string_view counter) {
  const auto* field = message.GetDescriptor()->FindFieldByName(std::string(counter));
  LUCERNA_CHECK(field != nullptr);
  return field;
}

template <typename Counters, typename Owner, typename Message>
void PutCounters(const Counters& counters, const Owner& owner, Message& message) {
  for (const auto& counter : counters) {
    const auto* field = FieldOf(message, counter.name);
    const auto value = owner.*counter.value;
    if constexpr (std::is_signed_v<decltype(value)>) {
      message.GetReflection()->SetInt64(&message, field, value);
    } else {
      message.GetReflection()->SetUInt64(&message, field, value);
    }
  }
}

template <typename Counters, typename Message, typename Owner>
void TakeCounters(const Counters& counters, const Message& message, Owner& owner) {
  for (const auto& counter : counters) {
    const auto* field = FieldOf(message, counter.name);
    if constexpr (std::is_signed_v<std::remove_reference_t<decltype(owner.*counter.value)>>) {
      owner.*counter.value = message.GetReflection()->GetInt64(message, field);
    } else {
      owner.*counter.value = message.GetReflection()->GetUInt64(message, field);
    }
  }
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
  for (const Setting& setting : AllSettings()) {
    std::optional<std::string> text = SettingText(setting, overrides);
    if (text) AddSetting(setting, *std::move(text), *message.mutable_settings());
  }
  return message;
}

StatusOr<RenderOverrides> FromProto(const v1::RenderOverrides& message) {
  LUCERNA_RETURN_IF_ERROR(CheckHasNoOtherFields(message));
  RenderOverrides overrides;
  LUCERNA_RETURN_IF_ERROR(ReadSettings(message.settings(), overrides));
  return overrides;
}

v1::RenderSettings ToProto(const RenderSettings& settings) {
  v1::RenderSettings message;
  message.set_crop_x0(settings.crop_x0);
  message.set_crop_y0(settings.crop_y0);
  message.set_crop_x1(settings.crop_x1);
  message.set_crop_y1(settings.crop_y1);
  for (const Setting& setting : AllSettings())
    AddSetting(setting, SettingText(setting, settings), *message.mutable_settings());
  return message;
}

StatusOr<RenderSettings> FromProto(const v1::RenderSettings& message) {
  LUCERNA_RETURN_IF_ERROR(CheckHasNoOtherFields(message));
  RenderOverrides given;
  LUCERNA_RETURN_IF_ERROR(ReadSettings(message.settings(), given));
  RenderSettings settings;
  for (const Setting& setting : AllSettings()) {
    if (!IsGiven(setting, given)) {
      return OtherVersion(Concat(NameInMessage(setting), " is missing"));
    }
    ResolveSetting(setting, given, nullptr, settings);
    if (IsNoLimit(setting, settings)) continue;
    LUCERNA_RETURN_IF_ERROR(CheckSetting(setting, settings));
  }
  settings.crop_x0 = message.crop_x0();
  settings.crop_y0 = message.crop_y0();
  settings.crop_x1 = message.crop_x1();
  settings.crop_y1 = message.crop_y1();
  if (settings.crop_x0 < 0 || settings.crop_x0 >= settings.crop_x1 ||
      settings.crop_x1 > settings.width || settings.crop_y0 < 0 ||
      settings.crop_y0 >= settings.crop_y1 || settings.crop_y1 > settings.height) {
    return absl::InvalidArgumentError("the crop window is not within the image");
  }
  return settings;
}

void AddLaterSettings(v1::RenderSettings& message) {
  for (const Setting& setting : AllSettings()) {
    const bool is_there = std::ranges::any_of(
        message.settings(), [&](const v1::Setting& item) { return item.name() == setting.name; });
    if (is_there) continue;
    if (std::holds_alternative<CropFields>(setting.type)) {
      // Parts of an image are older than their setting, in fields of their own.
      AddSetting(setting,
                 Concat(message.crop_x0(), ",", message.crop_x1(), ",", message.crop_y0(), ",",
                        message.crop_y1()),
                 *message.mutable_settings());
    } else if (!setting.in_older_jobs.empty()) {
      AddSetting(setting, std::string(setting.in_older_jobs), *message.mutable_settings());
    }
  }
}

RenderSettings SettingsOf(const v1::Job& job) {
  const v1::RenderSettings& message = job.settings();
  RenderOverrides given;
  given.passes = 0;
  for (const v1::Setting& item : message.settings()) {
    const Setting* setting = FindSetting(item.name());
    if (setting != nullptr) ParseSetting(*setting, item.value(), given).IgnoreError();
  }
  RenderSettings settings;
  for (const Setting& setting : AllSettings())
    ResolveSetting(setting, given, nullptr, settings);
  settings.crop_x0 = message.crop_x0();
  settings.crop_y0 = message.crop_y0();
  settings.crop_x1 = message.crop_x1();
  settings.crop_y1 = message.crop_y1();
  return settings;
}

v1::PhotonStep ToProto(const PhotonStep& step) {
  v1::PhotonStep message;
  message.set_first_pass(step.first_pass);
  message.set_photons_per_pass(step.photons_per_pass);
  return message;
}

v1::GuideStep ToProto(const GuideStep& step) {
  v1::GuideStep message;
  message.set_first_pass(step.first_pass);
  message.set_guide(EncodePhotonGuide(*step.guide));
  return message;
}

StatusOr<GuideSteps> FromProto(const google::protobuf::RepeatedPtrField<v1::GuideStep>& messages) {
  GuideSteps steps;
  for (const v1::GuideStep& message : messages) {
    LUCERNA_ASSIGN_OR_RETURN(PhotonGuide guide, DecodePhotonGuide(message.guide()));
    steps.push_back({message.first_pass(), std::make_shared<const PhotonGuide>(std::move(guide))});
  }
  return steps;
}

v1::BakeSettings ToProto(const BakeSettings& settings) {
  v1::BakeSettings message;
  message.set_estimator(static_cast<v1::BakeEstimator>(settings.estimator));
  message.set_sides(static_cast<v1::MeasuredSides>(settings.sides));
  message.mutable_materials()->Assign(settings.materials.begin(), settings.materials.end());
  if (settings.spacing) message.set_spacing(*settings.spacing);
  message.set_is_quadratic(settings.elements == MeshElements::kQuadratic);
  message.set_tolerance(settings.tolerance);
  message.set_keeps_vertices(!settings.decimates);
  message.set_indirect_only(settings.indirect_only);
  message.set_is_light_map(settings.is_light_map);
  return message;
}

StatusOr<BakeSettings> FromProto(const v1::BakeSettings& message) {
  LUCERNA_RETURN_IF_ERROR(CheckHasNoOtherFields(message));
  if (!v1::BakeEstimator_IsValid(message.estimator()) ||
      !v1::MeasuredSides_IsValid(message.sides())) {
    return OtherVersion("an estimator or sides of a bake are not known");
  }
  BakeSettings settings;
  settings.estimator = static_cast<BakeEstimator>(message.estimator());
  settings.sides = static_cast<MeasuredSides>(message.sides());
  settings.materials.assign(message.materials().begin(), message.materials().end());
  if (message.has_spacing()) settings.spacing = message.spacing();
  settings.elements = message.is_quadratic() ? MeshElements::kQuadratic : MeshElements::kLinear;
  settings.tolerance = message.tolerance();
  settings.decimates = !message.keeps_vertices();
  settings.indirect_only = message.indirect_only();
  settings.is_light_map = message.is_light_map();
  return settings;
}

v1::SurfaceFigures ToProto(const SurfaceFigures& figures) {
  v1::SurfaceFigures message;
  message.set_name(figures.name);
  message.set_triangles(figures.triangles);
  message.set_area(figures.area);
  message.set_lowest(figures.lowest);
  message.set_highest(figures.highest);
  message.set_mean(figures.mean);
  return message;
}

SurfaceFigures FromProto(const v1::SurfaceFigures& message) {
  return {.name = message.name(),
          .triangles = message.triangles(),
          .area = message.area(),
          .lowest = message.lowest(),
          .highest = message.highest(),
          .mean = message.mean()};
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
  if (message.parts() >> kPartCount != 0) {
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
  PutCounters(kBatchCounters, tally, message);
  PutCounters(kEnergyCounters, tally.energy, *message.mutable_energy());
  for (const LightTally& light : tally.lights) {
    v1::LightTally& item = *message.add_lights();
    item.set_sent(light.sent);
    item.set_in_view_caustic(light.InView(PathClass::kCaustic));
    item.set_in_view_other(light.InView(PathClass::kOther));
  }
  return message;
}

EnergyCounters FromProto(const v1::Energy& message) {
  EnergyCounters energy;
  TakeCounters(kEnergyCounters, message, energy);
  return energy;
}

BatchTally FromProto(const v1::Tally& message) {
  BatchTally tally;
  TakeCounters(kBatchCounters, message, tally);
  tally.energy = FromProto(message.energy());
  for (const v1::LightTally& light : message.lights()) {
    if (tally.lights.size() == kMaxLightTallies) break;
    tally.lights.push_back({light.sent(), {light.in_view_caustic(), light.in_view_other()}});
  }
  return tally;
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
