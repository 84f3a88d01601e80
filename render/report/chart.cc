#include "render/report/chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "absl/strings/str_format.h"

#include "render/base/status.h"
#include "render/base/text.h"

namespace lucerna {
namespace {

// The picture's own units; the page scales them.
constexpr double kChartWidth = 640;
constexpr double kPlotLeft = 62, kPlotRight = 626;
constexpr double kPlotHeight = 300;
constexpr double kLegendTop = 14, kLegendRow = 20;
// Letters of a legend are about so wide; a legend that is a little too wide does no harm.
constexpr double kLetter = 6.6, kLegendMark = 30, kLegendGap = 18;
constexpr double kMostDecades = 6;

bool HasLogarithm(double value) {
  return std::isfinite(value) && value > 0;
}

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = 0;

  void Include(double value) {
    if (!HasLogarithm(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  [[nodiscard]] bool empty() const { return high == 0; }
  // At least a factor of two, and a little air around it.
  [[nodiscard]] LogScale Scale(double from_px, double to_px) const {
    constexpr double kNarrowest = 0.3010299956639812, kAir = 0.04;  // decades; share
    double from = std::log10(low);
    double to = std::log10(high);
    from = std::max(from, to - kMostDecades);
    const double missing = std::max(0.0, kNarrowest - (to - from)) / 2;
    const double air = kAir * (to - from + 2 * missing) + missing;
    // Numbers at the ends of what a double holds keep a logarithm.
    return {std::max(std::pow(10, from - air), std::numeric_limits<double>::min()),
            std::min(std::pow(10, to + air), std::numeric_limits<double>::max()), from_px, to_px};
  }
};

std::string Px(double px) {
  std::string text = absl::StrFormat("%.2f", px);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text == "-0" ? "0" : text;
}

// "0.02", "5", "2 k", "1 M", "10⁻⁶" with the digit of the power in front: "2·10⁻⁶".
std::string TickLabel(int digit, int power) {
  constexpr std::array<const char*, 5> kUnits = {"", " k", " M", " G", " T"};
  constexpr std::array<const char*, 10> kRaised = {"⁰", "¹", "²", "³", "⁴",
                                                   "⁵", "⁶", "⁷", "⁸", "⁹"};
  if (power >= -4 && power < 0) return absl::StrFormat("%.*f", -power, digit * std::pow(10, power));
  if (power >= 0 && power < 15) {
    const int unit = power < 4 ? 0 : power / 3;
    return absl::StrFormat("%.0f%s", digit * std::pow(10, power - 3 * unit),
                           kUnits[static_cast<std::size_t>(unit)]);
  }
  std::string label = digit == 1 ? "10" : Concat(digit, "·10");
  if (power < 0) label += "⁻";
  for (const char figure : std::to_string(std::abs(power))) {
    label += kRaised[static_cast<std::size_t>(figure - '0')];
  }
  return label;
}

// Where a point lies, never so far outside that a renderer loses its digits.
class Plane {
 public:
  Plane(const Range& x, const Range& y)
      : x_(x.Scale(0, kPlotRight - kPlotLeft)), y_(y.Scale(kPlotHeight, 0)) {}

  [[nodiscard]] double X(double value) const { return x_.At(value); }
  [[nodiscard]] double Y(double value) const {
    return std::clamp(y_.At(value), -kPlotHeight, 2 * kPlotHeight);
  }
  [[nodiscard]] std::string At(double x, double y) const { return Concat(Px(X(x)), ",", Px(Y(y))); }
  [[nodiscard]] const LogScale& x() const { return x_; }
  [[nodiscard]] const LogScale& y() const { return y_; }

 private:
  LogScale x_, y_;
};

std::vector<ChartPoint> Drawable(const ChartSeries& series) {
  std::vector<ChartPoint> points;
  for (const ChartPoint& point : series.points) {
    if (HasLogarithm(point.x) && HasLogarithm(point.y)) points.push_back(point);
  }
  return points;
}

std::string ColorOf(const ChartSeries& series) {
  return Concat("c", (series.color % kChartColors + kChartColors) % kChartColors);
}

const char* ClassOf(ChartStyle style) {
  switch (style) {
    case ChartStyle::kLine:
      return "line";
    case ChartStyle::kThinLine:
      return "line thin";
    case ChartStyle::kDashedLine:
      return "line dashed";
    case ChartStyle::kDottedLine:
      return "line dotted";
    case ChartStyle::kPoints:
      return "dot";
  }
  return "line";
}

std::string Band(const std::vector<ChartPoint>& points, const Plane& plane) {
  std::string upper;
  std::string lower;
  for (const ChartPoint& point : points) {
    if (!point.low || !point.high || !HasLogarithm(*point.high)) continue;
    absl::StrAppend(&upper, upper.empty() ? "M" : "L", plane.At(point.x, *point.high));
    lower = Concat("L", plane.At(point.x, *point.low), lower);
  }
  return upper.empty() ? "" : upper + lower + "Z";
}

void AppendSeries(std::string& svg, const ChartSeries& series, const Plane& plane) {
  const std::vector<ChartPoint> points = Drawable(series);
  if (points.empty()) return;
  const std::string color = ColorOf(series);
  // One point makes no line, and its interval no area: it is drawn as itself.
  const bool is_line = series.style != ChartStyle::kPoints && points.size() > 1;
  if (is_line) {
    std::string path;
    for (const ChartPoint& point : points) {
      absl::StrAppend(&path, path.empty() ? "M" : "L", plane.At(point.x, point.y));
    }
    absl::StrAppend(&svg, "<path class=\"", ClassOf(series.style), " ", color, "\" d=\"", path,
                    "\"/>");
    return;
  }
  for (const ChartPoint& point : points) {
    if (point.low && point.high && HasLogarithm(*point.high)) {
      absl::StrAppend(&svg, "<path class=\"line thin ", color, "\" d=\"M",
                      plane.At(point.x, *point.low), "L", plane.At(point.x, *point.high), "\"/>");
    }
    absl::StrAppend(&svg, "<circle class=\"dot ", color, "\" cx=\"", Px(plane.X(point.x)),
                    "\" cy=\"", Px(plane.Y(point.y)), "\" r=\"3.2\"/>");
  }
}

void AppendBand(std::string& svg, const ChartSeries& series, const Plane& plane) {
  const std::vector<ChartPoint> points = Drawable(series);
  const std::string band = points.size() > 1 ? Band(points, plane) : "";
  if (band.empty()) return;
  absl::StrAppend(&svg, "<path class=\"band ", ColorOf(series), "\" d=\"", band, "\"/>");
}

// Lays out the legend and returns how high it is; the texts go to `svg`.
double AppendLegend(std::string& svg, const Chart& chart) {
  double x = kPlotLeft;
  double y = kLegendTop;
  const auto add = [&](const std::string& name, const std::string& mark, bool has_band,
                       const std::string& color, bool is_dot) {
    if (name.empty()) return;
    // Letters, not bytes.
    const auto letters = std::count_if(name.begin(), name.end(), [](char c) {
      return (static_cast<unsigned>(c) & 0xC0U) != 0x80U;
    });
    const double width = kLegendMark + kLetter * static_cast<double>(letters);
    if (x > kPlotLeft && x + width > kPlotRight) {
      x = kPlotLeft;
      y += kLegendRow;
    }
    if (has_band) {
      absl::StrAppend(&svg, "<rect class=\"band ", color, "\" x=\"", Px(x), "\" y=\"", Px(y - 6),
                      "\" width=\"22\" height=\"12\"/>");
    }
    if (is_dot) {
      absl::StrAppend(&svg, "<circle class=\"dot ", color, "\" cx=\"", Px(x + 11), "\" cy=\"",
                      Px(y), "\" r=\"3.2\"/>");
    } else {
      absl::StrAppend(&svg, "<path class=\"", mark, "\" d=\"M", Px(x), ",", Px(y), "h22\"/>");
    }
    absl::StrAppend(&svg, "<text x=\"", Px(x + kLegendMark), "\" y=\"", Px(y + 4), "\">",
                    EscapeMarkup(name), "</text>");
    x += width + kLegendGap;
  };
  for (const ChartSeries& series : chart.series) {
    const std::vector<ChartPoint> points = Drawable(series);
    if (points.empty()) continue;
    const bool has_band = std::any_of(points.begin(), points.end(), [](const ChartPoint& point) {
      return point.high.has_value();
    });
    add(series.name, Concat(ClassOf(series.style), " ", ColorOf(series)), has_band, ColorOf(series),
        series.style == ChartStyle::kPoints);
  }
  for (const ChartLevel& level : chart.levels) {
    if (HasLogarithm(level.y)) add(level.name, "level", false, "", false);
  }
  return y + kLegendRow;
}

void AppendGrid(std::string& svg, const Plane& plane) {
  constexpr double kPlotWidth = kPlotRight - kPlotLeft;
  for (const AxisTick& tick : LogTicks(plane.x().low(), plane.x().high())) {
    const double x = plane.X(tick.value);
    absl::StrAppend(&svg, "<path class=\"", tick.label.empty() ? "faint" : "grid", "\" d=\"M",
                    Px(x), ",0v", Px(kPlotHeight), "\"/>");
    if (tick.label.empty()) continue;
    absl::StrAppend(&svg, "<text class=\"middle\" x=\"", Px(x), "\" y=\"", Px(kPlotHeight + 17),
                    "\">", tick.label, "</text>");
  }
  for (const AxisTick& tick : LogTicks(plane.y().low(), plane.y().high())) {
    const double y = plane.Y(tick.value);
    absl::StrAppend(&svg, "<path class=\"", tick.label.empty() ? "faint" : "grid", "\" d=\"M0,",
                    Px(y), "h", Px(kPlotWidth), "\"/>");
    if (tick.label.empty()) continue;
    absl::StrAppend(&svg, "<text class=\"end\" x=\"-7\" y=\"", Px(y + 4), "\">", tick.label,
                    "</text>");
  }
}

// How many bytes of `text` from `at` on are one character of UTF-8; 0: they are none.
std::size_t CharacterAt(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(at);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || at + length > text.size()) return 0;
  for (std::size_t i = at + 1; i < at + length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return 0;
  }
  // Longer than need be, a surrogate, or beyond the last character.
  const unsigned char second = byte(at + 1);
  const bool is_none = (first == 0xE0 && second < 0xA0) || (first == 0xED && second > 0x9F) ||
                       (first == 0xF0 && second < 0x90) || (first == 0xF4 && second > 0x8F);
  return is_none ? 0 : length;
}

}  // namespace

LogScale::LogScale(double low, double high, double from_px, double to_px)
    : low_(low),
      high_(high),
      from_px_(from_px),
      px_per_decade_((to_px - from_px) / (std::log10(high) - std::log10(low))) {
  LUCERNA_CHECK(HasLogarithm(low) && std::isfinite(high) && low < high);
}

double LogScale::At(double value) const {
  if (!HasLogarithm(value)) return from_px_;
  return from_px_ + px_per_decade_ * (std::log10(value) - std::log10(low_));
}

std::vector<AxisTick> LogTicks(double low, double high) {
  const double decades = std::log10(high) - std::log10(low);
  const int first = static_cast<int>(std::floor(std::log10(low)));
  const int last = static_cast<int>(std::floor(std::log10(high)));
  const int every = std::max(1, static_cast<int>(std::ceil(decades / 8)));
  std::vector<AxisTick> ticks;
  for (int power = first; power <= last; ++power) {
    for (int digit = 1; digit <= 9; ++digit) {
      // The nearest double to the number that is meant, so that 10^-1 is 0.1.
      const double value = power < 0 ? digit / std::pow(10, -power) : digit * std::pow(10, power);
      if (value < low || value > high) continue;
      const bool is_main = digit == 1 || digit == 2 || digit == 5;
      const bool has_label = digit == 1 ? power % every == 0
                             : is_main  ? decades < 2.2
                                        : decades < 0.6;
      if (digit != 1 && decades > 8) continue;
      ticks.push_back({value, has_label ? TickLabel(digit, power) : ""});
    }
  }
  return ticks;
}

std::string DrawChart(const Chart& chart) {
  Range x;
  Range y;
  for (const ChartSeries& series : chart.series) {
    for (const ChartPoint& point : Drawable(series)) {
      x.Include(point.x);
      y.Include(point.y);
      if (point.high) y.Include(*point.high);
      // An interval down to nearly nothing must not squeeze everything else.
      if (point.low) y.Include(std::max(*point.low, point.y / 10));
    }
  }
  for (const ChartLevel& level : chart.levels)
    y.Include(level.y);

  std::string legend;
  const double top = AppendLegend(legend, chart);
  const double height = top + kPlotHeight + 44;
  std::string svg =
      Concat("<svg class=\"chart\" viewBox=\"0 0 ", Px(kChartWidth), " ", Px(height),
             "\" role=\"img\" aria-label=\"", EscapeMarkup(chart.title), ". ",
             EscapeMarkup(chart.description), "\"><title>", EscapeMarkup(chart.title), "</title>");
  if (x.empty()) {
    absl::StrAppend(&svg, "<text class=\"middle\" x=\"", Px(kChartWidth / 2), "\" y=\"",
                    Px(height / 2), "\">nothing to draw yet</text></svg>\n");
    return svg;
  }
  const Plane plane(x, y);
  absl::StrAppend(&svg, legend, "<g transform=\"translate(", Px(kPlotLeft), " ", Px(top), ")\">");
  AppendGrid(svg, plane);
  absl::StrAppend(&svg, "<text class=\"middle\" x=\"", Px((kPlotRight - kPlotLeft) / 2), "\" y=\"",
                  Px(kPlotHeight + 37), "\">", EscapeMarkup(chart.x_label), "</text>");
  absl::StrAppend(&svg, "<text class=\"middle\" transform=\"translate(-48 ", Px(kPlotHeight / 2),
                  ") rotate(-90)\">", EscapeMarkup(chart.y_label), "</text>");
  // An inner <svg> cuts off what leaves the plot, without an id to be unique.
  absl::StrAppend(&svg, "<svg width=\"", Px(kPlotRight - kPlotLeft), "\" height=\"",
                  Px(kPlotHeight), "\">");
  for (const ChartSeries& series : chart.series)
    AppendBand(svg, series, plane);
  for (const ChartLevel& level : chart.levels) {
    if (!HasLogarithm(level.y)) continue;
    absl::StrAppend(&svg, "<path class=\"level\" d=\"M0,", Px(plane.Y(level.y)), "h",
                    Px(kPlotRight - kPlotLeft), "\"/>");
  }
  for (const ChartSeries& series : chart.series)
    AppendSeries(svg, series, plane);
  absl::StrAppend(&svg, "</svg><path class=\"frame\" d=\"M0,0v", Px(kPlotHeight), "h",
                  Px(kPlotRight - kPlotLeft), "\"/></g></svg>\n");
  return svg;
}

std::string DrawChartFile(const Chart& chart) {
  std::string svg = DrawChart(chart);
  constexpr std::string_view kBegin = "<svg ";
  constexpr std::string_view kTitleEnd = "</title>";
  const std::size_t title_end = svg.find(kTitleEnd);
  LUCERNA_CHECK(svg.starts_with(kBegin) && title_end != std::string::npos);
  svg.insert(title_end + kTitleEnd.size(),
             absl::StrCat("<style>", ChartCss(),
                          ":root{background:#fff}\n"
                          "@media(prefers-color-scheme:dark){:root{background:#15181c}}</style>"));
  svg.insert(kBegin.size(), "xmlns=\"http://www.w3.org/2000/svg\" ");
  return svg;
}

std::string ChartCss() {
  // Okabe and Ito's colours, which people with any kind of colour vision distinguish; darker or
  // lighter where the background needs it.
  constexpr std::array<const char*, kChartColors> kOnLight = {
      "#0067a5", "#c24e00", "#00805c", "#a8578a", "#9a6a00", "#2f86b8", "#4d4d4d"};
  constexpr std::array<const char*, kChartColors> kOnDark = {
      "#56b4e9", "#ff8a3d", "#2fc79b", "#e79ac6", "#f0c244", "#9ad1f5", "#c8c8c8"};
  const auto colors = [](const auto& names) {
    std::string css;
    for (std::size_t i = 0; i < names.size(); ++i)
      absl::StrAppend(&css, "--c", i, ":", names[i], ";");
    return css;
  };
  std::string css =
      Concat(":root{--ink:#1f2328;--grid:#d0d4d9;--faint:#eceef0;", colors(kOnLight),
             "}\n@media(prefers-color-scheme:dark){:root{",
             "--ink:#d7dbe0;--grid:#3a4047;--faint:#272b30;", colors(kOnDark), "}}\n");
  css +=
      ".chart{display:block;width:100%;height:auto;font:12px system-ui,sans-serif}\n"
      ".chart text{fill:var(--ink)}.chart .middle{text-anchor:middle}.chart .end{text-anchor:end}\n"
      ".chart .grid,.chart .faint,.chart .frame,.chart .level{fill:none;stroke:var(--grid)}\n"
      ".chart .faint{stroke:var(--faint)}.chart .frame{stroke:var(--ink)}\n"
      ".chart .level{stroke:var(--ink);stroke-width:1.5;stroke-dasharray:7 5}\n"
      ".chart .line{fill:none;stroke-width:2.4;stroke-linejoin:round;stroke-linecap:round}\n"
      ".chart .thin{stroke-width:1.3}.chart .dashed{stroke-dasharray:7 5}\n"
      ".chart .dotted{stroke-width:1.8;stroke-dasharray:.1 5}.chart .band{opacity:.2}\n"
      ".chart .dot{stroke:none}\n";
  for (int i = 0; i < kChartColors; ++i) {
    absl::StrAppend(&css, ".chart .line.c", i, "{stroke:var(--c", i, ")}.chart .dot.c", i,
                    ",.chart .band.c", i, "{fill:var(--c", i, ")}\n");
  }
  return css;
}

std::string EscapeMarkup(std::string_view text) {
  std::string escaped;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = CharacterAt(text, at);
    const char c = text[at];
    if (length == 0) {
      escaped += "\uFFFD";
    } else if (c == '&') {
      escaped += "&amp;";
    } else if (c == '<') {
      escaped += "&lt;";
    } else if (c == '>') {
      escaped += "&gt;";
    } else if (c == '"') {
      escaped += "&quot;";
    } else if (c == '\'') {
      escaped += "&#39;";
    } else if (length == 1 && (static_cast<unsigned char>(c) < 0x20 || c == 0x7F)) {
      escaped += ' ';
    } else {
      escaped.append(text.substr(at, length));
    }
    at += std::max<std::size_t>(length, 1);
  }
  return escaped;
}

}  // namespace lucerna
