#include "server/emission_check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "render/transport/photon_guide.h"

namespace lucerna {
namespace {

// Powers at the ends of the range of floats are held where they are normal numbers; then energies
// are not those of the sum of the lights.
constexpr double kLeastPower = 1e-30, kMostPower = 1e30;
// Rounding of a few float operations, and of a sum of n floats.
constexpr double kRounding = 1e-4, kRoundingOfTerm = 0x1p-23;
// The largest energy that is counted for a photon (worker/photon_path.cc).
constexpr double kLargestEnergy = 0x1p28;
// A spot's photons have at most so many times the mean: its falloff is at least one half on
// average.
constexpr double kMostOfSpot = 2;
// Numbers that give no direction: one photon in 2^24. Of so many photons one may be missing, and of
// any batch kMayBeMissing.
constexpr std::uint64_t kOneMissingOf = 1 << 16;
constexpr std::uint64_t kMayBeMissing = 16;

}  // namespace

EmissionCheck::EmissionCheck(const LightSet& lights, double largest_power)
    : largest_power_(largest_power) {
  const auto total = static_cast<double>(Luminance(lights.TotalPower()));
  const bool is_ordinary = total > kLeastPower && total < kMostPower;
  double sending = 0;
  double emitters = 0;
  for (const LightGroup& light : lights.lights()) {
    sending += light.lights;
    emitters += light.emitters;
  }
  const double rounding = kRounding + kRoundingOfTerm * emitters;
  const double even_share = sending > 1 ? kEvenPhotonShare : 0;
  for (const LightGroup& light : lights.lights()) {
    // Within a cone, a pixel or a cell of a picture photons differ.
    const bool is_mixed = light.kind == EmitterKind::kSpot ||
                          light.kind == EmitterKind::kProjection || light.lights > 1;
    const bool differ = is_mixed || light.largest_share > 1 || largest_power > 1;
    may_emit_less_ |= !is_ordinary || differ;
    if (!is_ordinary) {
      lights_.push_back({0, kLargestEnergy});
      continue;
    }
    // Power over probability, as LightSet chooses (LightSet::ShareOut).
    const auto power = static_cast<double>(Luminance(light.power));
    const double even = even_share > 0 ? even_share / (power * sending) : 0;
    const double flux = 1 / ((1 - even_share) / total + even);
    const double units = std::ldexp(flux / total, kEnergyBits);
    Range range = {units * (1 - rounding) - 1, units * (1 + rounding) + 1};
    // Of several lights together, of any kind, fainter ones have less.
    const double largest = static_cast<double>(light.largest_share) * largest_power;
    if (differ) {
      range = {0, std::max(is_mixed ? kMostOfSpot * largest_power : largest_power, largest) *
                      range.most};
    }
    lights_.push_back({std::clamp(range.least, 0.0, kLargestEnergy),
                       std::clamp(range.most, 0.0, kLargestEnergy)});
  }
}

Status EmissionCheck::CheckGuided(const BatchTally& tally, double unguided_share) const {
  const auto photons = static_cast<double>(tally.photons);
  if (photons == 0) return absl::OkStatus();
  constexpr double kLogOfChance = 28.3;
  // Each photon stands for one that is drawn evenly with a probability of unguided_share on
  // average, and only those count for their lights. Hoeffding's inequality: fewer by t with a
  // probability of at most exp(-2 t² / n).
  std::uint64_t sent = 0;
  for (const LightTally& light : tally.lights)
    sent += light.sent;
  const double fewest = unguided_share * photons - std::sqrt(kLogOfChance * photons / 2);
  if (sent > tally.photons || static_cast<double>(sent) < fewest) {
    return absl::InvalidArgumentError(
        absl::StrCat("its lights sent ", sent, " of ", tally.photons, " photons"));
  }
  double most_of_photon = 0;
  for (const Range& range : lights_)
    most_of_photon = std::max(most_of_photon, range.most);
  most_of_photon /= kUnguidedShare;
  // Drawn by whatever density, a photon's energy is the scene's power on average, and its square at
  // most that times the largest. Bernstein's inequality: with x = t / mean, the mean of n is off by
  // t with a probability of at most 2 exp(-n x² / (2 (r + r x / 3))), r = largest / mean.
  const double mean = std::ldexp(1.0, kEnergyBits);
  const double r = most_of_photon / mean;
  const double b = 2 * kLogOfChance * r / (3 * photons);
  const double x = 0.5 * (b + std::sqrt(b * b + 8 * kLogOfChance * r / photons));
  const double missing =
      static_cast<double>(kMayBeMissing + tally.photons / kOneMissingOf + tally.dropped);
  const double most = photons * (mean * largest_power_ * (1 + x + kRounding) + 1);
  const double least =
      may_emit_less_ ? 0 : photons * (mean * (1 - x - kRounding) - 1) - missing * most_of_photon;
  const auto emitted = static_cast<double>(tally.energy.emitted);
  if (emitted > most || emitted < least) {
    return absl::InvalidArgumentError(
        absl::StrCat("its photons were emitted with the energy ", tally.energy.emitted,
                     ", and what the lights emit is between ", least, " and ", most));
  }
  return absl::OkStatus();
}

Status EmissionCheck::Check(const BatchTally& tally, double unguided_share) const {
  if (lights_.empty()) return absl::OkStatus();
  if (tally.lights.size() > lights_.size()) {
    return absl::InvalidArgumentError("its photons come from more lights than the scene has");
  }
  if (unguided_share < 1) return CheckGuided(tally, unguided_share);
  std::uint64_t sent = 0;
  double least = 0;
  double most = 0;
  double most_of_photon = 0;
  for (std::size_t i = 0; i < tally.lights.size(); ++i) {
    const auto photons = static_cast<double>(tally.lights[i].sent);
    sent += tally.lights[i].sent;
    least += photons * lights_[i].least;
    most += photons * lights_[i].most;
    most_of_photon = std::max(most_of_photon, lights_[i].most);
  }
  if (sent != tally.photons) {
    return absl::InvalidArgumentError(
        absl::StrCat("its lights sent ", sent, " of ", tally.photons, " photons"));
  }
  const double missing = static_cast<double>(kMayBeMissing + sent / kOneMissingOf + tally.dropped);
  const auto emitted = static_cast<double>(tally.energy.emitted);
  if (emitted > most || emitted < least - missing * most_of_photon) {
    return absl::InvalidArgumentError(
        absl::StrCat("its photons were emitted with the energy ", tally.energy.emitted,
                     ", and what the lights emit is between ", least, " and ", most));
  }
  return absl::OkStatus();
}

}  // namespace lucerna
