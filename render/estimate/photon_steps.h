// How many photons do a job's passes have?
//
// Early passes have few, so that the first image comes soon. Later ones may have more: a pass costs
// an eye path a pixel however many photons it has, and what is best depends on which of the two
// the noise comes from. The number changes between rounds (estimate/rounds.h), by powers of two.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "render/estimate/slice_sums.h"

namespace lucerna {

// From `first_pass` on, passes have so many photons.
struct PhotonStep {
  std::uint64_t first_pass = 0;
  std::uint64_t photons_per_pass = 0;
  bool operator==(const PhotonStep&) const = default;
};
// In order of passes; the first is that of pass 0.
using PhotonSteps = std::vector<PhotonStep>;

// The photons of one pass. Requires steps.
[[nodiscard]] std::uint64_t PhotonsOf(const PhotonSteps& steps, std::uint64_t pass);
// The fewest passes from the first on that have so many photons together. Requires steps, with at
// least a photon a pass.
[[nodiscard]] std::uint64_t PassesFor(const PhotonSteps& steps, std::uint64_t photons);

// Where the variance of a job's first passes comes from, and what they cost.
//
// Sums over passes that come one by one. The photons of a pass may change on the way.
class PassVariance {
 public:
  explicit PassVariance(std::size_t pixels) { sums_.pixels.resize(pixels); }

  // Requires a slice of one pass, that of passes().
  void Add(const SliceSums& pass);
  [[nodiscard]] std::uint64_t passes() const { return sums_.passes; }

  // Parts of the variance of a pass, as means over the pixels, relative to the squared value (with
  // the floor of relative errors). The pixels that vary most are left out, as in relative errors.
  struct Parts {
    // Of photons: falls as one over their number.
    double photons = 0;
    // Of eye paths, direct light included: what more photons would not change. Of direct light it
    // is what even and odd passes differ by: with samples of low discrepancy the mean of many
    // passes varies less than deviations of single passes say.
    double eye_paths = 0;
    // Photons vary less than independent ones: low discrepancy spaces them evenly, over the passes
    // as well as within one. Then deviations of passes say little of the noise of their mean.
    bool is_evenly_spaced = false;
  };
  // `kernel_noise` is the variance that one photon brings, over the squared flux expected of it:
  // the kernel's integral of K² times the area within which photons are counted.
  // Requires passes() >= 2.
  [[nodiscard]] Parts Split(double kernel_noise) const;

  // What has been spent so far, in units of the time that tracing one ray of a photon takes. It
  // follows from counts: measured times would make images depend on machines.
  struct Costs {
    double photons = 0, eye_paths = 0;
  };
  [[nodiscard]] Costs CostsSoFar() const;

  // The number of photons a pass that has the least variance for the time: with variances v and
  // costs c of photons and eye paths, sqrt(v_photons c_eye / (v_eye c_photons)) times the mean
  // number so far. 0 where photons bring nothing, and infinite where all variance is theirs. That
  // mean number itself where photons are evenly spaced: with another number, later passes take up
  // another place of their sequence, and lose more than they gain.
  // Infinite too where most pixels have found no photon yet, though those that were found bring a
  // good part of the light: the variance of photons is not seen then.
  // Requires passes() >= 2.
  [[nodiscard]] double BestPhotons(double kernel_noise) const;

  struct Pixel {
    float photons = 0, direct = 0;  // luminances
    float even_photons = 0;         // luminance of the even passes
    float even = 0;                 // the same with direct light
    float deviations = 0;           // squared, of passes from their mean
    float photon_deviations = 0;    // the same of what photons brought
    float count = 0;                // photons found
  };
  // All that is kept, for checkpoints.
  struct Numbers {
    std::vector<Pixel> pixels;
    std::uint64_t passes = 0;
    std::uint64_t photons = 0, photon_rays = 0, pairs = 0, eye_rays = 0;
  };
  [[nodiscard]] const Numbers& numbers() const { return sums_; }
  // Goes on from there.
  explicit PassVariance(Numbers numbers) : sums_(std::move(numbers)) {}

 private:
  [[nodiscard]] bool IsStarved() const;

  Numbers sums_;
};

// `present` times the power of two that comes closest to `best`; not less than `present`, and not
// more than `most`. Requires present > 0.
[[nodiscard]] std::uint64_t NextPhotons(std::uint64_t present, std::uint64_t most, double best);

}  // namespace lucerna
