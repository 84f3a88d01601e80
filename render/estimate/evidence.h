// Which columns do accumulations carry besides photons and flux, for errors and radii?
//
// Sums over the photons in a hitpoint's disc, as exact integers like everything else in an
// accumulation. Lengths are relative to the hitpoint's radius, so the numbers have no unit and stay
// in range at every scale.
// A photon that does not count, because an edge separates it from the hitpoint (worker/cut_disc.h),
// is in none of them; how each makes up for the missing part of a disc that is cut stands with it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "render/scene/render_settings.h"

namespace lucerna {

// Always the first column: what the error estimate needs (see estimate/error_estimate.h). Sums of
// luminance flux times K(x) - K(x/a)/a², where K is the kernel's shape and a = kInnerShare, in
// units of the luminance of a quantum of each channel. In a disc that is cut both kernels are, and
// each has the weights that make up for its own missing part.
inline constexpr std::size_t kBlurColumn = 0;
inline constexpr std::size_t kCommonColumns = 1;
// Radius of the inner kernel over that of the whole one.
inline constexpr float kInnerShare = 1.0F / 3;

// Frequency photons come in one pass of so many, and that many times as densely there: the same
// share of all photons, while the passes between carry, send and merge no columns. The first pass
// is one of them, for evidence is worth most before the radius has shrunk.
inline constexpr std::uint64_t kFrequencyPeriod = 4;

// The share of the photons of a pass with Evidence::kFrequency that carry a spectrum.
[[nodiscard]] constexpr double FrequencyShareInPass(const RenderSettings& settings) {
  const double share = settings.frequency_share * static_cast<double>(kFrequencyPeriod);
  return share < 1 ? share : 1;
}

// kSectors: photons in each of twelve cells of equal area: two rings of six sectors. Where a disc
// is cut, photons also stand for the places opposite to them that are cut away, so that even light
// is even across a straight edge. (Where three walls meet it is not, and `cppm` shrinks the
// radius.)
inline constexpr std::size_t kSectors = 12;

// kCurvature, over the photons within kCurvatureReach radii: sums of w·(2u - 1) and w², where w is
// the photon's luminance flux relative to the scene's power and u the squared distance over that of
// the reach. The first is the Laplacian of the biweight kernel of that radius h: 24/(π h⁴) times it
// estimates the Laplacian of the flux density. The disc is wider than the kernel's because a second
// derivative is noisier than a value: by h⁻⁶ against r⁻². In a disc that is cut, 2u - 1 is replaced
// by its part at right angles to 1, x and y over what is left, scaled to the noise of a whole disc:
// an edge beside even or evenly changing light is no curvature. w² is divided by the share that is
// left.
enum CurvatureColumn : std::size_t { kCurvatureLaplacian, kCurvatureWeight2, kCurvatureColumns };
inline constexpr float kCurvatureReach = 1.5F;

// kFrequency, over the frequency photons: how many, and sums of w, w², w·x and w·x², where w is the
// photon's luminance flux relative to the scene's power and x the spatial spectral trace
// (1/length²) times the squared radius.
enum FrequencyColumn : std::size_t {
  kFrequencyCount,
  kFrequencyWeight,
  kFrequencyWeight2,
  kFrequencyTrace,
  kFrequencyTrace2,
  kFrequencyColumns,
};
// Sums of weights are counted in units of 2^-16, those of w² in units of 2^-24. No w² is counted as
// nothing: a radius would be as small as it can where the weights of all photons are, for their
// Laplacian would have no noise.
inline constexpr double kWeightUnit = 0x1p-16;
inline constexpr double kWeight2Unit = 0x1p-24;
// Larger values of x ask for radii below a hundredth of the present one; they are held here.
inline constexpr float kLargestTrace = 4096;

// One row for each kind of evidence, in the order of Evidence. What a photon adds to the columns:
// EvidenceSums in worker/gather.cc.
struct EvidenceTraits {
  Evidence kind;
  std::size_t columns;       // after the common ones
  float reach = 1;           // photons are looked for within so many radii
  std::uint64_t period = 1;  // in one pass of so many, the first among them
};
inline constexpr std::array kAllEvidence = {
    EvidenceTraits{.kind = Evidence::kNone, .columns = 0},
    EvidenceTraits{.kind = Evidence::kSectors, .columns = kSectors},
    EvidenceTraits{
        .kind = Evidence::kCurvature, .columns = kCurvatureColumns, .reach = kCurvatureReach},
    EvidenceTraits{
        .kind = Evidence::kFrequency, .columns = kFrequencyColumns, .period = kFrequencyPeriod},
};
[[nodiscard]] constexpr const EvidenceTraits& TraitsOf(Evidence evidence) {
  return kAllEvidence[static_cast<std::size_t>(evidence)];
}
static_assert([] {
  for (std::size_t i = 0; i < kAllEvidence.size(); ++i) {
    if (kAllEvidence[i].kind != static_cast<Evidence>(i)) return false;
  }
  return true;
}());

// The evidence that the photons of `pass` give.
[[nodiscard]] constexpr Evidence EvidenceOf(RadiusControllerKind kind, std::uint64_t pass) {
  const Evidence evidence = EvidenceOf(kind);
  return pass % TraitsOf(evidence).period == 0 ? evidence : Evidence::kNone;
}

// All columns of an accumulation.
[[nodiscard]] constexpr std::size_t EvidenceColumns(Evidence evidence) {
  return kCommonColumns + TraitsOf(evidence).columns;
}

// The columns of a radius controller, after the common ones; passes without evidence add nothing.
[[nodiscard]] constexpr std::size_t ControllerColumns(RadiusControllerKind kind) {
  return TraitsOf(EvidenceOf(kind)).columns;
}
inline constexpr std::size_t kMostControllerColumns = [] {
  std::size_t most = 0;
  for (const EvidenceTraits& traits : kAllEvidence)
    most = std::max(most, traits.columns);
  return most;
}();

// How far from a hitpoint photons are looked for [radii].
[[nodiscard]] constexpr float ReachOf(Evidence evidence) {
  return TraitsOf(evidence).reach;
}

}  // namespace lucerna
