#include "client/view/live_view.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "absl/strings/str_format.h"

#include "client/view/preview.h"
#include "render/base/status.h"
#include "render/base/text.h"
#include "render/report/convergence.h"
#include "render/report/progress_view.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

// A curve or a picture smaller than this shows nothing.
constexpr int kFewestRows = 4, kFewestColumns = 16;
constexpr int kMostRows = 14, kMostCurveColumns = 56;
// Words in front of the curve.
constexpr int kLabelColumns = 8;
constexpr int kGap = 2;

// Dots of a Braille letter, by column and row; Unicode numbers them so.
constexpr std::uint8_t kDots[2][4] = {{0x01, 0x02, 0x04, 0x40}, {0x08, 0x10, 0x20, 0x80}};

// Of 2 × 4 dots a letter.
class DotGrid {
 public:
  DotGrid(int columns, int rows)
      : columns_(columns),
        rows_(rows),
        cells_(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {}

  void Set(int x, int y) {
    if (x < 0 || y < 0 || x >= 2 * columns_ || y >= 4 * rows_) return;
    const std::size_t row = static_cast<std::size_t>(y / 4) * static_cast<std::size_t>(columns_);
    cells_[row + static_cast<std::size_t>(x / 2)] |= kDots[x % 2][y % 4];
  }
  void SetLevel(int y) { level_ = y; }

  [[nodiscard]] std::vector<std::string> Lines(Charset charset) const {
    std::vector<std::string> lines(static_cast<std::size_t>(rows_));
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      const std::size_t row = i / static_cast<std::size_t>(columns_);
      const bool has_level = level_ >= 0 && level_ / 4 == static_cast<int>(row);
      lines[row] += charset == Charset::kUtf8
                        ? Braille(has_level ? cells_[i] | kDots[0][level_ % 4] : cells_[i])
                        : std::string(1, Ascii(cells_[i], has_level));
    }
    return lines;
  }

 private:
  // U+2800 + dots, in UTF-8.
  static std::string Braille(int dots) {
    return {'\xe2', static_cast<char>(0xA0 | (dots >> 6)), static_cast<char>(0x80 | (dots & 0x3F))};
  }
  static char Ascii(int dots, bool has_level) {
    constexpr int kUpper = kDots[0][0] | kDots[0][1] | kDots[1][0] | kDots[1][1];
    if (dots == 0) return has_level ? '-' : ' ';
    return (dots & kUpper) == 0 ? '.' : (dots & ~kUpper) == 0 ? '\'' : ':';
  }

  int columns_, rows_;
  std::vector<std::uint8_t> cells_;
  int level_ = -1;  // row of dots; -1: none
};

bool HasLogarithm(double value) {
  return std::isfinite(value) && value > 0;
}

// Bytes of the escape sequence or letter that begins at `at`, and the columns it takes.
struct Step {
  std::size_t size_bytes = 1;
  int columns = 1;
};
Step StepAt(std::string_view text, std::size_t at) {
  if (text[at] == '\x1b') {
    // ESC [ parameters, to a letter.
    std::size_t end = at + 1;
    if (end < text.size() && text[end] == '[') {
      ++end;
      while (end < text.size() && (text[end] < '@' || text[end] > '~'))
        ++end;
    }
    return {std::min(text.size(), end + 1) - at, 0};
  }
  std::size_t end = at + 1;
  while (end < text.size() && (static_cast<unsigned>(text[end]) & 0xC0U) == 0x80U)
    ++end;
  return {end - at, 1};
}

std::string Padded(const std::string& text, int columns) {
  const int missing = std::max(0, columns - ColumnsOf(text));
  return text + std::string(static_cast<std::size_t>(missing), ' ');
}

std::string RightAligned(const std::string& text, int columns) {
  const int missing = std::max(0, columns - ColumnsOf(text));
  return std::string(static_cast<std::size_t>(missing), ' ') + text;
}

// The line broken where its parts meet, at two spaces, when it is wider than `columns`.
std::vector<std::string> Broken(const std::string& line, int columns) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < line.size();) {
    const std::size_t gap = std::min(line.find("  ", at), line.size());
    const std::string part = line.substr(at, gap - at);
    if (!lines.empty() && ColumnsOf(lines.back()) + 2 + ColumnsOf(part) <= columns) {
      lines.back() += "  " + part;
    } else {
      lines.push_back(part);
    }
    at = std::min(line.size(), gap + 2);
  }
  return lines;
}

// The text broken at single spaces where it is wider than `columns`.
std::vector<std::string> Wrapped(const std::string& text, int columns) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t gap = std::min(text.find(' ', at), text.size());
    const std::string word = text.substr(at, gap - at);
    if (!lines.empty() && ColumnsOf(lines.back()) + 1 + ColumnsOf(word) <= columns) {
      lines.back() += " " + word;
    } else {
      lines.push_back(word);
    }
    at = gap + 1;
  }
  return lines;
}

// The curve with the error at its upper and lower end in front, and the time below; `rows` lines.
std::vector<std::string> LabelledCurve(const v1::Job& job, int columns, int rows, Charset charset) {
  std::vector<ChartPoint> points;
  for (const v1::ErrorSample& sample : job.convergence()) {
    const ChartPoint point{Abscissa(sample, ErrorAgainst::kTime), ErrorOf(sample).value};
    if (HasLogarithm(point.x) && HasLogarithm(point.y)) points.push_back(point);
  }
  if (points.size() < 2 || columns < kFewestColumns || rows < kFewestRows) return {};
  const double target = SettingsOf(job).error;
  const int curve_columns = columns - kLabelColumns - 1;
  std::vector<std::string> lines = DrawCurve(
      points, target > 0 ? std::optional(target) : std::nullopt, curve_columns, rows - 1, charset);
  double low = target > 0 ? target : points.front().y;
  double high = low;
  for (const ChartPoint& point : points) {
    low = std::min(low, point.y);
    high = std::max(high, point.y);
  }
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string label = i == 0                  ? ShortPercent(high)
                              : i + 1 == lines.size() ? ShortPercent(low)
                                                      : "";
    lines[i] = Concat(RightAligned(label, kLabelColumns), " ", lines[i]);
  }
  const auto time = [](double seconds) {
    return ShortTime(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds)));
  };
  const std::string first = time(points.front().x);
  lines.push_back(Concat(std::string(kLabelColumns + 1, ' '), first,
                         RightAligned(time(points.back().x), curve_columns - ColumnsOf(first))));
  return lines;
}

void AppendBeside(std::vector<std::string>& lines, const std::vector<std::string>& left,
                  int left_columns, const std::vector<std::string>& right) {
  for (std::size_t i = 0; i < std::max(left.size(), right.size()); ++i) {
    std::string line = i < left.size() ? left[i] : "";
    if (i < right.size()) line = Padded(line, left_columns) + right[i];
    lines.push_back(line);
  }
}

}  // namespace

std::vector<std::string> DrawCurve(const std::vector<ChartPoint>& points,
                                   std::optional<double> level, int columns, int rows,
                                   Charset charset) {
  LUCERNA_CHECK(columns >= 1 && rows >= 1);
  std::vector<ChartPoint> drawn;
  for (const ChartPoint& point : points) {
    if (HasLogarithm(point.x) && HasLogarithm(point.y)) drawn.push_back(point);
  }
  if (drawn.size() < 2) return {};
  double x_low = drawn[0].x;
  double x_high = x_low;
  double y_low = level.value_or(drawn[0].y);
  double y_high = y_low;
  for (const ChartPoint& point : drawn) {
    x_low = std::min(x_low, point.x);
    x_high = std::max(x_high, point.x);
    y_low = std::min(y_low, point.y);
    y_high = std::max(y_high, point.y);
  }
  // A curve without extent is a dot or a level line; any range around it will do.
  if (!(x_low < x_high)) x_high = 2 * x_low;
  if (!(y_low < y_high)) y_low = y_high / 2;
  const LogScale x(x_low, x_high, 0, 2 * columns - 1);
  const LogScale y(y_low, y_high, 4 * rows - 1, 0);
  DotGrid grid(columns, rows);
  for (std::size_t i = 0; i + 1 < drawn.size(); ++i) {
    const double x0 = x.At(drawn[i].x);
    const double y0 = y.At(drawn[i].y);
    const double dx = x.At(drawn[i + 1].x) - x0;
    const double dy = y.At(drawn[i + 1].y) - y0;
    // A dot a step: no gap, and no thicker than need be.
    const int steps =
        std::max(1, static_cast<int>(std::ceil(std::max(std::abs(dx), std::abs(dy)))));
    for (int step = 0; step <= steps; ++step) {
      const double share = static_cast<double>(step) / steps;
      grid.Set(static_cast<int>(std::lround(x0 + share * dx)),
               static_cast<int>(std::lround(y0 + share * dy)));
    }
  }
  if (level) grid.SetLevel(static_cast<int>(std::lround(y.At(*level))));
  return grid.Lines(charset);
}

int ColumnsOf(std::string_view text) {
  int columns = 0;
  for (std::size_t at = 0; at < text.size();) {
    const Step step = StepAt(text, at);
    columns += step.columns;
    at += step.size_bytes;
  }
  return columns;
}

std::string CutTo(const std::string& text, int columns) {
  int left = columns;
  std::size_t at = 0;
  while (at < text.size()) {
    const Step step = StepAt(text, at);
    if (step.columns > left) break;
    left -= step.columns;
    at += step.size_bytes;
  }
  const std::string cut = text.substr(0, at);
  return at < text.size() && cut.find('\x1b') != std::string::npos ? cut + "\x1b[0m" : cut;
}

std::vector<std::string> LiveLines(const v1::Job& job, const Image* image, TerminalSize size,
                                   Charset charset, const Display& display) {
  // Before they are cut to the width: what ASCII has for a letter may be longer.
  std::vector<std::string> lines = Broken(InCharset(ProgressLine(job), charset), size.columns);
  for (std::string& line : Broken(InCharset(ErrorLine(job), charset), size.columns))
    lines.push_back(std::move(line));
  for (const std::string& note : ErrorNotes(job)) {
    for (std::string& line : Wrapped(InCharset(note, charset), size.columns))
      lines.push_back(std::move(line));
  }
  // The line that the cursor may need stays free.
  int rows = std::min(kMostRows, size.rows - 1 - static_cast<int>(lines.size()));
  const bool is_wide = size.columns >= 2 * (kFewestColumns + kLabelColumns);
  const int curve_columns = std::min(
      kMostCurveColumns, image != nullptr && is_wide ? (size.columns - kGap) / 2 : size.columns);
  const std::vector<std::string> curve = LabelledCurve(job, curve_columns, rows, charset);

  std::vector<std::string> picture;
  const bool is_beside = !curve.empty() && is_wide;
  const int used = is_beside ? curve_columns + kGap : 0;
  if (!curve.empty() && !is_beside)
    rows = size.rows - 1 - static_cast<int>(lines.size() + curve.size());
  if (image != nullptr && rows >= kFewestRows && size.columns - used >= kFewestColumns) {
    const auto preview =
        MakePreview(*image, size.columns - used, std::min(rows, kMostRows), display);
    if (preview.ok()) picture = preview->Lines(charset);
  }
  if (is_beside) {
    AppendBeside(lines, curve, used, picture);
  } else {
    lines.insert(lines.end(), curve.begin(), curve.end());
    lines.insert(lines.end(), picture.begin(), picture.end());
  }
  if (static_cast<int>(lines.size()) >= size.rows) {
    lines.resize(static_cast<std::size_t>(std::max(1, size.rows - 1)));
  }
  for (std::string& line : lines)
    line = CutTo(line, std::max(1, size.columns));
  return lines;
}

std::string FramePainter::Paint(const std::vector<std::string>& lines, TerminalSize size) {
  if (lines == shown_ && size == size_) return {};
  int rows_up = -1;
  for (const std::string& line : shown_)
    rows_up += std::max(1, (ColumnsOf(line) + size.columns - 1) / std::max(1, size.columns));
  // As one update, where the terminal has the command for it; others ignore it.
  std::string text = "\x1b[?2026h\r";
  if (rows_up > 0) absl::StrAppend(&text, "\x1b[", std::min(rows_up, size.rows - 1), "A");
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (i > 0) text += "\r\n";
    // The picture changes seldom, the numbers often. The last line puts the cursor at its end, from
    // where the rest of the screen is cleared.
    const bool is_there = size == size_ && i < shown_.size() && lines[i] == shown_[i];
    if (is_there && i + 1 < lines.size()) continue;
    // What is left of a longer line goes after the new one is written, not before: no flicker.
    absl::StrAppend(&text, lines[i], "\x1b[K");
  }
  absl::StrAppend(&text, "\x1b[J\x1b[?2026l");
  shown_ = lines;
  size_ = size;
  return text;
}

std::string FramePainter::Finish() {
  const bool has_frame = !shown_.empty();
  shown_.clear();
  return has_frame ? "\n" : "";
}

}  // namespace lucerna
