// Is what passes bring at their three wavelengths, on average, the colour of the spectrum?
#include "render/math/pass_wavelengths.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/color_matching.h"
#include "render/math/color_space.h"
#include "render/math/sobol.h"

namespace lucerna {
namespace {

using Triple = std::array<double, 3>;

// The colour of light with the spectrum f(λ)·D65(λ), white being (1, 1, 1): a sum over 0.1 nm that
// knows nothing of passes.
Triple ColorOfSpectrum(const std::function<double(double nm)>& f) {
  constexpr double kStepNm = 0.1;
  Triple color{};
  Triple white{};
  for (double nm = kFirstObservedNm; nm < kLastObservedNm; nm += kStepNm) {
    const double at = nm + 0.5 * kStepNm;
    const Triple rec709 = Rec709(CieObserver(at));
    for (std::size_t c = 0; c < 3; ++c) {
      color[c] += rec709[c] * D65At(at) * f(at);
      white[c] += rec709[c] * D65At(at);
    }
  }
  for (std::size_t c = 0; c < 3; ++c)
    color[c] /= white[c];
  return color;
}

Triple ColorAt(const PassWavelengths& wavelengths, const std::function<double(double nm)>& f) {
  return ToRec709(
      wavelengths.ToWorking({f(wavelengths.nm[0]), f(wavelengths.nm[1]), f(wavelengths.nm[2])}));
}

double Red(double nm) {
  return 0.05 + 0.6 / (1 + std::exp(-(nm - 600) / 12));
}
double Green(double nm) {
  return 0.05 + 0.45 * std::exp(-(nm - 530) * (nm - 530) / (45.0 * 45));
}
double Blue(double nm) {
  return 0.1 + 0.6 / (1 + std::exp((nm - 490) / 15));
}
// A line of a lamp, 10 nm wide.
double Line(double nm) {
  return std::exp(-(nm - 546) * (nm - 546) / 50);
}

TEST(PassWavelengthsTest, GreyIsGreyInEveryPass) {
  for (int i = 0; i <= 1000; ++i) {
    const PassWavelengths wavelengths = WavelengthsAt(i / 1000.0);
    for (const Triple& row : wavelengths.to_working)
      ASSERT_NEAR(row[0] + row[1] + row[2], 1, 1e-12) << i;
  }
}

TEST(PassWavelengthsTest, EachMovesUpThroughItsPartAndWeighsAboveZero) {
  PassWavelengths before;
  before.nm = {kThirdPartNm, kSecondPartNm, kFirstObservedNm};
  for (int i = 0; i <= 1000; ++i) {
    const PassWavelengths now = WavelengthsAt(i / 1000.0);
    for (std::size_t w = 0; w < 3; ++w) {
      ASSERT_GE(now.nm[w], before.nm[w]) << i;
      // Its luminance.
      const Triple rec709 =
          ToRec709({now.to_working[0][w], now.to_working[1][w], now.to_working[2][w]});
      ASSERT_GE(0.2126 * rec709[0] + 0.7152 * rec709[1] + 0.0722 * rec709[2], 0) << i;
    }
    before = now;
  }
  EXPECT_NEAR(before.nm[1], kThirdPartNm, 0.01);
  EXPECT_NEAR(before.nm[2], kSecondPartNm, 0.01);
}

TEST(PassWavelengthsTest, TheMeanColorIsThatOfTheSpectrum) {
  constexpr int kPlaces = 4000;
  for (const auto& spectrum : {Red, Green, Blue, Line}) {
    Triple mean{};
    for (int i = 0; i < kPlaces; ++i) {
      const Triple color = ColorAt(WavelengthsAt((i + 0.5) / kPlaces), spectrum);
      for (std::size_t c = 0; c < 3; ++c)
        mean[c] += color[c] / kPlaces;
    }
    const Triple expected = ColorOfSpectrum(spectrum);
    // The observer's curve is a line over each nanometre there, and a cubic here.
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(mean[c], expected[c], 1e-4 * std::max(1.0, std::abs(expected[c]))) << c;
  }
}

// Points 1/32 apart on the circle, which t goes along there and back: two in each sixteenth.
TEST(PassWavelengthsTest, EvenAndOddPassesAreEachEvenlySpread) {
  constexpr std::size_t kBins = 16;
  std::array<double, kBins + 1> ends{};
  for (std::size_t i = 0; i <= kBins; ++i)
    ends[i] = WavelengthsAt(static_cast<double>(i) / kBins).nm[1];
  for (const std::uint64_t seed : {1ULL, 2ULL, 77ULL}) {
    for (const std::uint64_t first : {0ULL, 1ULL, 64ULL, 65ULL, 1024ULL}) {
      std::array<int, kBins> count{};
      for (std::uint64_t i = 0; i < 2 * kBins; ++i) {
        const double nm = WavelengthsOfPass(seed, first + 2 * i).nm[1];
        const auto above = std::upper_bound(ends.begin() + 1, ends.end() - 1, nm);
        ++count[static_cast<std::size_t>(above - ends.begin()) - 1];
      }
      for (const int passes : count)
        EXPECT_EQ(passes, 2) << "seed " << seed << ", passes from " << first;
    }
  }
}

// Sets of eye paths take turns: all passes of one of 64 sets must not have the same wavelengths.
TEST(PassWavelengthsTest, PassesOfOneSetOfEyePathsAreSpreadToo) {
  double lowest = kLastObservedNm;
  double highest = kFirstObservedNm;
  for (std::uint64_t turn = 0; turn < 16; ++turn) {
    const double nm = WavelengthsOfPass(1, 6 + 64 * turn).nm[1];
    lowest = std::min(lowest, nm);
    highest = std::max(highest, nm);
  }
  EXPECT_LT(lowest, kSecondPartNm + 0.25 * (kThirdPartNm - kSecondPartNm));
  EXPECT_GT(highest, kSecondPartNm + 0.75 * (kThirdPartNm - kSecondPartNm));
}

// Places on film and lens are the first dimensions of a pixel's sequence. In each eighth of them
// all eighths of t must come about equally often: were t one of these dimensions, each part of a
// pixel would see a part of the wavelengths.
TEST(PassWavelengthsTest, AllPartsOfAPixelSeeAllWavelengths) {
  constexpr std::size_t kBins = 8;
  constexpr std::uint64_t kPasses = 4096;
  std::array<double, kBins + 1> ends{};
  for (std::size_t i = 0; i <= kBins; ++i)
    ends[i] = WavelengthsAt(static_cast<double>(i) / kBins).nm[1];
  for (const std::uint64_t key : {3ULL, 4ULL}) {
    for (std::size_t dimension = 0; dimension < 4; ++dimension) {
      std::array<std::array<int, kBins>, kBins> count{};
      for (std::uint64_t i = 0; i < kPasses; ++i) {
        const double nm = WavelengthsOfPass(1, 2 * i).nm[1];
        const auto above = std::upper_bound(ends.begin() + 1, ends.end() - 1, nm);
        const float place = OwenSobol(i, key)[dimension];
        ++count[static_cast<std::size_t>(place * kBins)]
               [static_cast<std::size_t>(above - ends.begin()) - 1];
      }
      for (const auto& row : count) {
        for (const int passes : row)
          EXPECT_NEAR(passes, kPasses / (kBins * kBins), 8) << "dimension " << dimension;
      }
    }
  }
}

TEST(PassWavelengthsTest, ASeedHasItsOwn) {
  EXPECT_EQ(WavelengthsOfPass(5, 9).nm, WavelengthsOfPass(5, 9).nm);
  EXPECT_NE(WavelengthsOfPass(5, 9).nm, WavelengthsOfPass(6, 9).nm);
}

}  // namespace
}  // namespace lucerna
