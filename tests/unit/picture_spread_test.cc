// A surface that shows a picture sends its light from where the picture is bright, and exactly as
// much as the picture says.
#include "render/transport/picture_spread.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/color_space.h"
#include "render/math/rng.h"
#include "render/math/warp.h"

namespace lucerna {
namespace {

// Grey, rows from the top.
AreaLight LightOf(int width, const std::vector<float>& values, float scale = 1) {
  Picture picture;
  picture.width = width;
  picture.height = static_cast<int>(values.size()) / width;
  picture.channels = 1;
  picture.linear = values;
  AreaLight light;
  light.radiance = Gray(scale);
  light.largest_pixel = picture.Largest();
  light.picture = std::make_shared<const Picture>(std::move(picture));
  return light;
}

std::vector<float> Drawn(int count, KeyedRng& rng) {
  std::vector<float> values;
  for (int i = 0; i < count; ++i) {
    const float u = rng.Uniform();
    values.push_back(u < 0.3F ? 0 : u * u * u * 10);
  }
  return values;
}

float Looked(const AreaLight& light, Vec2 uv) {
  return light.radiance.g * light.PixelAt(uv).g;
}

Vec2 UvIn(const std::array<Vec2, 3>& uvs, Vec2 u) {
  float b1 = 0;
  float b2 = 0;
  SquareToTriangle(u.x, u.y, b1, b2);
  const float b0 = 1 - b1 - b2;
  return {uvs[0].x * b0 + uvs[1].x * b1 + uvs[2].x * b2,
          uvs[0].y * b0 + uvs[1].y * b1 + uvs[2].y * b2};
}

TEST(PictureSpreadTest, OfAWholeRectangleHasTheMeanOfThePixels) {
  KeyedRng rng(1);
  for (const auto& [width, height] : {std::pair{1, 1}, {2, 1}, {7, 5}, {64, 48}}) {
    const std::vector<float> values = Drawn(width * height, rng);
    const AreaLight light = LightOf(width, values, 2);
    double sum = 0;
    for (const float value : values)
      sum += 2 * static_cast<double>(value) / (width * height);
    for (const int cells : {1, 64}) {
      const auto lower = PictureSpread::OfTriangle(light, {Vec2{0, 0}, {1, 0}, {1, 1}}, cells);
      const auto upper = PictureSpread::OfTriangle(light, {Vec2{0, 0}, {1, 1}, {0, 1}}, cells);
      EXPECT_NEAR(static_cast<double>(lower.mean().g + upper.mean().g) / 2, sum, 1e-6 * (1 + sum));
    }
  }
}

// A picture of a black and a white pixel rises from 0 at u = 1/4 to 1 at u = 3/4. Over the triangle
// of u + v <= 1 that is the integral of min(max(2u - 1/2, 0), 1) · 2(1 - u): 13/48.
TEST(PictureSpreadTest, OfARampIsItsIntegral) {
  const AreaLight light = LightOf(2, {0, 1});
  for (const int cells : {1, 4, 64}) {
    const auto spread = PictureSpread::OfTriangle(light, {Vec2{0, 0}, {1, 0}, {0, 1}}, cells);
    EXPECT_NEAR(spread.mean().g, 13.0F / 48, 1e-6F) << cells;
  }
  // Beyond its edges a picture goes on as it ends there, however far.
  EXPECT_EQ(PictureSpread::OfTriangle(light, {Vec2{5, 0}, {1e6F, 0}, {7, 1e6F}}, 64).mean().g, 1);
  EXPECT_EQ(PictureSpread::OfTriangle(light, {Vec2{-5, 0}, {-1e6F, 0}, {-7, 3}}, 64).mean().g, 0);
}

// However far off texture coordinates are, and however often a picture is repeated between them.
TEST(PictureSpreadTest, FarPlacesAndManyCopiesAreLookedUpInstead) {
  AreaLight light = LightOf(2, {1, 3});
  for (const Texture::Wrap wrap : {Texture::Wrap::kRepeat, Texture::Wrap::kMirror}) {
    light.wrap_u = light.wrap_v = wrap;
    for (const float far : {1e9F, 1e6F, 3e38F}) {
      const auto spread = PictureSpread::OfTriangle(light, {Vec2{-far, 0}, {far, 0}, {0, far}}, 16);
      EXPECT_GE(spread.mean().g, 1);
      EXPECT_LE(spread.mean().g, 3);
    }
  }
  light.wrap_u = light.wrap_v = Texture::Wrap::kBlack;
  EXPECT_EQ(PictureSpread::OfTriangle(light, {Vec2{1e9F, 0}, {2e9F, 0}, {1e9F, 1e9F}}, 16).mean().g,
            0);
}

TEST(PictureSpreadTest, AgreesWithLookingUp) {
  KeyedRng rng(2);
  for (int trial = 0; trial < 30; ++trial) {
    const int width = 1 + static_cast<int>(rng.Uniform() * 12);
    const int height = 1 + static_cast<int>(rng.Uniform() * 12);
    AreaLight light = LightOf(width, Drawn(width * height, rng));
    std::array<Vec2, 3> uvs;
    for (Vec2& uv : uvs)
      uv = {2 * rng.Uniform() - 0.5F, 2 * rng.Uniform() - 0.5F};
    // Copies beyond the edges, turned and moved.
    using enum Texture::Wrap;
    constexpr std::array kWraps = {kClamp, kClamp, kRepeat, kMirror, kBlack};
    light.wrap_u = kWraps[static_cast<std::size_t>(trial) % kWraps.size()];
    light.wrap_v = kWraps[static_cast<std::size_t>(trial / 2) % kWraps.size()];
    if (trial % 4 == 3) {
      light.mapping.kind = TextureMapping::Kind::kUvAffine;
      light.mapping.axis_u = {0.8F, 1.1F, 0};
      light.mapping.axis_v = {-0.7F, 0.9F, 0};
      light.mapping.delta_u = 0.3F;
    }
    // A third of them is a line of the picture, or a point.
    if (trial % 3 == 0) uvs[2] = uvs[trial % 2 == 0 ? 1 : 0];
    const auto spread = PictureSpread::OfTriangle(light, uvs, 16);
    // By midpoints: the picture bends at lines, so the error falls with the square of their number.
    constexpr int kLattice = 600;
    double sum = 0;
    for (int y = 0; y < kLattice; ++y) {
      for (int x = 0; x < kLattice; ++x) {
        sum += static_cast<double>(
            Looked(light, UvIn(uvs, {(static_cast<float>(x) + 0.5F) / kLattice,
                                     (static_cast<float>(y) + 0.5F) / kLattice})));
      }
    }
    const double mean = sum / (kLattice * kLattice);
    EXPECT_NEAR(static_cast<double>(spread.mean().g), mean, 2e-4 * (mean + 1)) << trial;
  }
}

// Light over density, drawn by the density, has the light's mean; and no place has more of it than
// the spread says.
TEST(PictureSpreadTest, DrawsByItsDensity) {
  KeyedRng rng(3);
  for (int trial = 0; trial < 6; ++trial) {
    const AreaLight light = LightOf(9, Drawn(9 * 7, rng), 3);
    const std::array<Vec2, 3> uvs = {Vec2{0.1F, 0}, {1, 0.2F}, {0.3F, 1.1F}};
    const auto spread =
        trial < 3 ? PictureSpread::OfTriangle(light, uvs, 1 << (2 * trial))
                  : PictureSpread::OfSurface(
                        light, [&](Vec2 u) { return UvIn(uvs, u); }, 1 << (2 * (trial - 3)));
    constexpr int kDraws = 200'000;
    double sum = 0;
    double squares = 0;
    double inverse = 0;
    double inverse_squares = 0;
    for (int i = 0; i < kDraws; ++i) {
      float density = 0;
      const float u1 = rng.Uniform();
      const Vec2 place = spread.Sample(u1, rng.Uniform(), density);
      ASSERT_GT(density, 0);
      EXPECT_FLOAT_EQ(spread.Density(place), density);
      const auto value = static_cast<double>(Looked(light, UvIn(uvs, place)) / density);
      sum += value / kDraws;
      squares += value * value / kDraws;
      inverse += 1 / static_cast<double>(density) / kDraws;
      inverse_squares += 1 / static_cast<double>(density * density) / kDraws;
      EXPECT_LE(value, 1.0001 * static_cast<double>(spread.largest_share() * spread.mean().g));
    }
    const double error = std::sqrt(std::max(0.0, squares - sum * sum) / kDraws);
    EXPECT_NEAR(sum, static_cast<double>(spread.mean().g), 4.5 * error + 1e-4 * sum) << trial;
    // The share of the surface that is ever drawn.
    EXPECT_LE(inverse, 1 + 4.5 * std::sqrt(inverse_squares / kDraws));
    // Drawn where it is bright: what even draws would give varies more.
    if (trial % 3 == 2) {
      double even_squares = 0;
      for (int i = 0; i < kDraws; ++i) {
        const float u1 = rng.Uniform();
        const auto value = static_cast<double>(Looked(light, UvIn(uvs, {u1, rng.Uniform()})));
        even_squares += value * value / kDraws;
      }
      EXPECT_LT(squares - sum * sum, 0.2 * (even_squares - sum * sum)) << trial;
    }
  }
}

TEST(PictureSpreadTest, FindsItsNumbers) {
  KeyedRng rng(4);
  const AreaLight light = LightOf(5, Drawn(20, rng));
  const auto spread = PictureSpread::OfTriangle(light, {Vec2{0, 0}, {1, 0}, {1, 1}}, 64);
  for (int i = 0; i < 1000; ++i) {
    float density = 0;
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    const Vec2 numbers = spread.NumbersAt(spread.Sample(u1, u2, density));
    EXPECT_NEAR(numbers.x, u1, 1e-3F);
    EXPECT_NEAR(numbers.y, u2, 1e-3F);
  }
}

// Nothing is drawn from a black picture, and nothing breaks.
TEST(PictureSpreadTest, OfABlackPictureIsNothing) {
  const auto spread =
      PictureSpread::OfTriangle(LightOf(2, {0, 0}), {Vec2{0, 0}, {1, 0}, {1, 1}}, 8);
  EXPECT_EQ(spread.mean(), Rgb{});
  EXPECT_EQ(spread.largest_share(), 1);
}

}  // namespace
}  // namespace lucerna
