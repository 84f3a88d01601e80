// Reads measured BSDFs: the .bsdf files of the RGL material database.
//
// Such a file holds named arrays (Dupuy & Jakob 2018; little-endian):
//   "tensor_file\0", version 1.0 as two bytes, the number of arrays (u32); for each array the
//   length of its name (u16), the name, its rank (u16), the type of its numbers (u8), where in the
//   file they begin (u64), and its sizes (u64 each).
#pragma once

#include <string_view>

#include "render/base/status.h"
#include "render/scene/measured_table.h"

namespace lucerna {

// Errors: INVALID_ARGUMENT with what is wrong: no such file, cut off, an array is missing or has
// another shape, or numbers that are none or below zero.
[[nodiscard]] StatusOr<MeasuredTable> ParseMeasured(std::string_view bytes);

}  // namespace lucerna
