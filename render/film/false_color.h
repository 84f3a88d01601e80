// Numbers of a layer as colours: radii, bandwidths, densities of photons.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>

#include "render/base/status.h"
#include "render/image/image.h"

namespace lucerna {

// From dark blue over green to white, of a share in [0, 1]: lighter means more. sRGB, in [0, 255].
[[nodiscard]] std::array<double, 3> FalseColor(double share);

// Which numbers the ends of the colours stand for.
struct FalseColorScale {
  double low = 0, high = 1;
  bool is_logarithmic = false;
};

struct FalseColors {
  Image picture;  // R, G and B of the sRGB primaries, linear: shown as they are
  FalseColorScale scale;
};

// Of a layer: one channel, or the luminance of three. "density" is photon_count over the area of
// the disc of `radius`. Without a range the scale goes from the first to the last percent of the
// numbers, logarithmic where these are above 0 and differ by more than a factor of 100. What is not
// finite is black.
// Errors: NOT_FOUND that lists the layers there are; INVALID_ARGUMENT for a range that is none.
[[nodiscard]] StatusOr<FalseColors> FalseColorsOf(
    const Image& image, const std::string& layer,
    std::optional<std::pair<double, double>> range = std::nullopt);

}  // namespace lucerna
