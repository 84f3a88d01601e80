// Eye paths begin where their pixel's filter says, and weigh what it says.
#include "render/tracing/filter_sampler.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/sobol.h"
#include "render/tracing/pixel_sampler.h"

namespace lucerna {
namespace {

using Axis = std::function<double(double)>;

// The mean of g over the filter along one axis, by midpoints.
double FilteredMean(const Axis& shape, double radius, const Axis& g) {
  constexpr int kSteps = 1 << 16;
  double sum = 0;
  double norm = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double x = radius * (2 * (i + 0.5) / kSteps - 1);
    sum += shape(x) * g(x);
    norm += shape(x);
  }
  return sum / norm;
}

// The weighted means of products g(x) h(y) over the draws, and over the filter itself.
void ExpectFilteredMeans(const PixelFilter& filter, const Axis& shape_x, const Axis& shape_y) {
  const Axis functions[] = {[](double) { return 1.0; }, [](double x) { return x; },
                            [](double x) { return x * x; }, [](double x) { return std::exp(x); }};
  const FilterSampler sampler(filter);
  constexpr int kDraws = 1 << 18;
  std::vector<FilterSampler::Draw> draws;
  for (std::uint64_t i = 0; i < kDraws; ++i) {
    const SobolPoint u = OwenSobol(i, 7);
    draws.push_back(sampler.Sample(u[0], u[1]));
    ASSERT_LE(std::abs(draws.back().x), filter.radius_x);
    ASSERT_LE(std::abs(draws.back().y), filter.radius_y);
  }
  for (const Axis& g : functions) {
    for (const Axis& h : functions) {
      double sampled = 0;
      for (const FilterSampler::Draw& draw : draws) {
        sampled += static_cast<double>(draw.weight) * g(static_cast<double>(draw.x)) *
                   h(static_cast<double>(draw.y)) / kDraws;
      }
      const double expected = FilteredMean(shape_x, static_cast<double>(filter.radius_x), g) *
                              FilteredMean(shape_y, static_cast<double>(filter.radius_y), h);
      EXPECT_NEAR(sampled, expected, 3e-3 * std::max(1.0, std::abs(expected)))
          << static_cast<int>(filter.kind);
    }
  }
}

// B = C = 1/3 over a radius of 2.
double Mitchell(double x) {
  x = std::abs(x);
  return x < 1 ? 7 * x * x * x - 12 * x * x + 16.0 / 3
               : -7.0 / 3 * x * x * x + 12 * x * x - 20 * x + 32.0 / 3;
}

// sin(πx) sin(πx/3) / x².
double Sinc(double x) {
  return x == 0 ? std::numbers::pi * std::numbers::pi / 3
                : std::sin(std::numbers::pi * x) * std::sin(std::numbers::pi * x / 3) / (x * x);
}

TEST(FilterSamplerTest, HasTheMomentsOfItsFilter) {
  const Axis box = [](double) { return 1.0; };
  ExpectFilteredMeans(PixelFilter{PixelFilter::Kind::kBox, 0.5F, 0.5F}, box, box);
  const Axis triangle = [](double x) { return 2 - std::abs(x); };
  ExpectFilteredMeans(PixelFilter{PixelFilter::Kind::kTriangle, 2, 2}, triangle, triangle);
  const Axis gaussian = [](double x) { return std::exp(-2 * x * x) - std::exp(-4.5); };
  ExpectFilteredMeans(PixelFilter{PixelFilter::Kind::kGaussian, 1.5F, 1.5F}, gaussian, gaussian);
  ExpectFilteredMeans(PixelFilter{PixelFilter::Kind::kMitchell, 2, 2}, Mitchell, Mitchell);
  ExpectFilteredMeans(PixelFilter{PixelFilter::Kind::kSinc, 4, 4}, Sinc, Sinc);
  // Negative along one axis alone, and along each by another share.
  ExpectFilteredMeans(PixelFilter{PixelFilter::Kind::kSinc, 1, 2}, Sinc, Sinc);
  ExpectFilteredMeans(PixelFilter{PixelFilter::Kind::kSinc, 2, 1}, Sinc, Sinc);
  ExpectFilteredMeans(PixelFilter{PixelFilter::Kind::kSinc, 2, 3}, Sinc, Sinc);
}

// The density of the draws, by counting them, and the filter as density times weight.
TEST(FilterSamplerTest, KnowsItsDensityAndItsFilter) {
  for (const PixelFilter& filter :
       {PixelFilter{PixelFilter::Kind::kGaussian, 1.5F, 1.5F},
        PixelFilter{PixelFilter::Kind::kMitchell, 2, 2},
        PixelFilter{PixelFilter::Kind::kSinc, 4, 4}, PixelFilter{PixelFilter::Kind::kSinc, 1, 2}}) {
    const FilterSampler sampler(filter);
    constexpr int kDraws = 1 << 20;
    constexpr int kBins = 16;
    const auto bin_of = [](float offset, float radius) {
      return std::min(static_cast<std::size_t>((offset / radius + 1) / 2 * kBins),
                      std::size_t{kBins - 1});
    };
    std::vector<double> drawn(std::size_t{kBins} * kBins);
    for (std::uint64_t i = 0; i < kDraws; ++i) {
      const SobolPoint u = OwenSobol(i, 3);
      const FilterSampler::Draw draw = sampler.Sample(u[0], u[1]);
      const FilterSampler::Parts x = sampler.AlongX(draw.x);
      const FilterSampler::Parts y = sampler.AlongY(draw.y);
      ASSERT_NEAR(FilterSampler::Value(x, y), sampler.Density(x, y) * draw.weight, 1e-5F)
          << draw.x << ' ' << draw.y;
      drawn[bin_of(draw.y, filter.radius_y) * kBins + bin_of(draw.x, filter.radius_x)] +=
          1.0 / kDraws;
    }
    constexpr int kSteps = 16;
    double whole = 0;
    for (int row = 0; row < kBins; ++row) {
      for (int column = 0; column < kBins; ++column) {
        double density = 0;
        for (int k = 0; k < kSteps * kSteps; ++k) {
          const auto place = [&](int bin, int step, float radius) {
            return radius *
                   (2 * (static_cast<float>(bin * kSteps + step) + 0.5F) / (kBins * kSteps) - 1);
          };
          const FilterSampler::Parts x = sampler.AlongX(place(column, k % kSteps, filter.radius_x));
          const FilterSampler::Parts y = sampler.AlongY(place(row, k / kSteps, filter.radius_y));
          const double area = 4 * static_cast<double>(filter.radius_x * filter.radius_y) /
                              (kBins * kBins * kSteps * kSteps);
          density += static_cast<double>(sampler.Density(x, y)) * area;
          whole += static_cast<double>(FilterSampler::Value(x, y)) * area;
        }
        EXPECT_NEAR(drawn[static_cast<std::size_t>(row * kBins + column)], density, 2e-4)
            << row << ' ' << column;
      }
    }
    EXPECT_NEAR(whole, 1, 1e-5);
    const FilterSampler::Parts beyond = sampler.AlongX(filter.radius_x * 1.001F);
    EXPECT_EQ(beyond.positive, 0);
    EXPECT_EQ(beyond.negative, 0);
    EXPECT_EQ(sampler.AlongY(-filter.radius_y * 1.001F).positive, 0);
  }
}

// A white wall is white in every pixel: the weights of a pixel's paths, over passes and beside
// them, have the mean 1 whenever their number is a multiple of twice the inverse of the share that
// is negative, and are never further from it than one path more or less.
TEST(FilterSamplerTest, HasWeightsThatAddUpInEveryPixel) {
  struct Case {
    PixelFilter filter;
    std::uint64_t passes;  // after which the mean is 1
  };
  const Case cases[] = {{PixelFilter{PixelFilter::Kind::kGaussian, 1.5F, 1.5F}, 1},
                        {PixelFilter{PixelFilter::Kind::kMitchell, 2, 2}, 32},
                        {PixelFilter{PixelFilter::Kind::kSinc, 4, 4}, 8}};
  for (const Case& c : cases) {
    const FilterSampler sampler(c.filter);
    const auto weight_of = [&](const PixelSampler& numbers) {
      const SobolPoint u = numbers.ForCamera();
      return static_cast<double>(sampler.Sample(u[0], u[1]).weight);
    };
    for (std::uint64_t pixel = 0; pixel < 200; ++pixel) {
      double first = 0;
      double more = 0;
      for (std::uint64_t pass = 0; pass < 256; ++pass) {
        first += weight_of(PixelSampler(5, pixel, pass, pass));
        for (int i = 0; i < 2; ++i)
          more += weight_of(PixelSampler::ForMore(5, pixel, pass, i, 2));
        const auto passes = static_cast<double>(pass + 1);
        if ((pass + 1) % c.passes == 0) {
          ASSERT_NEAR(first / passes, 1, 1e-6) << pixel << ' ' << pass;
          ASSERT_NEAR(more / (2 * passes), 1, 1e-6) << pixel << ' ' << pass;
        }
        // Each half has its own path that is one too many.
        constexpr double kMostWeights = 2 * 4;
        ASSERT_NEAR(first / passes, 1, kMostWeights / passes) << pixel << ' ' << pass;
      }
    }
  }
}

TEST(FilterSamplerTest, TakesTheEndsOfItsRange) {
  const float last = std::nextafter(1.0F, 0.0F);
  for (const PixelFilter& filter :
       {PixelFilter{PixelFilter::Kind::kGaussian, 1.5F, 1.5F},
        PixelFilter{PixelFilter::Kind::kMitchell, 2, 2},
        PixelFilter{PixelFilter::Kind::kSinc, 4, 4}, PixelFilter{PixelFilter::Kind::kSinc, 2, 1}}) {
    const FilterSampler sampler(filter);
    for (const float u :
         {0.0F, std::nextafter(0.25F, 0.0F), 0.25F, std::nextafter(0.0625F, 0.0F), 0.0625F, last}) {
      for (const float v : {0.0F, last}) {
        const FilterSampler::Draw draw = sampler.Sample(u, v);
        EXPECT_LE(std::abs(draw.x), filter.radius_x);
        EXPECT_LE(std::abs(draw.y), filter.radius_y);
        EXPECT_TRUE(std::isfinite(draw.weight));
        // At the end of a part of the filter that has its sign.
        float most = 0;
        for (const float near_x : {1 - 1e-6F, 1 + 1e-6F}) {
          for (const float near_y : {1 - 1e-6F, 1 + 1e-6F}) {
            most = std::max(most, FilterSampler::Value(sampler.AlongX(draw.x * near_x),
                                                       sampler.AlongY(draw.y * near_y)) *
                                      draw.weight);
          }
        }
        EXPECT_GT(most, 0) << u << ' ' << v;
      }
    }
  }
}

}  // namespace
}  // namespace lucerna
