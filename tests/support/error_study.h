// Many small renders of one scene that differ by their seeds alone: is the error estimate true, do
// its intervals hold the truth, and does stopping on it keep its promise?
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "render/image/image.h"
#include "render/scene/scene.h"

namespace lucerna {

struct StudySize {
  int side = 48;  // pixels
  int renders = 200;
  int passes = 16;
  int photons_per_pixel = 1;  // in each pass
  std::uint64_t first_seed = 1000;
};

// One render at one checkpoint; squared relative errors.
struct StudiedLook {
  int passes = 0;
  double truth = 0;
  double estimate = 0, low = 0, high = 0;
};

// Of the last checkpoint, means over renders, all pixels, and with the reference's value in the
// denominator of relative errors.
struct StudiedParts {
  double true_noise = 0, true_bias = 0;            // from the renders and the reference
  double estimated_noise = 0, estimated_bias = 0;  // as ErrorEstimate has them
  // Of luminance: the true bias, and what the layer `bias` makes of it when the renders' mean is
  // free of noise.
  double true_luminance_bias = 0, kernel_bias = 0;
};

struct ErrorStudy {
  std::vector<std::vector<StudiedLook>> renders;
  StudiedParts parts;

  // Renders whose intervals hold the truth at every estimate.
  [[nodiscard]] int Covered() const;
  // Per estimate: root of mean estimate over mean truth.
  [[nodiscard]] std::vector<double> Ratios() const;
};

// What comes of stopping at the first estimate whose interval ends at or below `target`, a relative
// error.
struct StopOutcome {
  double target = 0;
  int stopped = 0;        // renders that did so at all
  int kept = 0;           // of them, those whose true error was at most the target
  int within_two = 0;     // of them, those that spent at most twice the photons they needed
  double mean_spent = 0;  // over needed
};
[[nodiscard]] StopOutcome StopAt(const ErrorStudy& study, double target);

// Renders with checkpoints as a job has them, against `reference`, whose own noise is taken off
// where it is known (film/reference.h).
[[nodiscard]] ErrorStudy StudyErrors(const Scene& scene, const Image& reference,
                                     const StudySize& size);

// A reference of two halves of `passes` passes each, which knows its noise: radii begin at a pixel.
[[nodiscard]] Image HalvedReference(const Scene& scene, int side, int passes,
                                    int photons_per_pixel);

}  // namespace lucerna
