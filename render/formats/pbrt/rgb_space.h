// ColorSpace: in which primaries are the colours of a file given?
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "render/formats/pbrt/parameter_list.h"
#include "render/math/color_space.h"

namespace lucerna {

struct RgbSpace;
// The space of this name; nullptr when there is none.
[[nodiscard]] const RgbSpace* FindRgbSpace(std::string_view name);
// "there are srgb, ...".
[[nodiscard]] std::string RgbSpaceNames();

// Makes the rgb among the parameters those of Rec. 709, with what is below 0 there as 0. White
// stays (1, 1, 1). `space` may be null: Rec. 709.
void ToRec709(std::vector<Parameter>& parameters, const RgbSpace* space);

// Makes daylight of a correlated colour temperature [K] the white of Rec. 709; below 4000 K, where
// daylight is not defined, the light of a black body. Whites are adapted by cone responses, as by
// pbrt-v4.
inline constexpr double kMinWhiteK = 1000, kMaxWhiteK = 25000;
[[nodiscard]] ColorMatrix WhiteBalance(double temperature_k);

}  // namespace lucerna
