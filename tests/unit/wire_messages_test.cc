// A value must survive the journey through a message, and a message that no program of ours would
// send must be refused.
#include <cmath>
#include <limits>

#include "gtest/gtest.h"
#include <google/protobuf/unknown_field_set.h>

#include "render/wire/channel.h"
#include "render/wire/grpc_status.h"
#include "render/wire/messages.h"
#include "tests/support/job_settings.h"

namespace lucerna {
namespace {

RenderSettings SomeSettings() {
  RenderSettings settings;
  settings.width = 640;
  settings.height = 480;
  settings.crop_x0 = 10;
  settings.crop_y0 = 20;
  settings.crop_x1 = 630;
  settings.crop_y1 = 460;
  settings.passes = 7;
  settings.time_s = 2.5;
  settings.photons_per_pass = 123'456;
  settings.seed = ~std::uint64_t{0};
  settings.radius_controller = RadiusControllerKind::kPppm;
  settings.alpha = 0.7;
  settings.kernel = KernelKind::kConstant;
  settings.initial_footprints = 1.5;
  settings.bias = 0.1;
  settings.frequency_share = 1;
  settings.use_everything = true;
  settings.spectral = true;
  settings.max_depth = 12;
  return settings;
}

SceneManifest SomeManifest() {
  SceneManifest manifest;
  manifest.main_path = "scene.pbrt";
  manifest.entries["scene.pbrt"] = {Sha256("scene"), 5};
  manifest.entries["models/a mesh.ply"] = {Sha256("mesh"), 4};
  return manifest;
}

TEST(MessagesTest, SettingsComeBack) {
  const auto settings = FromProto(ToProto(SomeSettings()));
  ASSERT_TRUE(settings.ok()) << settings.status();
  EXPECT_EQ(*settings, SomeSettings());
  RenderSettings other = SomeSettings();
  other.initial_radius = 0.01;
  other.initial_footprints = kInitialFootprints;
  EXPECT_EQ(FromProto(ToProto(other)).value(), other);
}

TEST(MessagesTest, AnUnknownSettingIsNamed) {
  v1::RenderOverrides overrides;
  v1::Setting& item = *overrides.add_settings();
  item.set_name("importons");
  item.set_value("5");
  const Status status = FromProto(overrides).status();
  EXPECT_TRUE(absl::IsInvalidArgument(status));
  EXPECT_NE(status.message().find("unknown setting \"importons\""), std::string::npos) << status;
  v1::RenderSettings settings = ToProto(SomeSettings());
  *settings.add_settings() = item;
  EXPECT_EQ(FromProto(settings).status(), status);
}

// Version 0.1 sent one field for each setting: here `passes` of its overrides, `alpha` of its
// settings.
TEST(MessagesTest, SettingsInTheFormOfAnOlderVersionAreRefused) {
  v1::RenderOverrides overrides = ToProto(RenderOverrides());
  overrides.GetReflection()->MutableUnknownFields(&overrides)->AddVarint(3, 7);
  EXPECT_TRUE(absl::IsInvalidArgument(FromProto(overrides).status()));
  v1::RenderSettings settings = ToProto(SomeSettings());
  settings.GetReflection()->MutableUnknownFields(&settings)->AddFixed64(12, 0);
  EXPECT_TRUE(absl::IsInvalidArgument(FromProto(settings).status()));
}

TEST(MessagesTest, AMissingSettingIsNamed) {
  v1::RenderSettings message = ToProto(SomeSettings());
  message.mutable_settings()->RemoveLast();
  const Status status = FromProto(message).status();
  EXPECT_NE(status.message().find("setting \"denoise\" is missing"), std::string::npos) << status;
}

TEST(MessagesTest, SettingsToShowAreThoseThatCanBeRead) {
  v1::Job job;
  EXPECT_EQ(SettingsOf(job).passes, 0) << "no limit is known";
  *job.mutable_settings() =
      WithSettingText(WithSettingText(ToProto(SomeSettings()), "alpha", "many"), "passes", "");
  job.mutable_settings()->add_settings()->set_name("importons");
  RenderSettings expected = SomeSettings();
  expected.alpha = RenderSettings().alpha;
  expected.passes = 0;
  EXPECT_EQ(SettingsOf(job), expected);
}

TEST(MessagesTest, NeedsComeBackWithoutTheirReasons) {
  const SceneNeeds needs(0b1011, 64, {{1, 5}, {2}});
  const auto back = FromProto(ToProto(needs));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(*back, needs);
  EXPECT_TRUE(back->Uses(Part::kPhotons));
  EXPECT_TRUE(back->Uses(Part::kSpecular));
  EXPECT_FALSE(back->Uses(Part::kGlossy));
}

TEST(MessagesTest, HostileNeedsAreRefused) {
  const auto is_refused = [](auto change) {
    v1::SceneNeeds message = ToProto(SceneNeeds(1, 64, {{1, 5}, {2}}));
    change(message);
    return absl::IsInvalidArgument(FromProto(message).status());
  };
  EXPECT_FALSE(is_refused([](auto&) {}));
  EXPECT_TRUE(is_refused([](auto& m) { m.set_parts(std::uint64_t{1} << kPartCount); }));
  EXPECT_TRUE(is_refused([](auto& m) { m.set_eye_sample_sets(-1); }));
  EXPECT_TRUE(is_refused([](auto& m) { m.set_eye_sample_sets(65'537); }));
  EXPECT_TRUE(is_refused([](auto& m) { m.add_lights_without_photons(3); }));
  EXPECT_TRUE(is_refused([](auto& m) { m.add_lights_without_sampling(1); }));
}

TEST(MessagesTest, HostileSettingsAreRefused) {
  const auto is_refused = [](auto change) {
    v1::RenderSettings message = ToProto(SomeSettings());
    change(message);
    return absl::IsInvalidArgument(FromProto(message).status());
  };
  EXPECT_FALSE(is_refused([](auto&) {}));
  EXPECT_TRUE(is_refused([](auto& m) { m.set_crop_x1(641); }));
  EXPECT_TRUE(is_refused([](auto& m) { m.set_crop_x0(-1); }));
  EXPECT_TRUE(is_refused([](auto& m) { m.set_crop_y0(460); }));
  const auto is_text_refused = [&](std::string_view name, std::string_view text) {
    return is_refused([&](auto& m) { m = WithSettingText(m, name, text); });
  };
  EXPECT_TRUE(is_text_refused("size", "0x480"));
  EXPECT_TRUE(is_text_refused("size", "640x65537"));
  EXPECT_TRUE(is_text_refused("passes", "-1"));
  EXPECT_TRUE(is_text_refused("time_s", "nan"));
  EXPECT_TRUE(is_text_refused("time_s", "inf"));
  EXPECT_TRUE(is_text_refused("time_s", "-1"));
  EXPECT_TRUE(is_text_refused("error", "11"));
  EXPECT_TRUE(is_text_refused("photons", "-1"));
  EXPECT_TRUE(is_text_refused("photons_per_pass", "0"));
  EXPECT_TRUE(is_text_refused("photons_per_pass", "1000000000001"));
  EXPECT_TRUE(is_text_refused("alpha", "nan"));
  EXPECT_TRUE(is_text_refused("alpha", "1"));
  EXPECT_TRUE(is_text_refused("kernel", "cubic"));
  EXPECT_TRUE(is_text_refused("radius_controller", ""));
  EXPECT_TRUE(is_text_refused("initial_radius", "-1"));
  EXPECT_TRUE(is_text_refused("initial_radius", "0px"));
  EXPECT_TRUE(is_text_refused("bias", "0"));
  EXPECT_TRUE(is_text_refused("frequency_share", "1.1"));
  EXPECT_TRUE(is_text_refused("max_depth", "0"));
  EXPECT_FALSE(is_text_refused("passes", "0")) << "no limit";
}

TEST(MessagesTest, OverridesComeBackWithWhatIsAbsent) {
  RenderOverrides overrides;
  overrides.passes = 0;
  overrides.kernel = KernelKind::kConstant;
  overrides.initial_radius = 0;
  overrides.initial_footprints = 1.5;
  const auto back = FromProto(ToProto(overrides));
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->passes, overrides.passes);
  EXPECT_EQ(back->kernel, overrides.kernel);
  EXPECT_EQ(back->initial_radius, overrides.initial_radius);
  EXPECT_EQ(back->initial_footprints, overrides.initial_footprints);
  EXPECT_FALSE(back->width || back->height || back->photons_per_pass || back->time_s ||
               back->seed || back->radius_controller || back->alpha || back->max_depth);
  v1::RenderOverrides hostile;
  hostile.add_settings()->set_name("alpha");
  hostile.mutable_settings(0)->set_value("nan");
  EXPECT_FALSE(FromProto(hostile).ok());
}

TEST(MessagesTest, AManifestComesBack) {
  const auto manifest = FromProto(ToProto(SomeManifest()));
  ASSERT_TRUE(manifest.ok()) << manifest.status();
  EXPECT_EQ(*manifest, SomeManifest());
  EXPECT_EQ(manifest->SceneDigest(), SomeManifest().SceneDigest());
}

TEST(MessagesTest, HostileManifestsAreRefused) {
  const auto is_refused = [](auto change) {
    v1::SceneManifest message = ToProto(SomeManifest());
    change(message);
    return !FromProto(message).ok();
  };
  EXPECT_TRUE(is_refused([](auto& m) { m.mutable_entries(0)->set_path("../secret"); }));
  EXPECT_TRUE(is_refused([](auto& m) { m.mutable_entries(0)->set_path("/etc/passwd"); }));
  EXPECT_TRUE(is_refused([](auto& m) { m.mutable_entries(0)->set_digest("short"); }));
  EXPECT_TRUE(is_refused([](auto& m) { *m.add_entries() = m.entries(0); })) << "twice";
  EXPECT_TRUE(is_refused([](auto& m) { m.set_main_path("other.pbrt"); }));
  EXPECT_TRUE(is_refused([](auto& m) {
    for (int i = 0; i < 2; ++i)
      m.mutable_entries(i)->set_size_bytes(~std::uint64_t{0} / 2 + 1);
  })) << "the sum of the sizes wraps";
}

TEST(MessagesTest, DurationsComeBackAndHostileOnesAreBounded) {
  for (const std::int64_t ns : {0L, 1L, 999'999'999L, 1'000'000'000L, 123'456'789'012'345L}) {
    EXPECT_EQ(FromProto(ToProto(Duration(ns))), Duration(ns));
  }
  google::protobuf::Duration hostile;
  hostile.set_seconds(std::numeric_limits<std::int64_t>::max());
  hostile.set_nanos(std::numeric_limits<std::int32_t>::max());
  EXPECT_GT(FromProto(hostile), Duration::zero());
  hostile.set_seconds(-5);
  EXPECT_EQ(FromProto(hostile), Duration::zero());
}

TEST(MessagesTest, AStatusCrossesWithItsMessageAndALongOneIsCutAtALine) {
  const Status status = absl::FailedPreconditionError("a sentence");
  EXPECT_EQ(FromGrpc(ToGrpc(status)), status);
  EXPECT_TRUE(FromGrpc(ToGrpc(absl::OkStatus())).ok());
  std::string many;
  for (int i = 0; i < 1000; ++i)
    many += "scene.pbrt:1:1: error: wrong\n";
  const grpc::Status cut = ToGrpc(absl::InvalidArgumentError(many));
  EXPECT_LT(cut.error_message().size(), 7000U);
  EXPECT_TRUE(cut.error_message().ends_with("wrong\n(and more)"));
}

TEST(ChannelTest, KnowsWhatStaysOnThisMachine) {
  for (const char* address : {"127.0.0.1:7400", "127.1.2.3:0", "localhost:7400", "[::1]:7400"}) {
    EXPECT_TRUE(IsLoopback(address)) << address;
  }
  for (const char* address : {"0.0.0.0:7400", "192.168.1.1:7400", "[::]:7400", "example.org:7400",
                              ":7400", "127.0.0.1.example.org:7400"}) {
    EXPECT_FALSE(IsLoopback(address)) << address;
  }
}

TEST(ChannelTest, AnAddressHasAHostAndAPortThatExists) {
  for (const char* address : {"127.0.0.1:7400", "[::1]:0", "farm.example:65535"}) {
    EXPECT_TRUE(IsAddress(address)) << address;
  }
  for (const char* address :
       {"", "farm", ":7400", "farm:", "farm:65536", "farm:7400x", "farm:-1"}) {
    EXPECT_FALSE(IsAddress(address)) << address;
  }
}

TEST(WireMessagesTest, CarriesEveryCounterInAFieldOfItsName) {
  BatchTally tally;
  std::uint64_t next = 1;
  for (const auto& counter : kBatchCounters)
    tally.*counter.value = next++;
  for (const auto& counter : kEnergyCounters)
    tally.energy.*counter.value = -static_cast<std::int64_t>(next++);
  EXPECT_EQ(FromProto(ToProto(tally)), tally);
  EXPECT_EQ(ToProto(tally).excess(), tally.excess);
  EXPECT_EQ(ToProto(tally).energy().cut_off(), tally.energy.cut_off);
}

TEST(WireMessagesTest, ATallyKeepsItsLights) {
  BatchTally tally;
  tally.photons = 10;
  tally.lights.resize(2);
  tally.lights[0].sent = 4;
  tally.lights[0].in_view = {1, 2};
  tally.lights[1].sent = 6;
  EXPECT_EQ(FromProto(ToProto(tally)), tally);
  v1::Tally message = ToProto(tally);
  for (int i = 0; i < 100; ++i)
    message.add_lights();
  EXPECT_EQ(FromProto(message).lights.size(), kMaxLightTallies);
}

TEST(WireMessagesTest, RefusesABakeOfAnotherVersion) {
  const BakeSettings settings = {.materials = {"floor"}, .tolerance = 0.125};
  const v1::BakeSettings message = ToProto(settings);
  EXPECT_EQ(FromProto(message).value(), settings);
  v1::BakeSettings other = message;
  other.set_estimator(static_cast<v1::BakeEstimator>(99));
  EXPECT_FALSE(FromProto(other).ok());
  other = message;
  other.set_sides(static_cast<v1::MeasuredSides>(99));
  EXPECT_FALSE(FromProto(other).ok());
}

}  // namespace
}  // namespace lucerna
