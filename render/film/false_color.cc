#include "render/film/false_color.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "render/estimate/error_estimate.h"
#include "render/film/picture_file.h"

namespace lucerna {
namespace {

constexpr double kLogarithmicFrom = 100;
constexpr double kLeftOut = 0.01;  // of the numbers, at each end of the scale

// sRGB's transfer function (IEC 61966-2-1), backwards.
double ToLinear(double coded) {
  return coded <= 0.04045 ? coded / 12.92 : std::pow((coded + 0.055) / 1.055, 2.4);
}

StatusOr<std::vector<double>> NumbersOf(const Image& image, const std::string& layer) {
  if (layer == "density") {
    const ImageChannel* const counts = image.Find("photon_count");
    const ImageChannel* const radii = image.Find("radius");
    if (counts == nullptr || radii == nullptr) {
      return absl::NotFoundError(
          "the density of photons needs the layers photon_count and radius, which the image lacks");
    }
    std::vector<double> numbers(counts->pixels.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const auto radius = static_cast<double>(radii->pixels[i]);
      numbers[i] =
          radius > 0 ? static_cast<double>(counts->pixels[i]) / (std::numbers::pi * radius * radius)
                     : NAN;
    }
    return numbers;
  }
  LUCERNA_ASSIGN_OR_RETURN(const Image picture, PictureOfLayer(image, layer));
  std::vector<double> numbers(picture.channels[0].pixels.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto at = [&](std::size_t c) {
      return static_cast<double>(picture.channels[c].pixels[i]);
    };
    const bool is_grey = at(0) == at(1) && at(1) == at(2);
    numbers[i] = is_grey ? at(0) : LuminanceOf(RgbSum{at(0), at(1), at(2)});
  }
  return numbers;
}

FalseColorScale ScaleOf(const std::vector<double>& numbers) {
  std::vector<double> finite;
  std::ranges::copy_if(numbers, std::back_inserter(finite),
                       [](double x) { return std::isfinite(x); });
  if (finite.empty()) return {};
  const auto at = [&](double share) {
    const auto place = finite.begin() +
                       static_cast<std::ptrdiff_t>(share * static_cast<double>(finite.size() - 1));
    std::ranges::nth_element(finite, place);
    return *place;
  };
  FalseColorScale scale = {.low = at(kLeftOut), .high = at(1 - kLeftOut), .is_logarithmic = false};
  // An even image is one colour.
  if (!(scale.high > scale.low)) scale.high = scale.low + std::max(1e-300, std::abs(scale.low));
  scale.is_logarithmic = scale.low > 0 && scale.high > kLogarithmicFrom * scale.low;
  return scale;
}

double ShareOf(const FalseColorScale& scale, double number) {
  if (!scale.is_logarithmic) return (number - scale.low) / (scale.high - scale.low);
  return number > 0 ? std::log(number / scale.low) / std::log(scale.high / scale.low) : 0;
}

}  // namespace

std::array<double, 3> FalseColor(double share) {
  constexpr std::array<std::array<double, 3>, 6> kStops = {{{20, 20, 70},
                                                            {30, 70, 160},
                                                            {30, 150, 150},
                                                            {90, 190, 80},
                                                            {240, 200, 50},
                                                            {255, 250, 220}}};
  const double place = std::clamp(share, 0.0, 1.0) * (kStops.size() - 1);
  const auto first = std::min(static_cast<std::size_t>(place), kStops.size() - 2);
  const double t = place - static_cast<double>(first);
  std::array<double, 3> color{};
  for (std::size_t c = 0; c < 3; ++c)
    color[c] = kStops[first][c] * (1 - t) + kStops[first + 1][c] * t;
  return color;
}

StatusOr<FalseColors> FalseColorsOf(const Image& image, const std::string& layer,
                                    std::optional<std::pair<double, double>> range) {
  LUCERNA_ASSIGN_OR_RETURN(const std::vector<double> numbers, NumbersOf(image, layer));
  FalseColors colors;
  colors.scale = ScaleOf(numbers);
  if (range) {
    const auto [low, high] = *range;
    if (!std::isfinite(low) || !std::isfinite(high) || !(low < high)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "a range of colours goes from a number to a larger one, not from ", low, " to ", high));
    }
    colors.scale = {low, high, low > 0 && high > kLogarithmicFrom * low};
  }
  colors.picture.width = image.width;
  colors.picture.height = image.height;
  for (const char* name : {"R", "G", "B"})
    colors.picture.channels.push_back({name, std::vector<float>(numbers.size())});
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!std::isfinite(numbers[i])) continue;
    const std::array<double, 3> color = FalseColor(ShareOf(colors.scale, numbers[i]));
    for (std::size_t c = 0; c < 3; ++c)
      colors.picture.channels[c].pixels[i] = static_cast<float>(ToLinear(color[c] / 255));
  }
  return colors;
}

}  // namespace lucerna
