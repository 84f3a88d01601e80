// A pixel draws its positions from its filter, and its numbers from sequences of its own.
#include "render/tracing/pixel_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "gtest/gtest.h"

#include "tests/support/chi_square.h"

namespace lucerna {
namespace {

PixelFilter Filter(PixelFilter::Kind kind, float radius) {
  PixelFilter filter;
  filter.kind = kind;
  filter.radius_x = radius;
  filter.radius_y = radius;
  return filter;
}

// The weighted mean of g over the samples, and over the filter itself by midpoints.
template <typename Shape, typename Test>
void ExpectFilteredMean(const PixelFilter& filter, double radius, const Shape& shape,
                        const Test& g) {
  const FilterSampler sampler(filter, filter.radius_x);
  constexpr int kSteps = 1 << 18;
  double sampled = 0;
  double expected = 0;
  double norm = 0;
  for (int i = 0; i < kSteps; ++i) {
    float weight = 1;
    const float offset = sampler.Sample((static_cast<float>(i) + 0.5F) / kSteps, weight);
    ASSERT_LE(std::abs(offset), filter.radius_x);
    sampled += static_cast<double>(weight) * g(static_cast<double>(offset)) / kSteps;
    const double x = radius * (2 * (i + 0.5) / kSteps - 1);
    expected += shape(x) * g(x);
    norm += shape(x);
  }
  EXPECT_NEAR(sampled, expected / norm, 2e-3);
}

TEST(FilterSamplerTest, HasTheMomentsOfItsFilter) {
  const auto tests = {+[](double) { return 1.0; }, +[](double x) { return x; },
                      +[](double x) { return x * x; }, +[](double x) { return std::exp(x); }};
  for (const auto& g : tests) {
    ExpectFilteredMean(
        Filter(PixelFilter::Kind::kBox, 0.5F), 0.5, [](double) { return 1.0; }, g);
    ExpectFilteredMean(
        Filter(PixelFilter::Kind::kTriangle, 2), 2, [](double x) { return 2 - std::abs(x); }, g);
    ExpectFilteredMean(
        Filter(PixelFilter::Kind::kGaussian, 1.5F), 1.5,
        [](double x) { return std::exp(-2 * x * x) - std::exp(-4.5); }, g);
    // B = C = 1/3 over a radius of 2.
    ExpectFilteredMean(
        Filter(PixelFilter::Kind::kMitchell, 2), 2,
        [](double x) {
          x = std::abs(x);
          return x < 1 ? 7 * x * x * x - 12 * x * x + 16.0 / 3
                       : -7.0 / 3 * x * x * x + 12 * x * x - 20 * x + 32.0 / 3;
        },
        g);
    // sin(πx) sin(πx/3) / x².
    ExpectFilteredMean(
        Filter(PixelFilter::Kind::kSinc, 4), 4,
        [](double x) {
          return x == 0 ? std::numbers::pi * std::numbers::pi / 3
                        : std::sin(std::numbers::pi * x) * std::sin(std::numbers::pi * x / 3) /
                              (x * x);
        },
        g);
  }
}

// The density of the draws, by counting them, and the filter as density times weight.
TEST(FilterSamplerTest, KnowsItsDensityAndItsFilter) {
  for (const PixelFilter& filter :
       {Filter(PixelFilter::Kind::kGaussian, 1.5F), Filter(PixelFilter::Kind::kMitchell, 2),
        Filter(PixelFilter::Kind::kSinc, 4)}) {
    const FilterSampler sampler(filter, filter.radius_x);
    constexpr int kDraws = 1 << 18;
    constexpr int kBins = 32;
    std::vector<double> drawn(kBins);
    for (int i = 0; i < kDraws; ++i) {
      float weight = 1;
      const float offset = sampler.Sample((static_cast<float>(i) + 0.5F) / kDraws, weight);
      const FilterSampler::Values values = sampler.At(offset);
      ASSERT_NEAR(values.filter, values.density * weight, 1e-5F) << offset;
      const float place = (offset / filter.radius_x + 1) / 2 * kBins;
      drawn[std::min(static_cast<std::size_t>(place), drawn.size() - 1)] += 1.0 / kDraws;
    }
    double whole = 0;
    for (int bin = 0; bin < kBins; ++bin) {
      constexpr int kSteps = 64;
      const double width = 2 * static_cast<double>(filter.radius_x) / (kBins * kSteps);
      double density = 0;
      for (int k = 0; k < kSteps; ++k) {
        const auto x = static_cast<float>((bin * kSteps + k + 0.5) * width -
                                          static_cast<double>(filter.radius_x));
        density += static_cast<double>(sampler.At(x).density) * width;
        whole += static_cast<double>(sampler.At(x).filter) * width;
      }
      EXPECT_NEAR(drawn[static_cast<std::size_t>(bin)], density, 1e-4) << bin;
    }
    EXPECT_NEAR(whole, 1, 1e-5);
    EXPECT_EQ(sampler.At(filter.radius_x * 1.001F).density, 0);
    EXPECT_EQ(sampler.At(-filter.radius_x * 1.001F).filter, 0);
  }
}

TEST(FilterSamplerTest, TakesTheEndsOfItsRange) {
  const FilterSampler sampler(Filter(PixelFilter::Kind::kGaussian, 1.5F), 1.5F);
  float weight = 1;
  EXPECT_GE(sampler.Sample(0, weight), -1.5F);
  EXPECT_LE(sampler.Sample(std::nextafter(1.0F, 0.0F), weight), 1.5F);
  EXPECT_TRUE(std::isfinite(weight));
}

TEST(PixelSamplerTest, StratifiesThePassesOfAPixel) {
  constexpr int kPasses = 64;
  std::vector<int> film(kPasses);
  std::vector<int> light(kPasses);
  // The odd passes; the even ones are another set of points.
  for (std::uint64_t pass = 1; pass < 2 * kPasses; pass += 2) {
    const PixelSampler sampler(1, 17, pass, pass);
    ++film[static_cast<std::size_t>(sampler.ForCamera()[0] * kPasses)];
    ++light[static_cast<std::size_t>(sampler.ForVertex(2)[4] * kPasses)];
  }
  EXPECT_EQ(*std::ranges::max_element(film), 1);
  EXPECT_EQ(*std::ranges::max_element(light), 1);
}

// Paths beside the first ones: those of each pass are spread evenly by themselves, those of all
// passes together, and none has the numbers of another, also where their number has risen.
TEST(PixelSamplerTest, StratifiesThePathsBesideTheFirst) {
  constexpr int kPasses = 16;
  constexpr int kCount = 4;
  constexpr std::size_t kPaths = std::size_t{kPasses} * kCount;
  std::vector<int> all(kPaths);
  std::vector<float> met;
  for (std::uint64_t pass = 1; pass < 2 * kPasses; pass += 2) {
    std::vector<int> of_pass(kCount);
    for (int i = 0; i < kCount; ++i) {
      const PixelSampler sampler = PixelSampler::ForMore(1, 17, pass, i, kCount);
      const float light = sampler.ForVertex(2)[4];
      ++all[static_cast<std::size_t>(light * kPaths)];
      const float film = sampler.ForCamera()[0];
      ++of_pass[static_cast<std::size_t>(film * kCount)];
      met.push_back(film);
    }
    EXPECT_EQ(std::ranges::max(of_pass), 1) << pass;
  }
  EXPECT_EQ(std::ranges::max(all), 1);
  for (std::uint64_t pass = 0; pass < 2 * kPasses; ++pass)
    met.push_back(PixelSampler(1, 17, pass, pass).ForCamera()[0]);
  for (std::uint64_t pass = 2 * kPasses + 1; pass < 4 * kPasses; pass += 2) {
    for (int i = 0; i < 2 * kCount; ++i)
      met.push_back(PixelSampler::ForMore(1, 17, pass, i, 2 * kCount).ForCamera()[0]);
  }
  std::ranges::sort(met);
  EXPECT_EQ(std::ranges::adjacent_find(met), met.end());
}

// Photons of every 16th pass are alike in the first digits of their sequence (every 8th of the even
// passes). With them a pixel must not meet the same part of itself each time.
TEST(PixelSamplerTest, MeetsThePhotonsOfEachPassEverywhere) {
  constexpr std::uint64_t kSampled = 20;
  constexpr std::size_t kParts = 8;
  std::size_t met = 0;
  for (std::uint64_t pixel = 0; pixel < kSampled; ++pixel) {
    std::array<bool, kParts> parts{};
    for (std::uint64_t pass = 6; pass < 16 * 64; pass += 16) {
      const float x = PixelSampler(1, pixel, pass, pass).ForCamera()[0];
      parts[static_cast<std::size_t>(x * kParts)] = true;
    }
    met += static_cast<std::size_t>(std::ranges::count(parts, true));
  }
  // Of 64 independent places, each part is missed by one pixel in 5,000.
  EXPECT_GE(met, kSampled * kParts - 2);
}

// The numbers of one vertex against the same ones of another, and of the camera.
TEST(PixelSamplerTest, KeepsVerticesAndPixelsApart) {
  constexpr int kPasses = 16384;
  constexpr std::size_t kSide = 16;
  const std::vector<double> expected(kSide * kSide, static_cast<double>(kPasses) / (kSide * kSide));
  const double level = SidakLevel(1e-3, 30);
  const auto p_value = [&](const auto& first, const auto& second) {
    std::vector<double> observed(kSide * kSide);
    for (std::uint64_t pass = 0; pass < kPasses; ++pass) {
      observed[static_cast<std::size_t>(first(pass) * kSide) * kSide +
               static_cast<std::size_t>(second(pass) * kSide)] += 1;
    }
    return ChiSquarePValue(observed, expected);
  };
  const auto vertex = [](int number, std::uint64_t pixel) {
    return
        [=](std::uint64_t i) { return PixelSampler(1, pixel, 2 * i, 2 * i).ForVertex(number)[1]; };
  };
  const auto camera = [](std::uint64_t pixel) {
    return [=](std::uint64_t i) { return PixelSampler(1, pixel, 2 * i, 2 * i).ForCamera()[1]; };
  };
  for (int a = 0; a < 6; ++a) {
    EXPECT_GT(p_value(camera(3), vertex(a, 3)), level) << a;
    EXPECT_GT(p_value(vertex(a, 3), vertex(a, 4)), level) << a;
    for (int b = a + 1; b < 6; ++b)
      EXPECT_GT(p_value(vertex(a, 3), vertex(b, 3)), level) << a << b;
  }
}

}  // namespace
}  // namespace lucerna
