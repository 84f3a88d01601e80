// What does one batch of photons add to the hitpoints?
//
// A photon count and, per channel, the sum of kernel-weighted flux as a 64-bit fixed-point
// integer. Every photon's contribution is rounded once (math/fixed_point.h); after that there is
// only integer addition, so accumulations can be merged in any order with the same result to the
// last bit.
//
// Sparse: only hitpoints that a photon touched are listed.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "render/base/parallel.h"
#include "render/base/status.h"
#include "render/estimate/emission_report.h"
#include "render/math/packed_integers.h"

namespace lucerna {

// What became of the photons' power. In whole units, kEnergyBits of them to the power of the whole
// scene, which is about what a photon carries (math/fixed_point.h): luminance, rounded once for
// every change, so that what a photon loses here it has lost there, and sums balance to the unit.
struct EnergyCounters {
  std::int64_t emitted = 0;
  // Survivors of the roulette are made heavier, and only on average by what the others had.
  std::int64_t roulette_gain = 0;
  std::int64_t roulette_loss = 0;
  std::int64_t absorbed = 0;   // less what a BSDF's sampling gave: below 0 is possible
  std::int64_t escaped = 0;    // met nothing
  std::int64_t smoothing = 0;  // lost to shading normals, less what they gave
  std::int64_t cut_off = 0;    // still under way at the greatest depth
  std::int64_t dropped = 0;    // with photons that were not finite any more

  // emitted + roulette_gain less the sum of all others; where that does not fit, the nearest number
  // that does.
  [[nodiscard]] std::int64_t Imbalance() const;
  [[nodiscard]] bool Balance() const { return Imbalance() == 0; }
  bool operator==(const EnergyCounters&) const = default;
};
inline constexpr int kEnergyBits = 12;

// What the path of a photon has met before a landing: smooth surfaces alone (a caustic), or a
// surface that scatters broadly too.
enum class PathClass : std::uint8_t { kCaustic, kOther };
inline constexpr std::size_t kPathClasses = 2;
inline constexpr std::array<PathClass, kPathClasses> kAllPathClasses = {PathClass::kCaustic,
                                                                        PathClass::kOther};

// The photons of one light (LightSet::lights).
struct LightTally {
  std::uint64_t sent = 0;
  // [class] photons of which a hitpoint found a deposit; a photon counts once in each class.
  std::array<std::uint64_t, kPathClasses> in_view{};

  [[nodiscard]] std::uint64_t InView(PathClass path) const {
    return in_view[static_cast<std::size_t>(path)];
  }
  bool operator==(const LightTally&) const = default;
};
// More lights than this are not counted one by one (kMaxLightGroups).
inline constexpr std::size_t kMaxLightTallies = 64;

// The counters of a batch, for progress and for checking energy. Sums, so they merge like the rest.
struct BatchTally {
  std::uint64_t photons = 0;   // photon paths emitted
  std::uint64_t rays = 0;      // rays traced for them
  std::uint64_t deposits = 0;  // landings offered to the hitpoints
  std::uint64_t pairs = 0;     // (photon, hitpoint) contributions
  std::uint64_t dropped = 0;   // photons given up because a number was not finite
  // Landings, and contributions to hitpoints, left out because sums have no room for them
  // (FluxScale::HasRoomFor).
  std::uint64_t excess = 0;
  EnergyCounters energy;
  // By light, at most kMaxLightTallies; lights that are not there have sent nothing, and the last
  // one that is has sent some.
  std::vector<LightTally> lights = {};

  // Whether `lights` keeps its promises: no light has more photons in view than it has sent, and
  // all together have not sent more than `photons`.
  [[nodiscard]] bool LightsFit() const;
  // A sum that would leave its range stays at its end.
  BatchTally& operator+=(const BatchTally& other);
  // Whether no sum leaves its range when `other` is added.
  [[nodiscard]] bool Fits(const BatchTally& other) const;
  bool operator==(const BatchTally&) const = default;
};

// One row for each counter, in the order in which an accumulation is written. Sums, their checks,
// bytes (wire/accumulation_codec.h), messages (wire/messages.h) and reports follow from the rows.
template <typename Owner, typename Value>
struct Counter {
  // Of the field of the message (proto/lucerna/v1/values.proto), and in JSON.
  std::string_view name;
  Value Owner::*value;
  bool is_gain = false;  // of energy, not a loss
};
inline constexpr std::array kBatchCounters = {
    Counter<BatchTally, std::uint64_t>{"photons", &BatchTally::photons},
    Counter<BatchTally, std::uint64_t>{"rays", &BatchTally::rays},
    Counter<BatchTally, std::uint64_t>{"deposits", &BatchTally::deposits},
    Counter<BatchTally, std::uint64_t>{"pairs", &BatchTally::pairs},
    Counter<BatchTally, std::uint64_t>{"dropped", &BatchTally::dropped},
    Counter<BatchTally, std::uint64_t>{"excess", &BatchTally::excess},
};
inline constexpr std::array kEnergyCounters = {
    Counter<EnergyCounters, std::int64_t>{"emitted", &EnergyCounters::emitted, true},
    Counter<EnergyCounters, std::int64_t>{"roulette_gain", &EnergyCounters::roulette_gain, true},
    Counter<EnergyCounters, std::int64_t>{"roulette_loss", &EnergyCounters::roulette_loss},
    Counter<EnergyCounters, std::int64_t>{"absorbed", &EnergyCounters::absorbed},
    Counter<EnergyCounters, std::int64_t>{"escaped", &EnergyCounters::escaped},
    Counter<EnergyCounters, std::int64_t>{"smoothing", &EnergyCounters::smoothing},
    Counter<EnergyCounters, std::int64_t>{"cut_off", &EnergyCounters::cut_off},
    Counter<EnergyCounters, std::int64_t>{"dropped", &EnergyCounters::dropped},
};
// A counter without a row would be lost on its way.
static_assert(sizeof(EnergyCounters) == kEnergyCounters.size() * sizeof(std::int64_t));
static_assert(sizeof(BatchTally) == kBatchCounters.size() * sizeof(std::uint64_t) +
                                        sizeof(EnergyCounters) + sizeof(BatchTally::lights));

// So many of a batch's dropped photons are named.
inline constexpr std::size_t kDroppedNamed = 8;

struct Accumulation {
  // Rows of the hitpoint block, strictly increasing.
  std::vector<std::uint32_t> hitpoints;
  std::vector<std::uint32_t> counts;              // [hitpoints] photons found, each >= 1
  std::array<std::vector<std::int64_t>, 3> flux;  // [3][hitpoints] in quanta, per channel
  // [columns][hitpoints] for the error estimate and the job's radius controller
  // (estimate/evidence.h).
  std::vector<std::vector<std::int64_t>> evidence;
  BatchTally tally;
  // The first photons of the batch that were dropped, by index in their pass, strictly increasing,
  // at most kDroppedNamed. Not part of any sum.
  std::vector<std::uint64_t> dropped_photons;
  // Those found of the photons that the guide asks to be reported, strictly increasing in index.
  std::vector<FoundPhoton> found;

  [[nodiscard]] std::size_t size() const { return hitpoints.size(); }
  bool operator==(const Accumulation&) const = default;
};

// What all photons of a pass brought to the hitpoints.
struct SumColumns {
  PackedIntegers counts;                 // [hitpoints]
  std::array<PackedIntegers, 3> flux;    // [3][hitpoints] in quanta
  std::vector<PackedIntegers> evidence;  // [columns][hitpoints]
};

// The sum of all batches of one pass, one row per hitpoint of the block.
class PassSums {
 public:
  // All zero, made by the threads of `team` or by the caller's alone.
  explicit PassSums(std::size_t hitpoints, std::size_t evidence_columns = 0,
                    ThreadTeam* team = nullptr);

  // Adds every row. All or nothing.
  // Errors: INVALID_ARGUMENT when the accumulation breaks its own promises or names a hitpoint
  // that does not exist, or its energy does not balance; OUT_OF_RANGE when a sum would not fit in
  // 64 bits.
  [[nodiscard]] Status Add(const Accumulation& accumulation);
  // Adds what photons brought to one hitpoint, `evidence` a number for each column; no tally.
  // Returns false, and adds nothing, when a sum would not fit in 64 bits. May run beside itself for
  // hitpoints of different tiles (PackedIntegers::kTileSize).
  [[nodiscard]] bool AddRow(std::size_t hitpoint, std::uint64_t count,
                            const std::array<std::int64_t, 3>& flux,
                            std::span<const std::int64_t> evidence);
  // All that was added, but for the names of dropped photons, as one accumulation.
  // Errors: OUT_OF_RANGE when a hitpoint found 2^32 photons or more.
  [[nodiscard]] StatusOr<Accumulation> ToAccumulation() const;
  // Moves the columns out, for a caller that frees each of them after its last use. What is left
  // has the tally and the photons found, but no hitpoint and no column of evidence.
  [[nodiscard]] SumColumns TakeColumns();

  [[nodiscard]] std::size_t size() const { return counts_.size(); }
  [[nodiscard]] const PackedIntegers& counts() const { return counts_; }
  // [hitpoints] in quanta.
  [[nodiscard]] const PackedIntegers& flux(int channel) const {
    return flux_[static_cast<std::size_t>(channel)];
  }
  [[nodiscard]] const std::vector<PackedIntegers>& evidence() const { return evidence_; }
  [[nodiscard]] const BatchTally& tally() const { return tally_; }
  // Of all batches, in order of their indices.
  [[nodiscard]] std::vector<FoundPhoton> FoundInOrder() const;

 private:
  [[nodiscard]] Status Check(const Accumulation& accumulation) const;

  PackedIntegers counts_;
  std::array<PackedIntegers, 3> flux_;
  std::vector<PackedIntegers> evidence_;
  BatchTally tally_;
  std::vector<FoundPhoton> found_;
};

}  // namespace lucerna
