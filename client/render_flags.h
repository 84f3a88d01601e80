// What did the user say about the render?
//
// The flags that commands which render share, as they were typed, and their meaning as
// RenderOverrides. What is not given is left to the scene file, then to the defaults.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "render/base/status.h"
#include "render/scene/render_settings.h"

namespace CLI {
class App;
}  // namespace CLI

namespace lucerna {

struct RenderFlags {
  std::optional<std::string> size;  // "640x480"
  std::optional<std::int64_t> passes;
  std::optional<std::int64_t> photons_per_pass;
  std::optional<double> time_s;
  std::optional<std::string> error;  // "2%" or "0.02"
  std::optional<std::uint64_t> photons;
  std::optional<std::uint64_t> seed;
  std::optional<std::string> radius_controller;
  std::optional<double> alpha;
  std::optional<std::string> kernel;
  std::optional<std::string> bias, frequency_share;  // "2%" or "0.02"
  std::optional<std::string> initial_radius;         // scene units, "1.5px", or "auto"
  std::optional<int> max_depth;
  bool use_everything = false;
};

// Gives `command` the flags that decide what the pixels are, and those that say when to stop.
// `flags` outlives the command.
void AddImageFlags(CLI::App& command, RenderFlags& flags);
void AddStopFlags(CLI::App& command, RenderFlags& flags);

// `flags` with what `words`, like "--alpha 0.5 --kernel constant", says otherwise. When to stop
// cannot be said.
// Errors: Failure(kUsage).
[[nodiscard]] StatusOr<RenderFlags> WithImageFlags(RenderFlags flags, const std::string& words);

// Errors: Failure(kUsage) that names the flag. Ranges that depend on the scene are for
// ResolveSettings to check.
[[nodiscard]] StatusOr<RenderOverrides> ToOverrides(const RenderFlags& flags);

}  // namespace lucerna
