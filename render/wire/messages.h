// Values to and from messages; messages are checked.
//
// ToProto never fails. FromProto checks every field and gives back a value that keeps all promises
// of its type, or INVALID_ARGUMENT with one sentence.
#pragma once

#include "proto/lucerna/v1/jobs.pb.h"
#include "proto/lucerna/v1/values.pb.h"
#include "render/analysis/needs.h"
#include "render/bake/bake_settings.h"
#include "render/bake/surface_figures.h"
#include "render/base/clock.h"
#include "render/base/status.h"
#include "render/estimate/accumulation.h"
#include "render/estimate/guide_learning.h"
#include "render/estimate/photon_steps.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene_files.h"

namespace lucerna {

[[nodiscard]] v1::PhotonStep ToProto(const PhotonStep& step);
[[nodiscard]] v1::GuideStep ToProto(const GuideStep& step);
[[nodiscard]] StatusOr<GuideSteps> FromProto(
    const google::protobuf::RepeatedPtrField<v1::GuideStep>& messages);

[[nodiscard]] v1::SceneManifest ToProto(const SceneManifest& manifest);
// Also holds the manifest to `limits`, and its main file to be one of its files.
[[nodiscard]] StatusOr<SceneManifest> FromProto(const v1::SceneManifest& message,
                                                const SceneLimits& limits = {});

[[nodiscard]] v1::RenderOverrides ToProto(const RenderOverrides& overrides);
// Ranges are for ResolveSettings to check; here numbers are finite and names are known.
// Errors: INVALID_ARGUMENT that names an unknown setting.
[[nodiscard]] StatusOr<RenderOverrides> FromProto(const v1::RenderOverrides& message);

[[nodiscard]] v1::RenderSettings ToProto(const RenderSettings& settings);
// Checks ranges too. Errors: INVALID_ARGUMENT, also for a setting that is unknown or missing.
[[nodiscard]] StatusOr<RenderSettings> FromProto(const v1::RenderSettings& message);
// For a job that was kept by an earlier build: adds the settings that came since, with the values
// that render as that build did. Others that are missing stay so.
void AddLaterSettings(v1::RenderSettings& message);
// The job's settings to show to a user: what cannot be read has its default, and a stop criterion
// that cannot be read is none.
[[nodiscard]] RenderSettings SettingsOf(const v1::Job& job);

[[nodiscard]] v1::BakeSettings ToProto(const BakeSettings& settings);
// Errors: INVALID_ARGUMENT for an estimator or sides of another version.
[[nodiscard]] StatusOr<BakeSettings> FromProto(const v1::BakeSettings& message);
[[nodiscard]] v1::SurfaceFigures ToProto(const SurfaceFigures& figures);
[[nodiscard]] SurfaceFigures FromProto(const v1::SurfaceFigures& message);

[[nodiscard]] v1::SceneNeeds ToProto(const SceneNeeds& needs);
// Without reasons. Numbers of lights that the scene does not have say nothing.
[[nodiscard]] StatusOr<SceneNeeds> FromProto(const v1::SceneNeeds& message);

[[nodiscard]] v1::Tally ToProto(const BatchTally& tally);
[[nodiscard]] BatchTally FromProto(const v1::Tally& message);
[[nodiscard]] EnergyCounters FromProto(const v1::Energy& message);

[[nodiscard]] google::protobuf::Duration ToProto(Duration duration);
// Negative durations and such as do not fit become 0 and the longest there is.
[[nodiscard]] Duration FromProto(const google::protobuf::Duration& message);

[[nodiscard]] google::protobuf::Timestamp ToProto(WallTime time);

}  // namespace lucerna
