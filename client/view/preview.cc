#include "client/view/preview.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"

#include "render/film/png_file.h"

namespace lucerna {
namespace {

// The mean over the box of pixels that falls on one pixel of the smaller picture. None is brighter
// than white: one speck must not light up its whole neighbourhood.
ImageChannel Shrunk(const ImageChannel& channel, int from_width, int from_height, int to_width,
                    int to_height) {
  ImageChannel shrunk{channel.name, {}};
  const auto first = [](int index, int from, int to) {
    return static_cast<int>(std::int64_t{index} * from / to);
  };
  for (int y = 0; y < to_height; ++y) {
    const int y0 = first(y, from_height, to_height);
    const int y1 = std::max(y0 + 1, first(y + 1, from_height, to_height));
    for (int x = 0; x < to_width; ++x) {
      const int x0 = first(x, from_width, to_width);
      const int x1 = std::max(x0 + 1, first(x + 1, from_width, to_width));
      double sum = 0;
      for (int row = y0; row < y1; ++row) {
        for (int column = x0; column < x1; ++column) {
          sum += static_cast<double>(
              channel.pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(from_width) +
                             static_cast<std::size_t>(column)]);
        }
      }
      shrunk.pixels.push_back(static_cast<float>(sum / ((y1 - y0) * (x1 - x0))));
    }
  }
  return shrunk;
}

}  // namespace

bool HasColors(const char* colorterm, const char* term, const char* no_color) {
  if (no_color != nullptr && *no_color != '\0') return false;
  const std::string_view colors = colorterm == nullptr ? "" : colorterm;
  const std::string_view name = term == nullptr ? "" : term;
  return colors == "truecolor" || colors == "24bit" || name.ends_with("256color");
}

std::vector<std::string> Preview::Lines() const {
  std::vector<std::string> lines;
  const auto color = [&](int x, int y) {
    const std::size_t at = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                static_cast<std::size_t>(x));
    return absl::StrFormat("%d;%d;%d", pixels[at], pixels[at + 1], pixels[at + 2]);
  };
  for (int y = 0; y + 1 < height; y += 2) {
    std::string line;
    std::string last;
    for (int x = 0; x < width; ++x) {
      std::string colors = absl::StrCat("\x1b[38;2;", color(x, y), ";48;2;", color(x, y + 1), "m");
      // Neighbours are often alike.
      if (colors != last) line += colors;
      line += "▀";
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
  LUCERNA_ASSIGN_OR_RETURN(auto shown, DisplayedChannels(image, display));
  for (ImageChannel& channel : shown)
    channel = Shrunk(channel, image.width, image.height, preview.width, preview.height);
  preview.pixels = ScreenPixels(shown);
  return preview;
}

}  // namespace lucerna
