// ColorSpace: in which primaries are the colours of a file given?
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "render/formats/pbrt/parameter_list.h"

namespace lucerna {

struct RgbSpace;
// The space of this name; nullptr when there is none.
[[nodiscard]] const RgbSpace* FindRgbSpace(std::string_view name);
// "there are srgb, ...".
[[nodiscard]] std::string RgbSpaceNames();

// Makes the rgb among the parameters those of Rec. 709, with what is below 0 there as 0. White
// stays (1, 1, 1). `space` may be null: Rec. 709.
void ToRec709(std::vector<Parameter>& parameters, const RgbSpace* space);

}  // namespace lucerna
