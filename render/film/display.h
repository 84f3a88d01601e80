// How does radiance become what a screen shows?
//
// Exposure multiplies by a power of two; a tone curve brings what is brighter than white back below
// it. Both change PNG files and previews, and never the EXR.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include "render/base/status.h"
#include "render/image/image.h"

namespace lucerna {

enum class ToneCurve : unsigned char {
  kClip,      // white and brighter are white
  kReinhard,  // Reinhard, Stark, Shirley & Ferwerda 2002, eq. 4; keeps hues
  kFilmic,    // Hable 2010, "Filmic Tonemapping for Real-time Rendering"
  kAces,      // Narkowicz 2016, a fit of the ACES reference rendering transform
};
[[nodiscard]] StatusOr<ToneCurve> ParseToneCurve(std::string_view name);

struct Display {
  std::optional<double> exposure_stops = 0;  // absent: AutoExposure
  ToneCurve curve = ToneCurve::kClip;
};

// R, G and B of an image. Errors: INVALID_ARGUMENT when one is missing.
[[nodiscard]] StatusOr<std::array<const ImageChannel*, 3>> ColorChannels(const Image& image);

// The exposure [stops, whole] that brings the geometric mean of the luminances above 0 near middle
// grey (0.18), and 0 where that mean is between 2^-7 and 1 already, so that images which are
// exposed by their scene stay as they are. Of about 65,536 evenly spaced pixels; of all, where
// these are black.
[[nodiscard]] double AutoExposure(const Image& image);

// Keeps a reference to the image.
class DisplayedImage {
 public:
  // Errors: INVALID_ARGUMENT without R, G, B.
  [[nodiscard]] static StatusOr<DisplayedImage> Create(const Image& image, const Display& display);
  // R, G and B in [0, 1], linear, of the sRGB primaries; what is not a number is black.
  [[nodiscard]] std::array<double, 3> At(std::size_t pixel) const;

 private:
  DisplayedImage(const std::array<const ImageChannel*, 3>& channels, double gain, ToneCurve curve)
      : channels_(channels), gain_(gain), curve_(curve) {}

  std::array<const ImageChannel*, 3> channels_;
  double gain_;
  ToneCurve curve_;
};

}  // namespace lucerna
