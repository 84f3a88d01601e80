#include "render/estimate/accumulation.h"

namespace lucerna {
namespace {

// Whether `a + b` (or `a - b`) leaves the range, without computing it.
bool SumFits(std::int64_t a, std::int64_t b, bool adding) {
  std::int64_t sum = 0;
  return adding ? !__builtin_add_overflow(a, b, &sum) : !__builtin_sub_overflow(a, b, &sum);
}

bool SumFits(std::uint64_t a, std::uint64_t b, bool adding) {
  std::uint64_t sum = 0;
  return adding ? !__builtin_add_overflow(a, b, &sum) : !__builtin_sub_overflow(a, b, &sum);
}

std::array<std::uint64_t, 5> Books(const BatchTally& tally) {
  return {tally.photons, tally.rays, tally.deposits, tally.pairs, tally.dropped};
}

}  // namespace

BatchTally& BatchTally::operator+=(const BatchTally& other) {
  photons += other.photons;
  rays += other.rays;
  deposits += other.deposits;
  pairs += other.pairs;
  dropped += other.dropped;
  return *this;
}

PassSums::PassSums(std::size_t hitpoints, std::size_t evidence_columns)
    : counts_(hitpoints, 0), evidence_(evidence_columns, std::vector<std::int64_t>(hitpoints, 0)) {
  for (std::vector<std::int64_t>& channel : flux_)
    channel.assign(hitpoints, 0);
}

// Everything is checked before anything is changed: that is what makes Add all or nothing.
Status PassSums::Check(const Accumulation& accumulation, bool adding) const {
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
                     " columns of evidence where the job asks for ", evidence_.size()));
  }
  for (const std::vector<std::int64_t>& column : accumulation.evidence) {
    if (column.size() != rows) {
      return absl::InvalidArgumentError("an accumulation's columns differ in length");
    }
  }
  const auto ours = Books(tally_);
  const auto theirs = Books(accumulation.tally);
  for (std::size_t i = 0; i < ours.size(); ++i) {
    if (!SumFits(ours[i], theirs[i], adding)) {
      return absl::OutOfRangeError("the tally of a pass would not fit in 64 bits");
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
    bool fits = SumFits(counts_[row], std::uint64_t{accumulation.counts[i]}, adding);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      fits = fits && SumFits(flux_[channel][row], accumulation.flux[channel][i], adding);
    }
    for (std::size_t column = 0; column < evidence_.size(); ++column) {
      fits = fits && SumFits(evidence_[column][row], accumulation.evidence[column][i], adding);
    }
    if (!fits) {
      return absl::OutOfRangeError(
          absl::StrCat("the sum of hitpoint ", row, " would not fit in 64 bits"));
    }
  }
  return absl::OkStatus();
}

Status PassSums::Add(const Accumulation& accumulation) {
  LUCERNA_RETURN_IF_ERROR(Check(accumulation, /*adding=*/true));
  for (std::size_t i = 0; i < accumulation.size(); ++i) {
    counts_[accumulation.hitpoints[i]] += accumulation.counts[i];
  }
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (std::size_t i = 0; i < accumulation.size(); ++i) {
      flux_[channel][accumulation.hitpoints[i]] += accumulation.flux[channel][i];
    }
  }
  for (std::size_t column = 0; column < evidence_.size(); ++column) {
    for (std::size_t i = 0; i < accumulation.size(); ++i) {
      evidence_[column][accumulation.hitpoints[i]] += accumulation.evidence[column][i];
    }
  }
  tally_ += accumulation.tally;
  return absl::OkStatus();
}

Status PassSums::Subtract(const Accumulation& accumulation) {
  LUCERNA_RETURN_IF_ERROR(Check(accumulation, /*adding=*/false));
  for (std::size_t i = 0; i < accumulation.size(); ++i) {
    counts_[accumulation.hitpoints[i]] -= accumulation.counts[i];
  }
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (std::size_t i = 0; i < accumulation.size(); ++i) {
      flux_[channel][accumulation.hitpoints[i]] -= accumulation.flux[channel][i];
    }
  }
  for (std::size_t column = 0; column < evidence_.size(); ++column) {
    for (std::size_t i = 0; i < accumulation.size(); ++i) {
      evidence_[column][accumulation.hitpoints[i]] -= accumulation.evidence[column][i];
    }
  }
  const BatchTally& other = accumulation.tally;
  tally_.photons -= other.photons;
  tally_.rays -= other.rays;
  tally_.deposits -= other.deposits;
  tally_.pairs -= other.pairs;
  tally_.dropped -= other.dropped;
  return absl::OkStatus();
}

}  // namespace lucerna
