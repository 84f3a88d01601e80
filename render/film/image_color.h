// In which colours does an image show what transport has added up?
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "render/math/color_space.h"
#include "render/scene/scene.h"

namespace lucerna {

// From the working space to an image: linear Rec. 709, balanced to the film's white.
class ImageColor {
 public:
  explicit ImageColor(const std::optional<ColorMatrix>& white_balance)
      : from_working_(kRec709FromWorking) {
    if (!white_balance.has_value()) return;
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 3; ++column) {
        double sum = 0;
        for (std::size_t k = 0; k < 3; ++k)
          sum += (*white_balance)[row][k] * kRec709FromWorking[k][column];
        from_working_[row][column] = sum;
      }
    }
  }

  [[nodiscard]] std::array<double, 3> operator()(const std::array<double, 3>& working) const {
    return Transformed(from_working_, working);
  }

 private:
  ColorMatrix from_working_;
};

}  // namespace lucerna
