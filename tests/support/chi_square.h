// Do counts follow the probabilities they should, and does a mean agree with its closed form?
//
// Both questions are answered by a p-value, and a suite of `tests` independent questions keeps
// one chance of a false alarm for all of them together (Šidák's correction).
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "render/math/vector.h"

namespace lucerna {

// The chance that a suite of `tests` true hypotheses is kept whole is 1 - alpha when each is
// refused below this p-value.
[[nodiscard]] double SidakLevel(double alpha, int tests);

// Pearson's test. Cells with fewer than five expected counts are pooled. Returns the p-value; 0
// when something was counted where nothing can be.
[[nodiscard]] double ChiSquarePValue(std::span<const double> observed,
                                     std::span<const double> expected);

// Draws `samples` directions and compares their numbers per cell of (cosθ, φ) with the integral of
// `pdf_solid_angle` over the cells. `draw` returns false for a sample that gives no direction; so
// a density may integrate to less than one. The integral is by `fine`² midpoints a cell: a density
// that jumps within cells needs more of them. Returns the p-value.
[[nodiscard]] double DirectionsPValue(
    const std::function<bool(float u_lobe, float u1, float u2, Vec3& direction)>& draw,
    const std::function<double(Vec3)>& pdf_solid_angle, int samples, std::uint64_t key,
    int fine = 24);

// The mean of a few independent numbers, with its standard error taken from their spread.
struct MeasuredMean {
  double mean = 0;
  double standard_error = 0;
};
[[nodiscard]] MeasuredMean MeanOf(std::span<const double> parts);

// How many standard errors two-sided chance `level` allows with `parts` independent parts
// (Student's t).
[[nodiscard]] double StudentQuantile(double level, int parts);

}  // namespace lucerna
