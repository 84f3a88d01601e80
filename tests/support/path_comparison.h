// Do estimator and path tracer see the same light? Means over blocks of an image by both, each with
// a standard error from independent repetitions.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "render/scene/render_settings.h"
#include "render/scene/scene.h"
#include "tests/support/chi_square.h"
#include "tests/support/path_tracer.h"

namespace lucerna {

struct PathComparison {
  PixelBlock block;
  MeasuredMean estimated, traced;

  [[nodiscard]] double StandardError() const;
  [[nodiscard]] double Ratio() const { return estimated.mean / traced.mean; }
  // Of the difference, in standard errors; 0 when both are exact and equal.
  [[nodiscard]] double Deviation() const;
};

// Means of a channel ("R", "G" or "B") over the whole image first, then over side × side blocks of
// it, row by row, without what is traced. Renders `parts` times `passes` passes with seeds of their
// own, at `settings`. Requires that `side` divides width and height.
[[nodiscard]] std::vector<PathComparison> EstimateBlocks(const Scene& scene,
                                                         RenderSettings settings, int passes,
                                                         int parts, int side,
                                                         std::string_view channel, int threads = 0);

// The same beside what is traced of an image of that size. `tracer` says the rest.
[[nodiscard]] std::vector<PathComparison> CompareWithPaths(const Scene& scene,
                                                           const RenderSettings& settings,
                                                           PathTracerSettings tracer, int passes,
                                                           int parts, int side,
                                                           std::string_view channel);

}  // namespace lucerna
