#include "render/estimate/accumulation.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace lucerna {
namespace {

__extension__ using Wide = __int128;

// Whether `a + b` stays in range.
template <typename Integer>
bool SumFits(Integer a, Integer b) {
  Integer sum = 0;
  return !__builtin_add_overflow(a, b, &sum);
}

std::uint64_t SaturatingSum(std::uint64_t a, std::uint64_t b) {
  std::uint64_t sum = 0;
  return __builtin_add_overflow(a, b, &sum) ? std::numeric_limits<std::uint64_t>::max() : sum;
}

std::int64_t SaturatingSum(std::int64_t a, std::int64_t b) {
  std::int64_t sum = 0;
  if (!__builtin_add_overflow(a, b, &sum)) return sum;
  using Limits = std::numeric_limits<std::int64_t>;
  return a < 0 ? Limits::min() : Limits::max();
}

// Calls visit(ours, theirs) for every sum of two tallies, of which ours has as many lights as
// theirs.
template <typename Ours, typename Visit>
void ForEachSum(Ours& ours, const BatchTally& theirs, const Visit& visit) {
  for (const auto& counter : kBatchCounters)
    visit(ours.*counter.value, theirs.*counter.value);
  for (const auto& counter : kEnergyCounters)
    visit(ours.energy.*counter.value, theirs.energy.*counter.value);
  for (std::size_t i = 0; i < theirs.lights.size(); ++i) {
    visit(ours.lights[i].sent, theirs.lights[i].sent);
    for (std::size_t path = 0; path < kPathClasses; ++path)
      visit(ours.lights[i].in_view[path], theirs.lights[i].in_view[path]);
  }
}

}  // namespace

std::int64_t EnergyCounters::Imbalance() const {
  Wide sum = 0;
  for (const auto& counter : kEnergyCounters)
    sum += counter.is_gain ? Wide{this->*counter.value} : -Wide{this->*counter.value};
  return static_cast<std::int64_t>(std::clamp<Wide>(sum, INT64_MIN, INT64_MAX));
}

bool BatchTally::LightsFit() const {
  if (lights.size() > kMaxLightTallies) return false;
  if (!lights.empty() && lights.back().sent == 0) return false;
  std::uint64_t left = photons;
  for (const LightTally& light : lights) {
    if (light.sent > left) return false;
    left -= light.sent;
    for (const std::uint64_t in_view : light.in_view) {
      if (in_view > light.sent) return false;
    }
  }
  return true;
}

BatchTally& BatchTally::operator+=(const BatchTally& other) {
  if (lights.size() < other.lights.size()) lights.resize(other.lights.size());
  ForEachSum(*this, other, [](auto& ours, auto theirs) { ours = SaturatingSum(ours, theirs); });
  return *this;
}

bool BatchTally::Fits(const BatchTally& other) const {
  BatchTally ours_with_lights = *this;
  if (lights.size() < other.lights.size()) ours_with_lights.lights.resize(other.lights.size());
  bool fits = true;
  ForEachSum(ours_with_lights, other,
             [&](auto ours, auto theirs) { fits = fits && SumFits(ours, theirs); });
  return fits;
}

PassSums::PassSums(std::size_t hitpoints, std::size_t evidence_columns, ThreadTeam* team)
    : evidence_(evidence_columns) {
  // A column each: clearing memory takes as long as filling it in.
  const auto make = [&](std::size_t begin, std::size_t end) {
    for (std::size_t column = begin; column < end; ++column) {
      if (column < evidence_.size()) {
        evidence_[column] = PackedIntegers(hitpoints);
      } else if (column < evidence_.size() + flux_.size()) {
        flux_[column - evidence_.size()] = PackedIntegers(hitpoints);
      } else {
        counts_ = PackedIntegers(hitpoints);
      }
    }
  };
  const std::size_t columns = evidence_.size() + flux_.size() + 1;
  if (team != nullptr) {
    team->For(columns, 1, make);
  } else {
    make(0, columns);
  }
}

// Everything is checked before anything is changed: that is what makes Add all or nothing.
Status PassSums::Check(const Accumulation& accumulation) const {
  const std::size_t rows = accumulation.size();
  if (accumulation.counts.size() != rows) {
    return absl::InvalidArgumentError("an accumulation's columns differ in length");
  }
  for (const std::vector<std::int64_t>& channel : accumulation.flux) {
    if (channel.size() != rows) {
      return absl::InvalidArgumentError("an accumulation's columns differ in length");
    }
  }
  if (accumulation.evidence.size() != evidence_.size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("an accumulation has ", accumulation.evidence.size(),
                     " columns of evidence where the job has ", evidence_.size()));
  }
  for (const std::vector<std::int64_t>& column : accumulation.evidence) {
    if (column.size() != rows) {
      return absl::InvalidArgumentError("an accumulation's columns differ in length");
    }
  }
  if (!accumulation.tally.energy.Balance()) {
    return absl::InvalidArgumentError("an accumulation's energy does not balance");
  }
  if (!accumulation.tally.LightsFit()) {
    return absl::InvalidArgumentError("an accumulation's photons by light contradict its photons");
  }
  if (!tally_.Fits(accumulation.tally)) {
    return absl::OutOfRangeError("the tally of a pass would not fit in 64 bits");
  }
  for (std::size_t i = 0; i < accumulation.found.size(); ++i) {
    const FoundPhoton& found = accumulation.found[i];
    if (found.row >= counts_.size() || (i > 0 && found.index <= accumulation.found[i - 1].index)) {
      return absl::InvalidArgumentError(
          "an accumulation's photons are not strictly increasing, or of no hitpoint");
    }
  }
  std::uint64_t least = 0;  // the smallest row that may come next
  for (std::size_t i = 0; i < rows; ++i) {
    const std::uint32_t row = accumulation.hitpoints[i];
    if (row < least) {
      return absl::InvalidArgumentError("an accumulation's hitpoints are not strictly increasing");
    }
    least = std::uint64_t{row} + 1;
    if (row >= counts_.size()) {
      return absl::InvalidArgumentError(
          absl::StrCat("an accumulation names hitpoint ", row, " of ", counts_.size()));
    }
    if (accumulation.counts[i] == 0) {
      return absl::InvalidArgumentError("an accumulation lists a hitpoint without photons");
    }
    bool fits = SumFits(counts_[row], std::int64_t{accumulation.counts[i]});
    for (std::size_t channel = 0; channel < 3; ++channel) {
      fits = fits && SumFits(flux_[channel][row], accumulation.flux[channel][i]);
    }
    for (std::size_t column = 0; column < evidence_.size(); ++column) {
      fits = fits && SumFits(evidence_[column][row], accumulation.evidence[column][i]);
    }
    if (!fits) {
      return absl::OutOfRangeError(
          absl::StrCat("the sum of hitpoint ", row, " would not fit in 64 bits"));
    }
  }
  return absl::OkStatus();
}

Status PassSums::Add(const Accumulation& accumulation) {
  LUCERNA_RETURN_IF_ERROR(Check(accumulation));
  const auto add = [&](const auto& values, PackedIntegers& sums) {
    for (std::size_t i = 0; i < accumulation.size(); ++i)
      sums.Add(accumulation.hitpoints[i], values[i]);
  };
  add(accumulation.counts, counts_);
  for (std::size_t channel = 0; channel < 3; ++channel)
    add(accumulation.flux[channel], flux_[channel]);
  for (std::size_t column = 0; column < evidence_.size(); ++column)
    add(accumulation.evidence[column], evidence_[column]);
  tally_ += accumulation.tally;
  found_.insert(found_.end(), accumulation.found.begin(), accumulation.found.end());
  return absl::OkStatus();
}

bool PassSums::AddRow(std::size_t hitpoint, std::uint64_t count,
                      const std::array<std::int64_t, 3>& flux,
                      std::span<const std::int64_t> evidence) {
  bool fits = std::in_range<std::int64_t>(count) &&
              SumFits(counts_[hitpoint], static_cast<std::int64_t>(count));
  for (std::size_t channel = 0; channel < 3; ++channel)
    fits = fits && SumFits(flux_[channel][hitpoint], flux[channel]);
  for (std::size_t column = 0; column < evidence_.size(); ++column)
    fits = fits && SumFits(evidence_[column][hitpoint], evidence[column]);
  if (!fits) return false;
  counts_.Add(hitpoint, static_cast<std::int64_t>(count));
  for (std::size_t channel = 0; channel < 3; ++channel)
    flux_[channel].Add(hitpoint, flux[channel]);
  for (std::size_t column = 0; column < evidence_.size(); ++column)
    evidence_[column].Add(hitpoint, evidence[column]);
  return true;
}

StatusOr<Accumulation> PassSums::ToAccumulation() const {
  Accumulation out;
  for (std::size_t row = 0; row < counts_.size(); ++row) {
    if (counts_[row] == 0) continue;
    if (counts_[row] > UINT32_MAX) {
      return absl::OutOfRangeError(
          "a hitpoint found more than 2^32 photons of one batch; use fewer photons in a pass "
          "or a smaller radius");
    }
    out.hitpoints.push_back(static_cast<std::uint32_t>(row));
    out.counts.push_back(static_cast<std::uint32_t>(counts_[row]));
  }
  const auto copy = [&](const PackedIntegers& from, std::vector<std::int64_t>& to) {
    to.reserve(out.size());
    for (const std::uint32_t row : out.hitpoints)
      to.push_back(from[row]);
  };
  for (std::size_t channel = 0; channel < 3; ++channel)
    copy(flux_[channel], out.flux[channel]);
  out.evidence.resize(evidence_.size());
  for (std::size_t column = 0; column < evidence_.size(); ++column)
    copy(evidence_[column], out.evidence[column]);
  out.tally = tally_;
  out.found = FoundInOrder();
  return out;
}

SumColumns PassSums::TakeColumns() {
  return {.counts = std::exchange(counts_, {}),
          .flux = std::exchange(flux_, {}),
          .evidence = std::exchange(evidence_, {})};
}

std::vector<FoundPhoton> PassSums::FoundInOrder() const {
  std::vector<FoundPhoton> found = found_;
  std::ranges::sort(found, {}, &FoundPhoton::index);
  return found;
}

}  // namespace lucerna
