// Many small renders of one scene that differ by their seeds alone: is the error estimate true, do
// its intervals hold the truth, and does stopping on it keep its promise?
#pragma once

#include <cstdint>
#include <vector>

#include "render/image/image.h"
#include "render/scene/scene.h"

namespace lucerna {

struct StudySize {
  int side = 48;  // pixels
  int renders = 200;
  int passes = 16;
};

// One render at one look; squared relative errors.
struct StudiedLook {
  int passes = 0;
  double truth = 0;
  double estimate = 0, low = 0, high = 0;
};

struct ErrorStudy {
  std::vector<std::vector<StudiedLook>> renders;

  // Renders whose intervals hold the truth at every look.
  [[nodiscard]] int Covered() const;
  // Per look: root of mean estimate over mean truth.
  [[nodiscard]] std::vector<double> Ratios() const;
};

// What comes of stopping at the first look whose interval ends at or below `target`, a relative
// error.
struct StopOutcome {
  double target = 0;
  int stopped = 0;        // renders that did so at all
  int kept = 0;           // of them, those whose true error was at most the target
  int within_two = 0;     // of them, those that spent at most twice the photons they needed
  double mean_spent = 0;  // over needed
};
[[nodiscard]] StopOutcome StopAt(const ErrorStudy& study, double target);

// Renders with one photon a pixel and pass, looking as a job does, against `reference`.
[[nodiscard]] ErrorStudy StudyErrors(const Scene& scene, const Image& reference,
                                     const StudySize& size);

// A reference whose radius falls so fast that its bias is a hundredth of a small render's, with so
// many photons that its noise is below a thirtieth of that.
[[nodiscard]] Image StudyReference(const Scene& scene, int side);

}  // namespace lucerna
