// The view of a running job on a terminal.
//
// A frame is a few lines: the progress line, the error, a curve of the error and, where there are
// colours, the image so far. Frames replace one another in place. Pure: a job, a picture and the
// size of the terminal in, text out.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/view/terminal.h"
#include "proto/lucerna/v1/jobs.pb.h"
#include "render/base/console.h"
#include "render/film/display.h"
#include "render/image/image.h"
#include "render/report/chart.h"

namespace lucerna {

// The curve through `points`, both axes logarithmic, in Braille letters of 2 × 4 dots; `level` is a
// line of every other dot. In ASCII ' and . are the curve in the upper and lower half of a letter,
// : in both, and - is the level. `rows` texts of exactly `columns` letters; none when nothing can
// be drawn. Requires columns >= 1, rows >= 1.
[[nodiscard]] std::vector<std::string> DrawCurve(const std::vector<ChartPoint>& points,
                                                 std::optional<double> level, int columns, int rows,
                                                 Charset charset);

// How many columns `text` takes; escape sequences take none. The program's own letters are one
// column wide each.
[[nodiscard]] int ColumnsOf(std::string_view text);

// `text` cut to `columns` columns; colours are ended.
[[nodiscard]] std::string CutTo(const std::string& text, int columns);

// The lines of a frame. None is wider than the terminal, and there are fewer than it has rows.
// `image` may be null.
[[nodiscard]] std::vector<std::string> LiveLines(const v1::Job& job, const Image* image,
                                                 TerminalSize size, Charset charset,
                                                 const Display& display = {});

// Writes frames over one another.
class FramePainter {
 public:
  // What to write so that `lines` stand where the last frame stood: the lines that changed. The
  // cursor stays on the last line. What a terminal that was made narrower has wrapped is replaced
  // too.
  [[nodiscard]] std::string Paint(const std::vector<std::string>& lines, TerminalSize size);
  // What to write before anything else is written.
  [[nodiscard]] std::string Finish();

 private:
  std::vector<std::string> shown_;
  TerminalSize size_;
};

}  // namespace lucerna
