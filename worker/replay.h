// What did those photons of that job do?
//
// Traces photons of a job again, with the scene and settings that its coordinator still has, and
// tells the ways they took. Needs neither hitpoints nor radii, so a job may be over: a photon's
// walk is a function of scene, settings, photon guide, pass and index.
#pragma once

#include <cstdint>
#include <string>

#include "proto/lucerna/v1/photons.pb.h"
#include "render/analysis/needs.h"
#include "render/base/clock.h"
#include "render/base/status.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"
#include "render/transport/photon_guide.h"
#include "render/wire/channel.h"

namespace lucerna {

struct ReplayOptions {
  Endpoint server;
  Duration connect_timeout{};
  std::string numeric_profile;
  std::string job_id;
  std::uint64_t pass = 0;
  std::uint64_t index = 0;  // of the first
  std::uint64_t count = 1;
};

// Errors: UNAVAILABLE when no coordinator answers, NOT_FOUND when it does not have the job or its
// scene any more, FAILED_PRECONDITION when its numeric profile is another, OUT_OF_RANGE for a
// photon that no pass of the job has.
[[nodiscard]] StatusOr<v1::PhotonPaths> Replay(const ReplayOptions& options);

// `count` photons of a pass, from `first` on.
struct PhotonRange {
  std::uint64_t pass = 0, first = 0, count = 1;
};
// The same of a scene that is at hand, in Rec. 709; the pass has `photons_per_pass`, drawn by
// `guide` (nullptr: evenly).
[[nodiscard]] StatusOr<v1::PhotonPaths> ReplayInScene(Scene scene, const RenderSettings& settings,
                                                      const SceneNeeds& needs, PhotonRange photons,
                                                      std::uint64_t photons_per_pass,
                                                      const PhotonGuide* guide = nullptr);

}  // namespace lucerna
