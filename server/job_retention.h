// What is kept of jobs that have ended?
//
// The newest can go on and still have their images; of older ones the record stays, of the oldest
// nothing. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/base/clock.h"

namespace lucerna {

struct RetentionLimits {
  std::size_t jobs = 1000;
  // Of jobs whose photons are kept, so that they can go on; the newest counts as none. At some 700
  // bytes a pixel.
  std::int64_t pixels = std::int64_t{1} << 21;
  // Of those, jobs whose photons, scene and tree are in memory; others go on from a checkpoint.
  std::size_t in_memory = 64;
  std::size_t images = 64;  // in memory; those on a disk are kept with the record
  std::size_t image_bytes = std::size_t{2} << 30;  // the newest counts as none
  Duration age{};                                  // since a job ended; 0: no limit
};

// What there is of an ended job.
struct EndedJob {
  bool has_photons = false;  // in memory or in a checkpoint
  bool is_in_memory = false;
  std::int64_t pixels = 0;
  bool has_image = false;
  std::size_t image_bytes = 0;
  Duration age{};
};

struct KeptOfJob {
  bool record = true;  // false: nothing at all
  bool photons = true;
  bool image = true;
  bool in_memory = true;  // its photons
  bool operator==(const KeptOfJob&) const = default;
};

// One entry for each of `newest_first`; what a job does not have counts as kept.
[[nodiscard]] std::vector<KeptOfJob> DecideRetention(const std::vector<EndedJob>& newest_first,
                                                     const RetentionLimits& limits);

}  // namespace lucerna
