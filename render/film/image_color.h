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
      : from_working_(white_balance.has_value() ? Product(*white_balance, kRec709FromWorking)
                                                : kRec709FromWorking) {}

  [[nodiscard]] std::array<double, 3> operator()(const std::array<double, 3>& working) const {
    return Transformed(from_working_, working);
  }

 private:
  ColorMatrix from_working_;
};

}  // namespace lucerna
