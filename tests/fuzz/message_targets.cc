// Any bytes as messages of clients and coordinators: no crash, and what is accepted comes back from
// its own message.
#include <cstdint>

#include "render/wire/messages.h"
#include "tests/fuzz/fuzz_targets.h"
#include "tests/fuzz/scene_from_bytes.h"

namespace lucerna {
namespace {

template <typename Message>
bool Parse(std::string_view bytes, Message& message) {
  return message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

bool ReadsOverrides(std::string_view bytes) {
  v1::RenderOverrides message;
  if (!Parse(bytes, message)) return false;
  const auto overrides = FromProto(message);
  if (!overrides.ok()) return false;
  const std::string again = ToProto(*overrides).SerializeAsString();
  v1::RenderOverrides same;
  LUCERNA_CHECK(same.ParseFromString(again));
  LUCERNA_CHECK(ToProto(FromProto(same).value()).SerializeAsString() == again);
  return true;
}

bool ReadsSettings(std::string_view bytes) {
  v1::Job job;
  if (!Parse(bytes, *job.mutable_settings())) return false;
  static_cast<void>(SettingsOf(job));
  const auto settings = FromProto(job.settings());
  if (!settings.ok()) return false;
  LUCERNA_CHECK(0 <= settings->crop_x0 && settings->crop_x0 < settings->crop_x1 &&
                settings->crop_x1 <= settings->width);
  const v1::RenderSettings again = ToProto(*settings);
  LUCERNA_CHECK(ToProto(FromProto(again).value()).SerializeAsString() == again.SerializeAsString());
  return true;
}

bool ReadsNeeds(std::string_view bytes) {
  v1::SceneNeeds message;
  if (!Parse(bytes, message)) return false;
  const auto needs = FromProto(message);
  if (!needs.ok()) return false;
  const v1::SceneNeeds again = ToProto(*needs);
  LUCERNA_CHECK(ToProto(FromProto(again).value()).SerializeAsString() == again.SerializeAsString());
  return true;
}

bool ReadsTally(std::string_view bytes) {
  v1::Tally message;
  if (!Parse(bytes, message)) return false;
  const v1::Tally again = ToProto(FromProto(message));
  LUCERNA_CHECK(ToProto(FromProto(again)).SerializeAsString() == again.SerializeAsString());
  return true;
}

bool ReadsDuration(std::string_view bytes) {
  google::protobuf::Duration message;
  if (!Parse(bytes, message)) return false;
  const Duration duration = FromProto(message);
  LUCERNA_CHECK(duration >= Duration::zero());
  static_cast<void>(ToProto(duration));
  return true;
}

constexpr auto kReaders = {ReadsOverrides, ReadsSettings, ReadsNeeds, ReadsTally, ReadsDuration};

std::string Seed(char reader, const std::string& message) {
  return std::string(1, reader) + message;
}

}  // namespace

bool FuzzMessages(std::string_view bytes) {
  if (bytes.empty()) return false;
  const std::size_t reader = static_cast<std::uint8_t>(bytes.front()) % kReaders.size();
  return kReaders.begin()[reader](bytes.substr(1));
}

std::vector<std::string> MessagesSeeds() {
  RenderOverrides overrides;
  overrides.passes = 12;
  overrides.width = 64;
  overrides.height = 48;
  const ParsedScene scene =
      SceneFromBytes("Camera \"perspective\"\nWorldBegin\nShape \"sphere\"\n");
  const RenderSettings settings = ResolveSettings({}, scene.scene).value();
  BatchTally tally;
  tally.photons = 1000;
  tally.dropped = 3;
  tally.lights.resize(2);
  tally.lights[0].sent = 999;
  return {Seed(0, ToProto(overrides).SerializeAsString()),
          Seed(1, ToProto(settings).SerializeAsString()),
          Seed(2, ToProto(SceneNeeds(5, 16, {{0, 3}, {1}})).SerializeAsString()),
          Seed(3, ToProto(tally).SerializeAsString()),
          Seed(4, ToProto(Duration(std::chrono::milliseconds(12'345))).SerializeAsString())};
}

bool FuzzManifest(std::string_view bytes) {
  v1::SceneManifest message;
  if (!Parse(bytes, message)) return false;
  SceneLimits limits;
  limits.max_files = 100;
  limits.max_total_bytes = 1 << 20;
  const auto manifest = FromProto(message, limits);
  if (!manifest.ok()) return false;
  LUCERNA_CHECK(manifest->entries.contains(manifest->main_path));
  std::uint64_t total_bytes = 0;
  for (const auto& [path, entry] : manifest->entries) {
    LUCERNA_CHECK(CheckLogicalPath(path).ok());
    total_bytes += entry.size_bytes;
  }
  LUCERNA_CHECK(manifest->entries.size() <= limits.max_files &&
                total_bytes <= limits.max_total_bytes);
  const auto same = FromProto(ToProto(*manifest), limits);
  LUCERNA_CHECK(same.ok() && *same == *manifest && same->SceneDigest() == manifest->SceneDigest());
  return true;
}

std::vector<std::string> ManifestSeeds() {
  SceneManifest manifest;
  manifest.main_path = "scene.pbrt";
  for (const char* path : {"scene.pbrt", "meshes/ball.ply", "sky.exr"})
    manifest.entries[path] = {Sha256(path), 1234};
  return {ToProto(manifest).SerializeAsString()};
}

}  // namespace lucerna
