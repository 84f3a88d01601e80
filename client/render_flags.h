// What did the user say about the render?
//
// The flags that `render` and `submit` share, as they were typed, and their meaning as
// RenderOverrides. What is not given is left to the scene file, then to the defaults.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "render/base/status.h"
#include "render/scene/render_settings.h"

namespace lucerna {

struct RenderFlags {
  std::optional<std::string> size;  // "640x480"
  std::optional<std::int64_t> passes;
  std::optional<std::int64_t> photons_per_pass;
  std::optional<double> time_s;
  std::optional<std::uint64_t> seed;
  std::optional<std::string> radius_controller;
  std::optional<double> alpha;
  std::optional<std::string> kernel;
  std::optional<std::string> bias, frequency_share;  // "2%" or "0.02"
  std::optional<std::string> initial_radius;         // scene units, or "auto"
  std::optional<int> max_depth;
};

// Errors: Failure(kUsage) that names the flag. Ranges that depend on the scene are for
// ResolveSettings to check.
[[nodiscard]] StatusOr<RenderOverrides> ToOverrides(const RenderFlags& flags);

}  // namespace lucerna
