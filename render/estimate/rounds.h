// Which passes share one set of radii, and which passes are those radii computed from?
//
// A round is a run of consecutive passes that share one set of radii. Its length and its lag follow
// from the pass number alone, so the image stays a function of scene and settings, whoever traces
// which pass and when. Rounds are of one pass each up to kFirstLongRound, so that early radii
// follow the photons closely; then of a quarter to an eighth of the passes before them up to eight
// passes, later of an eighth to a sixteenth. The radii of a round lag behind it: up to pass
// kFirstLongLag they follow from the passes that lie at least an eighth of the passes done before
// it, and of the passes after kFirstLongLag half and more may be missing. So many may be out at
// once that a large farm has slices of several passes for every worker, and no worker waits for a
// slower one. Radii fall as a small power of the passes: an eighth of lag is some 2 % of a radius,
// a half 12 % where the error is nearly flat. A worker sends one sum for a slice of a round, so
// that longer rounds cost the coordinator less (docs/decisions/rounds.md has the figures).
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

namespace lucerna {

// Passes [first, last).
struct PassRange {
  std::uint64_t first = 0, last = 0;
  [[nodiscard]] constexpr std::uint64_t size() const { return last - first; }
  auto operator<=>(const PassRange&) const = default;
};

inline constexpr std::uint64_t kFirstLongRound = 8;
// So long, rounds grow with a quarter of the passes.
inline constexpr std::uint64_t kLongestQuickRound = 8;
inline constexpr std::uint64_t kLongestRound = 64;
// From here on the lag grows by a pass for every two, and rounds share their radii with others.
inline constexpr std::uint64_t kFirstLongLag = 128;

// The round of a pass. Its length is a power of two and divides its first pass.
[[nodiscard]] constexpr PassRange RoundOf(std::uint64_t pass) {
  if (pass < kFirstLongRound) return {pass, pass + 1};
  const std::uint64_t octave = std::bit_floor(pass);
  const std::uint64_t length =
      std::min(std::max(octave / 8, std::min(octave / 4, kLongestQuickRound)), kLongestRound);
  const std::uint64_t first = pass / length * length;
  return {first, first + length};
}

// How many rounds there are before this pass, the first of a round.
[[nodiscard]] constexpr std::uint64_t RoundsUntil(std::uint64_t last) {
  std::uint64_t rounds = 0;
  for (std::uint64_t pass = 0; pass < last; pass = RoundOf(pass).last)
    ++rounds;
  return rounds;
}

// The radii of a round follow from the passes before this one, which is the first of a round. In
// the long run there are some eight such states of the radii between a round and what its own
// follow from, however many rounds there are.
[[nodiscard]] constexpr std::uint64_t RadiiFrom(const PassRange& round) {
  if (round.first == 0) return 0;
  const std::uint64_t early = std::min(round.first, kFirstLongLag);
  const std::uint64_t lag = std::max<std::uint64_t>(early / 8 + (round.first - early) / 2, 1);
  const std::uint64_t from = RoundOf(round.first - lag).first;
  if (round.first <= kFirstLongLag) return from;
  const std::uint64_t step = std::bit_floor(round.first) / 16;
  return from / step * step;
}

// A slice is a part of a round that is summed by itself: a power of two of passes that begins at a
// multiple of its length. Two slices side by side that begin at a multiple of both together make
// the next larger one.
[[nodiscard]] constexpr bool IsSlice(const PassRange& range) {
  return range.last > range.first && std::has_single_bit(range.size()) &&
         range.first % range.size() == 0 && range.last <= RoundOf(range.first).last;
}
// The slice with which `slice` makes the next larger one.
[[nodiscard]] constexpr PassRange SiblingOf(const PassRange& slice) {
  const std::uint64_t size = slice.size();
  const std::uint64_t first = slice.first % (2 * size) == 0 ? slice.last : slice.first - size;
  return {first, first + size};
}

}  // namespace lucerna
