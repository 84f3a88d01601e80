// What the path tracer sees of the classes of light paths, kept in a file.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>

#include "tests/support/chi_square.h"
#include "tests/support/path_classes.h"

namespace lucerna {

// Green means over the image of a class and over its quarters, row by row.
using TracedLight = std::array<MeasuredMean, 5>;

// Traced now, with `times` times the paths of the class's effort. `key` gives other random numbers.
[[nodiscard]] TracedLight TraceClass(const PathClass& cell, int times, std::uint64_t key = 0);

// By the names of the classes; lines of tests/statistical/traced_light.csv.
[[nodiscard]] std::string WriteTracedLight(const std::map<std::string, TracedLight>& classes);
// Aborts when a line is not as it is written.
[[nodiscard]] std::map<std::string, TracedLight> ReadTracedLight(const std::string& path);

}  // namespace lucerna
