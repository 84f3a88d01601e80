// A map of space that changes from one to another over a time, as pbrt-v4 has it: translation,
// rotation and stretch of both are interpolated each by itself, so that what turns keeps its shape.
#pragma once

#include <array>

#include "render/base/status.h"
#include "render/math/transform.h"

namespace lucerna {

class AnimatedTransform {
 public:
  // One that stays as it is.
  explicit AnimatedTransform(const Transform& always = Transform())
      : start_(always), end_(always) {}
  // Affine maps, and start_time < end_time. Before and after these times it stays as it is. A turn
  // goes the shorter way round.
  // Errors: INVALID_ARGUMENT when one cannot be inverted, or one mirrors and the other does not:
  // between the two would be a map that flattens everything.
  [[nodiscard]] static StatusOr<AnimatedTransform> Create(const Transform& start, double start_time,
                                                          const Transform& end, double end_time);

  [[nodiscard]] const Transform& start() const { return start_; }
  [[nodiscard]] Transform At(double time) const;
  // Whether it changes between two times.
  [[nodiscard]] bool MovesWithin(double from, double to) const {
    return moves_ && from < end_time_ && to > start_time_;
  }
  // The same motion where each length is `factor` times as large a number.
  [[nodiscard]] AnimatedTransform ScaledBy(double factor) const;

  bool operator==(const AnimatedTransform&) const = default;

 private:
  using Matrix3 = std::array<std::array<double, 3>, 3>;
  // x ↦ translation + rotation · stretch · x.
  struct Parts {
    std::array<double, 3> translation{};
    std::array<double, 4> rotation{};  // quaternion: vector part, then scalar
    Matrix3 stretch{};

    bool operator==(const Parts&) const = default;
  };
  [[nodiscard]] static StatusOr<Parts> PartsOf(const Transform& transform);

  Transform start_, end_;
  double start_time_ = 0, end_time_ = 1;
  bool moves_ = false;
  Parts from_, to_;  // of those that move
};

}  // namespace lucerna
