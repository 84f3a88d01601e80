// Cases of `lucerna selfcheck` that compare the mean of an image with what a formula says.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "client/selfcheck/selfcheck_case.h"

namespace lucerna {

using CaseRun = std::function<StatusOr<CaseOutcome>(SelfcheckBench& bench)>;

// Floats along a path, relative.
inline constexpr double kRounding = 2e-5;

[[nodiscard]] RenderOverrides SmallRender(int passes, std::int64_t photons, int max_depth);
[[nodiscard]] RenderOverrides WithRadius(RenderOverrides overrides, double radius);

// Of the green channel.
[[nodiscard]] double MeanOf(const Image& image);
// How many values are no numbers. The distance of a pixel that sees nothing is infinite.
[[nodiscard]] int NotFinite(const Image& image);

// The mean over renders that differ by their seeds is what a formula says, or that of another
// scene: their relative difference is within Student's quantile, and a bound above 5 % fails.
[[nodiscard]] CaseRun MeanIs(std::string text, RenderOverrides overrides, double expected);
[[nodiscard]] CaseRun MeansAgree(std::string text, std::string other, RenderOverrides overrides);

// --- scene texts -------------------------------------------------------------------------------

// Up to WorldBegin.
[[nodiscard]] std::string HeadText(const std::string& look_at, double fov_deg, int side);
// The camera sees the side from which the corners go round counterclockwise.
[[nodiscard]] std::string QuadText(const std::string& corners);
// Black, and shines to that side.
[[nodiscard]] std::string LampText(const std::string& corners, double radiance);

}  // namespace lucerna
