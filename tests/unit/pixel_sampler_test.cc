// A pixel draws its numbers from sequences of its own.
#include "render/tracing/pixel_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "gtest/gtest.h"

#include "tests/support/chi_square.h"

namespace lucerna {
namespace {

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
