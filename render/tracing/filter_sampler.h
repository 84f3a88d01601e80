// Where in a pixel's filter does an eye path begin, and what does it weigh?
//
// A filter with negative parts is drawn by its absolute value, and what is drawn there counts
// negatively. Were it left to chance how many of a pixel's paths do, the sum of their weights, and
// with it the brightness of even a white wall, would differ from pixel to pixel. So negative
// weights have a share of the draws that is a power of two, and it is one interval of the first of
// the numbers that a path is drawn by: of 2^k points in a row of a pixel's sequence, each such
// interval has its exact share, and weights add up to what they should.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "render/scene/scene.h"

namespace lucerna {

class FilterSampler {
 public:
  explicit FilterSampler(const PixelFilter& filter);

  struct Draw {
    float x = 0, y = 0;  // from the pixel's centre [pixels], in [-radius, radius]
    // The factor that makes the mean of weighted draws the filtered value: one positive number, 1
    // where the filter is nowhere negative, or one negative number.
    float weight = 1;
  };
  // Of two numbers in [0, 1).
  [[nodiscard]] Draw Sample(float u, float v) const;

  // The filter along one axis is `positive` - `negative` [1/pixel], neither below 0, up to the fit
  // of the table; its integral is 1.
  struct Parts {
    float positive = 0, negative = 0;
  };
  // Of an offset from the pixel's centre [pixels]; none beyond the radius.
  [[nodiscard]] Parts AlongX(float offset) const { return x_.At(offset); }
  [[nodiscard]] Parts AlongY(float offset) const { return y_.At(offset); }
  // The filter [1/pixel²].
  [[nodiscard]] static float Value(Parts x, Parts y) {
    return (x.positive - x.negative) * (y.positive - y.negative);
  }
  // The density with which Sample draws [1/pixel²]. Linear in both: of sums of parts over the
  // pixels of a row and a column it is the sum over all pixels of both.
  [[nodiscard]] float Density(Parts x, Parts y) const {
    return positive_.density * (x.positive * y.positive + x.negative * y.negative) +
           negative_.density * (x.positive * y.negative + x.negative * y.positive);
  }

  [[nodiscard]] float radius_x() const { return x_.radius(); }
  [[nodiscard]] float radius_y() const { return y_.radius(); }

 private:
  enum class Sign : std::uint8_t { kPositive, kNegative };

  class Axis {
   public:
    Axis(const PixelFilter& filter, float radius);
    // In proportion to the part of that sign, which has to exist.
    [[nodiscard]] float Sample(Sign sign, float u) const;
    [[nodiscard]] Parts At(float offset) const;
    [[nodiscard]] float radius() const { return radius_; }
    // The integral of the part of that sign.
    [[nodiscard]] double Mass(Sign sign) const { return OfSign(sign).mass; }

   private:
    static constexpr std::size_t kCells = 128;
    struct Part {
      double mass = 0;
      std::array<float, kCells + 1> cumulative{};  // from 0 to 1
      // [i] of the numbers from i / kCells on: the cell of the smallest. (Chen & Asau 1974, "On
      // Generating Random Variates from an Empirical Distribution".)
      std::array<std::uint8_t, kCells> first_cell{};
    };
    [[nodiscard]] const Part& OfSign(Sign sign) const {
      return parts_[static_cast<std::size_t>(sign)];
    }

    float radius_;
    std::array<Part, 2> parts_;  // by Sign
  };

  // Of all draws whose weight has one sign.
  struct Draws {
    float share = 0;    // of all
    float weight = 0;   // of each
    float density = 0;  // over that which the filter's parts have
    float first = 0;    // of them, the share that is positive along y
  };

  Axis x_, y_;
  Draws positive_, negative_;
};

}  // namespace lucerna
