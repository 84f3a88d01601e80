// Textures that are made of others, placed in space, or noise: closed forms and known statistics.
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "render/scene/noise.h"
#include "render/scene/texture.h"

namespace lucerna {
namespace {

using Kind = Texture::Kind;

Texture Constant(float value) {
  Texture texture;
  texture.color = Gray(value);
  return texture;
}

Texture Made(Kind kind, std::array<std::int32_t, 4> parts = {-1, -1, -1, -1}) {
  Texture texture;
  texture.kind = kind;
  texture.parts = parts;
  return texture;
}

TexturePlace At(Vec3 position) {
  return {{0, 0}, position, {0, 0, 1}};
}

TEST(TextureKindsTest, MixesByANumber) {
  const std::vector<Texture> textures = {Constant(0.2F), Constant(1.5F), Constant(0.25F),
                                         Made(Kind::kMixed, {0, 1, 2, -1})};
  EXPECT_FLOAT_EQ(TextureNumber(textures, 3, {}), 0.75F * 0.2F + 0.25F * 1.5F);
}

TEST(TextureKindsTest, MixesByHowFarASurfaceFacesADirection) {
  std::vector<Texture> textures = {Constant(1), Constant(3),
                                   Made(Kind::kDirectionMixed, {0, 1, -1, -1})};
  textures[2].direction = {0, 0, 1};
  const auto at = [&](Vec3 normal) { return TextureNumber(textures, 2, {{0, 0}, {}, normal}); };
  EXPECT_FLOAT_EQ(at({0, 0, -1}), 1);
  EXPECT_FLOAT_EQ(at({0, 1, 0}), 3);
  EXPECT_FLOAT_EQ(at({0, 0.8F, -0.6F}), 0.6F * 1 + 0.4F * 3);
}

TEST(TextureKindsTest, ScalesByATexture) {
  std::vector<Texture> textures = {Constant(0.5F), Constant(-4),
                                   Made(Kind::kScaled, {0, 1, -1, -1})};
  textures[2].scale = 3;
  EXPECT_FLOAT_EQ(TextureNumber(textures, 2, {}), -6);
  EXPECT_EQ(TextureColor(textures, 2, {}), Rgb{});
}

TEST(TextureKindsTest, InterpolatesFourCornersAndBeyond) {
  const std::vector<Texture> textures = {Constant(1), Constant(2), Constant(3), Constant(7),
                                         Made(Kind::kBilinear, {0, 1, 2, 3})};
  const auto at = [&](float u, float v) { return TextureNumber(textures, 4, {{u, v}, {}, {}}); };
  EXPECT_FLOAT_EQ(at(0, 0), 1);
  EXPECT_FLOAT_EQ(at(0, 1), 2);
  EXPECT_FLOAT_EQ(at(1, 0), 3);
  EXPECT_FLOAT_EQ(at(1, 1), 7);
  // 1 + 2u + v + 3uv.
  EXPECT_FLOAT_EQ(at(0.5F, 0.25F), 1 + 1 + 0.25F + 3 * 0.125F);
  EXPECT_FLOAT_EQ(at(2, -1), 1 + 4 - 1 - 6);
}

// Its own space is half as large as the world and begins at x = 1.
Transform HalfFromOne() {
  return Transform::Scale(0.5, 0.5, 0.5) * Transform::Translate(-1, 0, 0);
}

TEST(TextureKindsTest, IsPlacedByPlanesSpheresAndCylinders) {
  TextureMapping mapping;
  mapping.from_world = HalfFromOne();
  mapping.kind = TextureMapping::Kind::kPlanar;
  mapping.axis_u = {2, 0, 0};
  mapping.axis_v = {0, 0, -1};
  mapping.delta_u = 0.25F;
  mapping.delta_v = 0.5F;
  const auto expect = [&](Vec3 position, float u, float v) {
    const Vec2 mapped = mapping.Map(At(position));
    EXPECT_NEAR(mapped.x, u, 1e-6F);
    EXPECT_NEAR(mapped.y, v, 1e-6F);
  };
  expect({4, 9, 5}, 0.25F + 2 * 1.5F, 0.5F - 2.5F);
  mapping.kind = TextureMapping::Kind::kSpherical;
  expect({1, 0, 3}, 0, 0);
  expect({3, 0, 0}, 0.5F, 0);
  expect({1, -3, 0}, 0.5F, 0.75F);
  expect({0, 0, -1}, 0.75F, 0.5F);
  mapping.kind = TextureMapping::Kind::kCylindrical;
  expect({3, 0, 4}, 0.5F, 2);
  expect({1, -7, -1}, 0.25F, -0.5F);
}

TEST(TextureKindsTest, CubesFillSpace) {
  std::vector<Texture> textures = {Constant(0), Constant(1),
                                   Made(Kind::kCheckerboard, {0, 1, -1, -1})};
  textures[2].is_in_space = true;
  textures[2].mapping.from_world = HalfFromOne();
  const auto at = [&](Vec3 position) { return TextureNumber(textures, 2, At(position)); };
  EXPECT_EQ(at({2, 1, 1}), 0);
  EXPECT_EQ(at({4, 1, 1}), 1);
  EXPECT_EQ(at({4, 1, 3}), 0);
  EXPECT_EQ(at({0, 1, 1}), 1);
  EXPECT_EQ(at({0, -1, -1}), 1);
}

TEST(TextureKindsTest, NumbersOfPicturesAreNotHeldInTheUnit) {
  Picture picture;
  picture.width = picture.height = 1;
  picture.channels = 1;
  picture.linear = {-0.5F};
  Texture numbers;
  numbers.kind = Kind::kPicture;
  numbers.is_number = true;
  numbers.scale = 6;
  numbers.picture = std::make_shared<const Picture>(picture);
  EXPECT_FLOAT_EQ(TextureNumber(std::vector{numbers}, 0, {}), -3);
  numbers.is_inverted = true;
  EXPECT_FLOAT_EQ(TextureNumber(std::vector{numbers}, 0, {}), 4);
  numbers.scale = -6;
  EXPECT_FLOAT_EQ(TextureNumber(std::vector{numbers}, 0, {}), 0);
}

TEST(TextureKindsTest, SlopesAreMeasuredOverAQuarterOfAPixel) {
  auto picture = std::make_shared<Picture>();
  picture->width = 1000;
  picture->height = 4;
  picture->channels = 1;
  picture->linear.resize(4000);
  Texture texture;
  texture.kind = Kind::kPicture;
  texture.picture = picture;
  texture.mapping.scale_u = 5;
  const std::vector<Texture> textures = {texture, Made(Kind::kScaled, {0, -1, -1, -1}),
                                         Constant(1)};
  EXPECT_FLOAT_EQ(SlopeStep(textures, 1).x, 0.25F / 5000);
  EXPECT_FLOAT_EQ(SlopeStep(textures, 1).y, 0.0005F);
  EXPECT_FLOAT_EQ(SlopeStep(textures, 2).x, 0.0005F);
}

TEST(NoiseTest, IsZeroAtWholeNumbersAndSmoothBetween) {
  KeyedRng rng(1);
  double sum = 0;
  double squares = 0;
  constexpr int kPlaces = 20000;
  for (int i = 0; i < kPlaces; ++i) {
    const auto draw = [&] { return (rng.Uniform() - 0.5F) * 200; };
    const Vec3 p = {draw(), draw(), draw()};
    EXPECT_EQ(NoiseAt({std::floor(p.x), std::floor(p.y), std::floor(p.z)}), 0);
    const float noise = NoiseAt(p);
    ASSERT_LE(std::abs(noise), 1.1F);
    // No slope of a corner is steeper than the square root of two, and smoothing adds less than
    // the steepest slope of the weight, 15/8, times the largest difference of two corners.
    ASSERT_NEAR(NoiseAt(p + Vec3{1e-3F, 0, 0}), noise, 6e-3F);
    sum += static_cast<double>(noise);
    squares += static_cast<double>(noise) * static_cast<double>(noise);
  }
  // Independent cells: the mean of as many is within five standard errors of 0.
  const double deviation = std::sqrt(squares / kPlaces);
  EXPECT_NEAR(sum / kPlaces, 0, 5 * deviation / std::sqrt(kPlaces));
  EXPECT_GT(deviation, 0.2);
}

// A corner of the lattice slopes towards one of the edges of a cube: by 1 or -1 along two axes.
TEST(NoiseTest, SlopesTowardsEdgesOfACube) {
  for (int cell = 0; cell < 20; ++cell) {
    const auto c = static_cast<float>(cell);
    constexpr float kStep = 1e-3F;
    int slopes = 0;
    for (const Vec3 along : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
      const float slope = NoiseAt(Vec3{c, 2 * c, 3 * c} + along * kStep) / kStep;
      EXPECT_NEAR(slope, std::round(slope), 0.02F);
      slopes += static_cast<int>(std::abs(std::round(slope)));
    }
    EXPECT_EQ(slopes, 2);
  }
}

TEST(NoiseTest, OctavesAddUp) {
  const Vec3 p = {0.3F, 1.7F, -2.2F};
  EXPECT_FLOAT_EQ(FbmAt(p, 0.5F, 1), NoiseAt(p));
  EXPECT_FLOAT_EQ(FbmAt(p, 0.25F, 2), NoiseAt(p) + 0.25F * NoiseAt(p * 1.99F));
  EXPECT_FLOAT_EQ(TurbulenceAt(p, 0.25F, 1), std::abs(NoiseAt(p)) + 0.25F * 0.2F);
}

// Squares in whose middle noise is above 0 have a dot of radius 0.35 that does not leave them.
TEST(TextureKindsTest, DotsCoverWhatTheyShould) {
  const std::vector<Texture> textures = {Constant(1), Constant(0),
                                         Made(Kind::kDots, {0, 1, -1, -1})};
  constexpr int kSide = 100;
  double squares = 0;
  for (int row = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column) {
      const Vec3 middle = {static_cast<float>(column) + 0.5F, static_cast<float>(row) + 0.5F, 0.5F};
      squares += NoiseAt(middle) > 0 ? 1 : 0;
    }
  }
  const double share = squares / (kSide * kSide);
  EXPECT_GT(share, 0.3);
  EXPECT_LT(share, 0.7);
  KeyedRng rng(5);
  double covered = 0;
  constexpr int kPlaces = 40000;
  for (int i = 0; i < kPlaces; ++i) {
    // Squares lie around whole numbers.
    const float u = rng.Uniform() * kSide - 0.5F;
    const float v = rng.Uniform() * kSide - 0.5F;
    covered += static_cast<double>(TextureNumber(textures, 2, {{u, v}, {}, {}}));
  }
  // Five standard errors of so many places.
  const double expected = share * std::numbers::pi * 0.35 * 0.35;
  EXPECT_NEAR(covered / kPlaces, expected, 5 * std::sqrt(expected / kPlaces));
}

TEST(TextureKindsTest, MarbleShowsItsColors) {
  std::vector<Texture> textures = {Made(Kind::kMarble)};
  textures[0].variation = 0;
  // sin = 1 at the last control point, sin = -1 at the first: 1.5 times the colours there.
  const Rgb last = TextureColor(textures, 0, At({0, std::numbers::pi_v<float> / 2, 0}));
  EXPECT_NEAR(last.r, 1.5F * 0.58F, 2e-3F);
  EXPECT_NEAR(last.b, 1.5F * 0.6F, 2e-3F);
  float darkest = 1;
  for (int i = 0; i < 100; ++i)
    darkest = std::min(
        darkest, TextureColor(textures, 0, At({0, 0.0314F * static_cast<float>(i) - 1.57F, 0})).r);
  EXPECT_LT(darkest, 0.65F);
}

}  // namespace
}  // namespace lucerna
