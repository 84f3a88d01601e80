// What names a piece of work that a worker is lent?
#pragma once

#include <compare>
#include <cstdint>
#include <string>

namespace lucerna {

// A pass, or the round that begins with it.
struct PassKey {
  std::string job_id;
  std::uint64_t pass = 0;
  auto operator<=>(const PassKey&) const = default;
};

// What a range counts: photons of one pass, whose hitpoints the coordinator has traced, or passes
// of one round, of which the worker traces everything.
enum class WorkKind : std::uint8_t { kPhotons, kPasses };

// Photons or passes [first, last).
struct WorkRange {
  std::uint64_t first = 0, last = 0;
  [[nodiscard]] std::uint64_t size() const { return last - first; }
  auto operator<=>(const WorkRange&) const = default;
};

enum class MergeOutcome : std::uint8_t {
  kAccepted,
  kDuplicate,   // was merged before
  kSuperseded,  // its pass or round is not open (any more)
};
inline constexpr std::size_t kMergeOutcomes = 3;

}  // namespace lucerna
