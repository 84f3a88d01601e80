// An image as coloured characters of a terminal.
//
// Pure. Every cell is an upper half block, its ink the upper pixel and its ground the lower one, in
// 24-bit colours; brightness is that of the PNG. In ASCII a cell is a space on the mean of both.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/console.h"
#include "render/base/status.h"
#include "render/film/display.h"
#include "render/image/image.h"

namespace lucerna {

// Whether a terminal shows colours, by what the environment says of it (null: nothing): COLORTERM
// is "truecolor" or "24bit", or TERM ends with "256color"; never where NO_COLOR says something.
[[nodiscard]] bool HasColors(const char* colorterm, const char* term, const char* no_color);

// A picture small enough for a terminal, two pixels a row of text.
struct Preview {
  int width = 0, height = 0;         // [pixels]; the height is even
  std::vector<std::uint8_t> pixels;  // [height × width × 3], sRGB

  // One text a row, each with its colours and an end to them.
  [[nodiscard]] std::vector<std::string> Lines(Charset charset) const;
};

// The image averaged down to at most `columns` letters and `rows` rows of text, its proportions
// kept as well as whole pixels can, never larger than it is. Requires columns >= 1, rows >= 1.
// Errors: INVALID_ARGUMENT without R, G, B or pixels.
[[nodiscard]] StatusOr<Preview> MakePreview(const Image& image, int columns, int rows,
                                            const Display& display = {});

}  // namespace lucerna
