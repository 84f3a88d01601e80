// What have all passes so far brought to every pixel?
//
// Sums over passes of slices taken in pass order: radiance in double, what errors are estimated
// from in float. A round that is not whole yet stays apart, as a tail: it counts in the image, and
// can be taken away again, so that a job that goes on after its end has the same bits as one that
// never stopped.
//
// Sums are weighted (pass_weights.h): the image is a sum over the weight of its passes.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "render/base/parallel.h"
#include "render/estimate/error_estimate.h"
#include "render/estimate/pass_weights.h"
#include "render/estimate/slice_sums.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"

namespace lucerna {

[[nodiscard]] constexpr double WorkingLuminance(const RgbSum& color) {
  return WorkingLuminance(color[0], color[1], color[2]);
}

class ImageSums {
 public:
  explicit ImageSums(std::size_t pixels) {
    whole_.columns = Columns(pixels);
    whole_.features.resize(pixels);
  }
  // Goes on from there, without a tail. Requires columns of one length.
  struct Whole;
  explicit ImageSums(Whole whole);

  using Slices = std::vector<std::shared_ptr<const SliceSums>>;

  // Adds the passes that follow those added so far; takes the tail away.
  // Requires slice.passes.first == whole_passes().
  void Add(const SliceSums& slice, ThreadTeam& team);
  // From now on a pass of so many photons weighs 1, and the passes added so far in proportion to
  // theirs. Returns what they weigh over what they did: no bit is lost where that is a power of
  // two. Takes the tail away. Requires photons > 0.
  double WeighBy(std::uint64_t photons_per_pass);
  // What comes after the passes added, in pass order. Requires slices without a gap.
  void SetTail(Slices tail);

  // Passes added, without the tail and with it.
  [[nodiscard]] std::uint64_t whole_passes() const { return whole_.passes; }
  [[nodiscard]] std::uint64_t passes() const {
    return tail_.empty() ? whole_.passes : tail_.back()->passes.last;
  }
  [[nodiscard]] std::size_t pixels() const { return whole_.features.size(); }
  // The parts that were added: whole rounds, then the slices of the tail.
  [[nodiscard]] std::uint64_t parts() const { return RoundsUntil(whole_.passes) + tail_.size(); }
  // Of passes().
  [[nodiscard]] PassWeights weights() const;
  // Of all passes.
  [[nodiscard]] std::uint64_t eye_rays() const;
  [[nodiscard]] BatchTally tally() const;

  // Sums over passes, all of which are means times weights().all(). Radiance in the working space,
  // luminances as of it.
  struct Pixel {
    RgbSum photons{}, direct{};
    // Even passes less odd ones: half of what radiance() and this are together is a sum over the
    // even passes, a mean times weights().even.
    RgbSum half_difference{};
    double squared_deviations = 0;  // of passes' luminances from their mean
    double even_bias = 0, odd_bias = 0;
    // Sum over the parts that were added (whole rounds, then the slices of the tail): the square of
    // both biases over the weight of the part's passes.
    double bias_squares = 0;
    double photon_count = 0;  // each counts 1
    float largest = 0;        // luminance of a pass, times the root of its weight

    [[nodiscard]] RgbSum radiance() const {
      return {photons[0] + direct[0], photons[1] + direct[1], photons[2] + direct[2]};
    }
  };
  [[nodiscard]] Pixel At(std::size_t pixel) const;
  // At(pixel).radiance(), read from fewer columns.
  [[nodiscard]] RgbSum RadianceAt(std::size_t pixel) const;

  // What eye paths saw at their first gathering surfaces: sums over the passes that met one.
  struct Features {
    Rgb albedo;  // in the working space
    Vec3 normal;
    float distance = 0;     // [scene units]
    float unit_radius = 0;  // [scene units] of hitpoints
    // Passes, of which the first kFeaturePasses count.
    std::uint16_t hits = 0;
    std::uint16_t hitpoints = 0;
  };
  [[nodiscard]] Features FeaturesAt(std::size_t pixel) const;

  // Sums over passes as columns [pixels], weighted but for direct light. Radiance in double, since
  // passes are many; squares too, since those of faint light are no normal floats.
  struct Columns {
    explicit Columns(std::size_t pixels = 0);
    [[nodiscard]] std::size_t pixels() const { return largest.size(); }
    std::array<std::vector<double>, 6> radiance;        // photons, direct
    std::array<std::vector<float>, 3> half_difference;  // of photons weighted, of direct light not
    std::vector<float> direct_difference;               // of direct light alone, not weighted
    std::vector<double> squared_deviations, bias_squares;
    std::vector<float> even_bias, odd_bias, photon_count, largest;
  };
  // All that is kept of the passes added, without the tail: for checkpoints.
  struct Whole {
    std::uint64_t passes = 0;
    PassWeights weights;
    std::uint64_t photons_per_pass = 0;  // of a pass that weighs 1
    std::uint64_t eye_rays = 0;
    BatchTally tally;
    Columns columns;
    std::vector<Features> features;  // as many
  };
  [[nodiscard]] const Whole& whole() const { return whole_; }

 private:
  void AddDeviations(const SliceSums& slice);
  void AddPixels(const SliceSums& slice, std::size_t begin, std::size_t end);
  // Sums as columns hold them.
  struct RawPixel {
    Pixel sum;
    double direct_difference = 0;
  };
  static void AddTo(RawPixel& raw, const PassRange& before, const PassWeights& weights,
                    const SliceSums& slice, std::size_t pixel);
  static void Reweigh(RawPixel& raw, std::uint64_t passes, const PassWeights& weights);
  static void AddTo(Features& sum, const SliceSums& slice, std::size_t pixel);

  Whole whole_;
  Slices tail_;
};

}  // namespace lucerna
