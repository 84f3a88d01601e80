// A chart with logarithmic axes, as SVG or text.
//
// Pure: a Chart in, the text of an <svg> element out, to be put into an HTML page. Both axes are
// logarithmic, so that a power law is a straight line. The element has no ids, no script and asks
// for nothing from outside; its colours are variables that ChartCss defines once a page, for light
// and dark surroundings.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lucerna {

// A range of positive numbers laid logarithmically over [from_px, to_px].
class LogScale {
 public:
  // Requires 0 < low < high, both finite.
  LogScale(double low, double high, double from_px, double to_px);

  // Where `value` lies [px]. Outside the range it is outside the pixels too; what has no logarithm
  // lies at from_px.
  [[nodiscard]] double At(double value) const;

  [[nodiscard]] double low() const { return low_; }
  [[nodiscard]] double high() const { return high_; }

 private:
  double low_, high_;
  double from_px_, px_per_decade_;
};

// A value worth a grid line; without words it gets a fainter one.
struct AxisTick {
  double value = 0;
  std::string label;
};

// The ticks in [low, high]: words at powers of ten, at 1, 2, 5 of them when there are few, at all
// digits when there are hardly any.
[[nodiscard]] std::vector<AxisTick> LogTicks(double low, double high);

struct ChartPoint {
  double x = 0, y = 0;
  // Ends of an interval around y; 0 or below reaches the lower edge.
  std::optional<double> low = std::nullopt, high = std::nullopt;
};

enum class ChartStyle : std::uint8_t { kLine, kThinLine, kDashedLine, kDottedLine, kPoints };

// Number of colours in ChartCss.
inline constexpr int kChartColors = 7;

struct ChartSeries {
  std::string name = {};  // for the legend; empty: not there
  std::vector<ChartPoint> points = {};
  ChartStyle style = ChartStyle::kLine;
  int color = 0;  // index, modulo kChartColors
};

// A horizontal line through the whole chart, dashed.
struct ChartLevel {
  std::string name;
  double y = 0;
};

struct Chart {
  std::string title;
  std::string description;  // one sentence for those who do not see the picture
  std::string x_label, y_label;
  std::vector<ChartSeries> series;
  std::vector<ChartLevel> levels = {};
};

// The picture. Points that are not positive and finite are left out; a chart without any says so.
// Intervals are drawn as bands. Values more than six powers of ten below the largest are cut off.
[[nodiscard]] std::string DrawChart(const Chart& chart);

// The same as an .svg file of its own, with its style and a ground.
[[nodiscard]] std::string DrawChartFile(const Chart& chart);

// The rules of style that charts in a page need, once.
[[nodiscard]] std::string ChartCss();

// `text` as the text of an element or a quoted attribute of HTML or XML: no mark-up, no control
// characters, only valid UTF-8 (what is not becomes U+FFFD).
[[nodiscard]] std::string EscapeMarkup(std::string_view text);

}  // namespace lucerna
