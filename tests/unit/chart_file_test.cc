// A plot in a file of its own must be one that every browser draws, with nothing from outside.
#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/report/chart.h"

namespace lucerna {
namespace {

TEST(ChartFileTest, StandsAlone) {
  Chart chart;
  chart.title = "a & b";
  chart.series = {{.name = "ppm", .points = {{1, 2}, {10, 1}}}};
  const std::string svg = DrawChartFile(chart);
  EXPECT_EQ(svg.find("<svg xmlns=\"http://www.w3.org/2000/svg\" "), 0U);
  // The style comes after the title, which readers for the blind expect first.
  EXPECT_LT(svg.find("<title>a &amp; b</title>"), svg.find("<style>"));
  EXPECT_LT(svg.find("</style>"), svg.find("<path"));
  EXPECT_EQ(svg.find("<style>"), svg.rfind("<style>"));
  // What does not hold the name of the notation refers to nothing.
  EXPECT_EQ(svg.find("http"), svg.rfind("http"));
}

}  // namespace
}  // namespace lucerna
