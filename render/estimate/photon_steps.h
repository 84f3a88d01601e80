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

#include "render/estimate/image_sums.h"
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
// What it needs beside the sums of an image, of passes that come one by one. The photons of a pass
// may change on the way.
class PassVariance {
 public:
  explicit PassVariance(std::size_t pixels) : pixels_(pixels) {}

  // Requires a slice of one pass, which is added to the sums `before` later.
  void Add(const SliceSums& pass, const ImageSums& before);
  // As ImageSums::WeighBy returns it.
  void Discount(double factor);

  // Parts of the variance of a pass of weight 1, as means over the pixels, relative to the squared
  // value (with the floor of relative errors). The pixels that vary most are left out, as in
  // relative errors.
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
    // Of passes as they deviate from their mean, and what is left of that in the mean of all: the
    // even passes' difference from the odd ones.
    double deviations = 0, halves = 0;
  };
  // `kernel_noise` is the variance that one photon brings, over the squared flux expected of it:
  // the kernel's integral of K² times the area within which photons are counted.
  // Requires the sums, without a tail, of the passes added, of which there are two or more.
  [[nodiscard]] Parts Split(const ImageSums& sums, double kernel_noise) const;

  // Of each pixel the variance of single eye paths with the photons of a pass given, relative as
  // `Parts` are. Empty for a black image. Requires sums as Split does, after the passes that
  // compare eye paths.
  [[nodiscard]] std::vector<float> OfEyePaths(const ImageSums& sums) const;

  // Whether so few photons were found that their variance is not seen, though they bring a good
  // part of the light.
  [[nodiscard]] static bool IsStarved(const ImageSums& sums);

  // What has been spent for them, in units of the time that tracing one ray of a photon takes. It
  // follows from counts: measured times would make images depend on machines.
  struct Costs {
    double photons = 0, eye_paths = 0;
    // Of gathering, which is a part of that of the photons.
    double gathering = 0;
  };
  [[nodiscard]] static Costs CostsOf(const ImageSums& sums);

  // The number of photons a pass that has the least variance for the time: with variances v and
  // costs c of photons and eye paths, sqrt(v_photons c_eye / (v_eye c_photons)) times that of
  // a pass of weight 1. 0 where photons bring nothing, and infinite where all variance is theirs.
  // That number itself where photons are evenly spaced: with another number, later passes take up
  // another place of their sequence, and lose more than they gain.
  // Infinite too where most pixels have found no photon yet, though those that were found bring a
  // good part of the light: the variance of photons is not seen then.
  // Requires sums as Split does.
  [[nodiscard]] double BestPhotons(const ImageSums& sums, double kernel_noise) const;

  // Of what photons brought to a pixel, weighted.
  struct Pixel {
    float even = 0;        // luminance of the even passes
    float deviations = 0;  // squared, of passes' luminances from their mean
    float of_paths = 0;    // of single eye paths, sum over the passes that compared two
  };
  // All that is kept, for checkpoints.
  [[nodiscard]] const std::vector<Pixel>& pixels() const { return pixels_; }
  // Goes on from there.
  explicit PassVariance(std::vector<Pixel> pixels) : pixels_(std::move(pixels)) {}

 private:
  // Of one pixel, relative.
  struct Variances {
    float all = 0;            // of passes
    float halves = 0;         // the same by their halves' difference
    float photons = 0;        // of what photons brought
    float photons_found = 0;  // that the number of photons found explains
    float independent = 0;    // the same, without bias where few were found
    float eye_paths = 0;      // of halves, beyond what photons brought to them
  };
  // [pixels], or empty for a black image.
  [[nodiscard]] std::vector<Variances> OfPixels(const ImageSums& sums, double kernel_noise) const;

  std::vector<Pixel> pixels_;
};

// `present` times the power of two that comes closest to `best`; not less than `present`, and not
// more than `most`. Requires present > 0.
[[nodiscard]] std::uint64_t NextPhotons(std::uint64_t present, std::uint64_t most, double best);

}  // namespace lucerna
