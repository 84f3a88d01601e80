#include "client/view/preview.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "absl/strings/str_format.h"

#include "render/film/png_file.h"

namespace lucerna {
namespace {

// The mean over the pixels [x0, x1) × [y0, y1). None is brighter than white: one speck must not
// light up its whole neighbourhood.
std::array<double, 3> MeanOf(const DisplayedImage& shown, int width, int x0, int x1, int y0,
                             int y1) {
  std::array<double, 3> sum{};
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      const std::array<double, 3> color =
          shown.At(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                   static_cast<std::size_t>(x));
      for (std::size_t c = 0; c < 3; ++c)
        sum[c] += color[c];
    }
  }
  for (double& value : sum)
    value /= static_cast<double>(x1 - x0) * (y1 - y0);
  return sum;
}

}  // namespace

bool HasColors(const char* colorterm, const char* term, const char* no_color) {
  if (no_color != nullptr && *no_color != '\0') return false;
  const std::string_view colors = colorterm == nullptr ? "" : colorterm;
  const std::string_view name = term == nullptr ? "" : term;
  return colors == "truecolor" || colors == "24bit" || name.ends_with("256color");
}

std::vector<std::string> Preview::Lines(Charset charset) const {
  std::vector<std::string> lines;
  const auto at = [&](int x, int y) {
    return 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                static_cast<std::size_t>(x));
  };
  const auto colors_of = [&](int x, int y) {
    const std::uint8_t* const upper = &pixels[at(x, y)];
    const std::uint8_t* const lower = &pixels[at(x, y + 1)];
    if (charset == Charset::kAscii) {
      const auto mean = [&](int c) { return (upper[c] + lower[c] + 1) / 2; };
      return absl::StrFormat("\x1b[48;2;%d;%d;%dm", mean(0), mean(1), mean(2));
    }
    return absl::StrFormat("\x1b[38;2;%d;%d;%d;48;2;%d;%d;%dm", upper[0], upper[1], upper[2],
                           lower[0], lower[1], lower[2]);
  };
  const char* const cell = charset == Charset::kAscii ? " " : "▀";
  for (int y = 0; y + 1 < height; y += 2) {
    std::string line;
    std::string last;
    for (int x = 0; x < width; ++x) {
      std::string colors = colors_of(x, y);
      // Neighbours are often alike.
      if (colors != last) line += colors;
      line += cell;
      last = std::move(colors);
    }
    lines.push_back(line + "\x1b[0m");
  }
  return lines;
}

StatusOr<Preview> MakePreview(const Image& image, int columns, int rows, const Display& display) {
  LUCERNA_CHECK(columns >= 1 && rows >= 1);
  if (image.width < 1 || image.height < 1) {
    return absl::InvalidArgumentError("an image without pixels has no preview");
  }
  const double scale =
      std::min({1.0, static_cast<double>(columns) / image.width, 2.0 * rows / image.height});
  Preview preview;
  preview.width = std::clamp(static_cast<int>(std::lround(scale * image.width)), 1, columns);
  // An even number, so that the last row of text has both its pixels.
  preview.height = 2 * std::clamp(static_cast<int>(std::lround(scale * image.height / 2)), 1, rows);
  LUCERNA_ASSIGN_OR_RETURN(const DisplayedImage shown, DisplayedImage::Create(image, display));
  // The box of pixels that falls on one of the smaller picture.
  const auto first = [](int index, int from, int to) {
    return static_cast<int>(std::int64_t{index} * from / to);
  };
  for (int y = 0; y < preview.height; ++y) {
    const int y0 = first(y, image.height, preview.height);
    const int y1 = std::max(y0 + 1, first(y + 1, image.height, preview.height));
    for (int x = 0; x < preview.width; ++x) {
      const int x0 = first(x, image.width, preview.width);
      const int x1 = std::max(x0 + 1, first(x + 1, image.width, preview.width));
      for (const double value : MeanOf(shown, image.width, x0, x1, y0, y1))
        preview.pixels.push_back(EncodeSrgb(value));
    }
  }
  return preview;
}

}  // namespace lucerna
