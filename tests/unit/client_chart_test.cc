// A reader takes numbers from a chart with a ruler: known numbers must lie where the ticks say, and
// no text from outside may turn into mark-up.
#include <cmath>
#include <limits>

#include "gtest/gtest.h"

#include "render/report/chart.h"

namespace lucerna {
namespace {

std::size_t CountOf(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
    ++count;
  return count;
}

std::vector<std::string> Labels(double low, double high) {
  std::vector<std::string> labels;
  for (const AxisTick& tick : LogTicks(low, high)) {
    if (!tick.label.empty()) labels.push_back(tick.label);
  }
  return labels;
}

Chart OneLine(std::vector<ChartPoint> points) {
  return {.title = "title",
          .description = "description",
          .x_label = "x",
          .y_label = "y",
          .series = {{.name = "line", .points = std::move(points)}}};
}

TEST(LogScaleTest, EqualRatiosAreEqualDistances) {
  const LogScale scale(1, 1000, 100, 400);
  EXPECT_DOUBLE_EQ(scale.At(1), 100);
  EXPECT_DOUBLE_EQ(scale.At(10), 200);
  EXPECT_DOUBLE_EQ(scale.At(100), 300);
  EXPECT_DOUBLE_EQ(scale.At(1000), 400);
  EXPECT_DOUBLE_EQ(scale.At(0.1), 0);
  EXPECT_DOUBLE_EQ(LogScale(1, 100, 300, 0).At(10), 150) << "upwards";
}

TEST(LogScaleTest, WhatHasNoLogarithmLiesAtTheLowEnd) {
  const LogScale scale(1, 10, 5, 6);
  EXPECT_DOUBLE_EQ(scale.At(0), 5);
  EXPECT_DOUBLE_EQ(scale.At(-3), 5);
  EXPECT_DOUBLE_EQ(scale.At(std::nan("")), 5);
}

TEST(LogTicksTest, FewDecadesHaveMoreWords) {
  EXPECT_EQ(Labels(0.9, 1e6),
            (std::vector<std::string>{"1", "10", "100", "1000", "10 k", "100 k", "1 M"}));
  EXPECT_EQ(Labels(0.9, 22), (std::vector<std::string>{"1", "2", "5", "10", "20"}));
  EXPECT_EQ(Labels(2.5, 7.5), (std::vector<std::string>{"3", "4", "5", "6", "7"}));
  EXPECT_EQ(Labels(0.009, 0.11), (std::vector<std::string>{"0.01", "0.02", "0.05", "0.1"}));
  EXPECT_EQ(Labels(1e-6, 2e-5),
            (std::vector<std::string>{"10⁻⁶", "2·10⁻⁶", "5·10⁻⁶", "10⁻⁵", "2·10⁻⁵"}));
  EXPECT_EQ(Labels(1e-30, 1e30).size(), 7U) << "and many have few";
}

TEST(LogTicksTest, TicksLieWithinTheRangeAtExactNumbers) {
  for (const AxisTick& tick : LogTicks(0.1, 100)) {
    EXPECT_GE(tick.value, 0.1);
    EXPECT_LE(tick.value, 100);
  }
  EXPECT_EQ(LogTicks(0.1, 100).front().value, 0.1);
  EXPECT_EQ(LogTicks(0.1, 100).back().value, 100);
}

TEST(ChartTest, PointsLieWhereTheirLogarithmsAre) {
  // Two decades with 4 % of air at each end: 10 is in the middle, the ends are 4/108 inside. The
  // plot is 564 wide and 300 high.
  const std::string svg = DrawChart(OneLine({{1, 1}, {10, 10}, {100, 100}}));
  EXPECT_NE(svg.find("d=\"M20.89,288.89L282,150L543.11,11.11\""), std::string::npos) << svg;
}

TEST(ChartTest, ABandRunsAlongTheUpperEndsAndBackAlongTheLower) {
  const std::string svg = DrawChart(OneLine({{1, 10, 1, 100}, {100, 10, 1, 100}}));
  EXPECT_NE(
      svg.find("class=\"band c0\" d=\"M20.89,11.11L543.11,11.11L543.11,288.89L20.89,288.89Z\""),
      std::string::npos)
      << svg;
}

TEST(ChartTest, AnIntervalDownToZeroDoesNotSqueezeTheRest) {
  const std::string svg = DrawChart(OneLine({{1, 10, 0, 100}, {100, 10, 1e-300, 100}}));
  // The range is 1 to 100 as above: a low end counts down to a tenth of its value.
  EXPECT_NE(svg.find("d=\"M20.89,150L543.11,150\""), std::string::npos) << svg;
}

TEST(ChartTest, ALevelCrossesTheWholeChart) {
  Chart chart = OneLine({{1, 1}, {100, 100}});
  chart.levels = {{"target", 10}};
  const std::string svg = DrawChart(chart);
  EXPECT_NE(svg.find("class=\"level\" d=\"M0,150h564\""), std::string::npos) << svg;
  EXPECT_NE(svg.find(">target</text>"), std::string::npos);
}

TEST(ChartTest, OnePointIsADot) {
  const std::string svg = DrawChart(OneLine({{3, 4}}));
  EXPECT_NE(svg.find("<circle class=\"dot c0\" cx=\"282\" cy=\"150\""), std::string::npos) << svg;
}

TEST(ChartTest, NothingToDrawIsSaid) {
  for (const std::vector<ChartPoint>& points :
       {std::vector<ChartPoint>{},
        std::vector<ChartPoint>{{0, 1}, {1, 0}, {-1, 1}, {std::nan(""), 1}, {HUGE_VAL, 1}}}) {
    const std::string svg = DrawChart(OneLine(points));
    EXPECT_NE(svg.find("nothing to draw yet"), std::string::npos);
    EXPECT_EQ(svg.find("<path"), std::string::npos);
  }
}

TEST(ChartTest, TheEndsOfDoublesGiveFiniteCoordinates) {
  const double least = std::numeric_limits<double>::min();
  const double most = std::numeric_limits<double>::max();
  for (const std::vector<ChartPoint>& points :
       {std::vector<ChartPoint>{{least, least}, {most, most}},
        std::vector<ChartPoint>{{most, most}}, std::vector<ChartPoint>{{least, least}}}) {
    const std::string svg = DrawChart(OneLine(points));
    EXPECT_EQ(svg.find("nan"), std::string::npos) << svg;
    EXPECT_EQ(svg.find("inf"), std::string::npos) << svg;
  }
}

TEST(ChartTest, NamesAreTextAndColorsComeRound) {
  Chart chart = OneLine({{1, 1}, {2, 2}});
  chart.title = "</title><script>alert(1)</script>";
  chart.series[0].name = "<b onclick=\"x\">&'";
  chart.series[0].color = kChartColors + 2;
  const std::string svg = DrawChart(chart);
  EXPECT_EQ(svg.find("<script"), std::string::npos);
  EXPECT_EQ(svg.find("<b "), std::string::npos);
  EXPECT_NE(svg.find("&lt;b onclick=&quot;x&quot;&gt;&amp;&#39;"), std::string::npos) << svg;
  EXPECT_NE(svg.find("line c2"), std::string::npos);
  EXPECT_EQ(CountOf(svg, "<svg"), CountOf(svg, "</svg>"));
  EXPECT_NE(ChartCss().find(".line.c6{"), std::string::npos);
  EXPECT_EQ(ChartCss().find("url"), std::string::npos);
}

TEST(EscapeMarkupTest, KeepsTextAndDropsWhatIsNone) {
  EXPECT_EQ(EscapeMarkup("Größe ≤ 2 · 𝄞"), "Größe ≤ 2 · 𝄞");
  EXPECT_EQ(EscapeMarkup("<a href='x'>&\"</a>"), "&lt;a href=&#39;x&#39;&gt;&amp;&quot;&lt;/a&gt;");
  EXPECT_EQ(EscapeMarkup(std::string_view("a\0b\x1b[31m\n\x7f", 10)), "a b [31m  ");
  // A stray byte, one of a cut character, an overlong '<', a surrogate, beyond the last.
  EXPECT_EQ(EscapeMarkup("\xff"), "\uFFFD");
  EXPECT_EQ(EscapeMarkup("a\xe2\x82"), "a\uFFFD\uFFFD");
  EXPECT_EQ(EscapeMarkup("\xc0\xbc"), "\uFFFD\uFFFD");
  EXPECT_EQ(EscapeMarkup("\xe0\x80\xbc"), "\uFFFD\uFFFD\uFFFD");
  EXPECT_EQ(EscapeMarkup("\xed\xa0\x80"), "\uFFFD\uFFFD\uFFFD");
  EXPECT_EQ(EscapeMarkup("\xf4\x90\x80\x80"), "\uFFFD\uFFFD\uFFFD\uFFFD");
}

}  // namespace
}  // namespace lucerna
