#include "render/film/display.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "render/estimate/error_estimate.h"

namespace lucerna {
namespace {

constexpr std::size_t kPixelsForExposure = 1 << 16;
constexpr double kMiddleGrey = 0.18;
constexpr double kDarkest = 0x1p-7, kBrightest = 1;  // mean luminances that are shown as they are
constexpr double kReinhardWhite = 4;                 // two stops above white

constexpr std::array<std::pair<std::string_view, ToneCurve>, 4> kCurves = {
    {{"clip", ToneCurve::kClip},
     {"reinhard", ToneCurve::kReinhard},
     {"filmic", ToneCurve::kFilmic},
     {"aces", ToneCurve::kAces}}};

using Color = std::array<double, 3>;

double Positive(float value) {
  return value > 0 ? static_cast<double>(value) : 0;  // also of what is not a number
}

// Of values from 0, rising, 1 at its white.
double Filmic(double value) {
  constexpr double kWhite = 11.2;
  const auto curve = [](double x) {
    constexpr double kA = 0.15, kB = 0.50, kC = 0.10, kD = 0.20, kE = 0.02, kF = 0.30;
    return (x * (kA * x + kC * kB) + kD * kE) / (x * (kA * x + kB) + kD * kF) - kE / kF;
  };
  // Twice as bright, so that middle grey stays near its place.
  return curve(2 * std::min(value, kWhite)) / curve(kWhite);
}

double Aces(double value) {
  const double x = std::min(value, 1e6);
  return (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
}

Color Curved(const Color& color, ToneCurve curve) {
  Color shown = color;
  if (curve == ToneCurve::kReinhard) {
    const double luminance = std::min(LuminanceOf(color), 1e6);
    const double factor = (1 + luminance / (kReinhardWhite * kReinhardWhite)) / (1 + luminance);
    for (double& value : shown)
      value *= factor;
  } else if (curve == ToneCurve::kFilmic) {
    std::ranges::transform(color, shown.begin(), Filmic);
  } else if (curve == ToneCurve::kAces) {
    std::ranges::transform(color, shown.begin(), Aces);
  }
  for (double& value : shown)
    value = std::clamp(value, 0.0, 1.0);
  return shown;
}

}  // namespace

StatusOr<std::array<const ImageChannel*, 3>> ColorChannels(const Image& image) {
  const std::array channels = {image.Find("R"), image.Find("G"), image.Find("B")};
  for (const ImageChannel* channel : channels) {
    if (channel != nullptr) continue;
    return absl::InvalidArgumentError(
        "a picture needs the channels R, G and B, and this image does not have all of them");
  }
  return channels;
}

StatusOr<ToneCurve> ParseToneCurve(std::string_view name) {
  for (const auto& [known, curve] : kCurves) {
    if (known == name) return curve;
  }
  return absl::InvalidArgumentError("there are clip, reinhard, filmic and aces");
}

double AutoExposure(const Image& image) {
  const auto channels = ColorChannels(image);
  if (!channels.ok()) return 0;
  const std::size_t pixels = (*channels)[0]->pixels.size();
  double sum = 0;
  double count = 0;
  const auto look_at_every = [&](std::size_t step) {
    for (std::size_t i = 0; i < pixels; i += step) {
      Color color;
      for (std::size_t c = 0; c < 3; ++c)
        color[c] = Positive((*channels)[c]->pixels[i]);
      const double luminance = LuminanceOf(color);
      if (!(luminance > 0) || !std::isfinite(luminance)) continue;
      sum += std::log2(luminance);
      ++count;
    }
  };
  // Odd, so that it is no divisor of a usual width.
  const std::size_t step = pixels / kPixelsForExposure | 1U;
  look_at_every(step);
  if (count == 0 && step > 1) look_at_every(1);
  if (count == 0) return 0;
  const double mean = sum / count;
  if (mean >= std::log2(kDarkest) && mean <= std::log2(kBrightest)) return 0;
  return std::round(std::log2(kMiddleGrey) - mean);
}

StatusOr<DisplayedImage> DisplayedImage::Create(const Image& image, const Display& display) {
  LUCERNA_ASSIGN_OR_RETURN(const auto channels, ColorChannels(image));
  const double stops = display.exposure_stops ? *display.exposure_stops : AutoExposure(image);
  return DisplayedImage(channels, std::exp2(stops), display.curve);
}

std::array<double, 3> DisplayedImage::At(std::size_t pixel) const {
  Color color;
  for (std::size_t c = 0; c < 3; ++c)
    color[c] = std::min(gain_ * Positive(channels_[c]->pixels[pixel]), 1e30);
  return Curved(color, curve_);
}

}  // namespace lucerna
