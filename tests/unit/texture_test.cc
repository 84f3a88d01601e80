// A texture shows the colour that pbrt-v4's rules give, at every place, however far.
#include "render/scene/texture.h"

#include <cmath>
#include <memory>
#include <vector>

#include "gtest/gtest.h"

#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

using Wrap = Texture::Wrap;

// Two by two pixels, bytes: black and red above, green and white below.
std::shared_ptr<const Picture> FourPixels() {
  Picture picture;
  picture.width = picture.height = 2;
  picture.coded = {0, 0, 0, 2, 0, 0, 0, 2, 0, 2, 2, 2};
  picture.decoded[2] = 0.5F;
  return std::make_shared<const Picture>(picture);
}

Texture PictureTexture(Wrap wrap = Wrap::kRepeat) {
  Texture texture;
  texture.kind = Texture::Kind::kPicture;
  texture.wrap_u = texture.wrap_v = wrap;
  texture.picture = FourPixels();
  return texture;
}

Texture Constant(Rgb color) {
  Texture texture;
  texture.color = color;
  return texture;
}

void ExpectColor(const std::vector<Texture>& textures, Vec2 uv, Rgb expected) {
  const Rgb color =
      TextureColor(textures, static_cast<std::int32_t>(textures.size()) - 1, {uv, {}, {}});
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(color[c], expected[c], 1e-6F) << "channel " << c << " at " << uv.x << " " << uv.y;
}

TEST(TextureTest, VGoesUpwardsAndRowsDownwards) {
  const std::vector<Texture> textures = {PictureTexture()};
  ExpectColor(textures, {0.25F, 0.75F}, {0, 0, 0});
  ExpectColor(textures, {0.75F, 0.75F}, {0.5F, 0, 0});
  ExpectColor(textures, {0.25F, 0.25F}, {0, 0.5F, 0});
  ExpectColor(textures, {0.75F, 0.25F}, {0.5F, 0.5F, 0.5F});
}

TEST(TextureTest, BetweenCentresItIsBilinear) {
  const std::vector<Texture> textures = {PictureTexture()};
  ExpectColor(textures, {0.5F, 0.75F}, {0.25F, 0, 0});
  ExpectColor(textures, {0.5F, 0.5F}, {0.25F, 0.25F, 0.125F});
  ExpectColor(textures, {0.375F, 0.75F}, {0.125F, 0, 0});
}

TEST(TextureTest, EdgesRepeatClampOrAreBlack) {
  // An eighth beyond the right edge of the upper row: half a pixel less a quarter from red.
  const Vec2 beyond = {1.125F, 0.75F};
  ExpectColor({PictureTexture(Wrap::kRepeat)}, beyond, {0.125F, 0, 0});
  ExpectColor({PictureTexture(Wrap::kClamp)}, beyond, {0.5F, 0, 0});
  ExpectColor({PictureTexture(Wrap::kBlack)}, beyond, {0.125F, 0, 0});
  ExpectColor({PictureTexture(Wrap::kBlack)}, {2.5F, 0.75F}, {0, 0, 0});
  ExpectColor({PictureTexture(Wrap::kClamp)}, {7, -3}, {0.5F, 0.5F, 0.5F});
  ExpectColor({PictureTexture(Wrap::kRepeat)}, {-5.25F, 4.25F}, {0.5F, 0.5F, 0.5F});
}

TEST(TextureTest, MirroredCopiesMeetWithEqualPixels) {
  const std::vector<Texture> mirrored = {PictureTexture(Wrap::kMirror)};
  for (const Vec2 place : {Vec2{0.25F, 0.75F}, Vec2{0.7F, 0.1F}, Vec2{0.95F, 0.55F}}) {
    const Rgb color = TextureColor(mirrored, 0, {place, {}, {}});
    ExpectColor(mirrored, {2 - place.x, place.y}, color);
    ExpectColor(mirrored, {-place.x, -place.y}, color);
    ExpectColor(mirrored, {place.x + 4, 2 - place.y}, color);
  }
  // Along one axis alone: as a clamped picture beyond the edge, and as a repeated one.
  Texture mixed = PictureTexture(Wrap::kMirror);
  mixed.wrap_v = Wrap::kRepeat;
  ExpectColor({mixed}, {1.25F, 1.75F},
              TextureColor(std::vector<Texture>{PictureTexture()}, 0, {{0.75F, 0.75F}, {}, {}}));
}

TEST(TextureTest, TheNearestPixelIsNotInterpolated) {
  Picture picture;
  picture.width = 2;
  picture.height = 1;
  picture.linear = {1, 0, 0, 0, 1, 0};
  Texture texture;
  texture.kind = Texture::Kind::kPicture;
  texture.is_nearest = true;
  texture.picture = std::make_shared<const Picture>(picture);
  const auto at = [&](float u) {
    return TextureColor(std::vector<Texture>{texture}, 0, {{u, 0.4F}, {}, {}});
  };
  EXPECT_EQ(at(0.01F), (Rgb{1, 0, 0}));
  EXPECT_EQ(at(0.49F), (Rgb{1, 0, 0}));
  EXPECT_EQ(at(0.51F), (Rgb{0, 1, 0}));
  EXPECT_EQ(at(1.25F), (Rgb{1, 0, 0}));
  texture.wrap_u = Texture::Wrap::kMirror;
  EXPECT_EQ(at(1.25F), (Rgb{0, 1, 0}));
  texture.wrap_u = Texture::Wrap::kClamp;
  EXPECT_EQ(at(-3), (Rgb{1, 0, 0}));
  texture.wrap_u = Texture::Wrap::kBlack;
  EXPECT_EQ(at(-0.1F), Rgb());
}

TEST(TextureTest, ColoursOfVerticesMultiply) {
  Texture constant;
  constant.color = {0.5F, 0.5F, 1};
  Texture colors;
  colors.kind = Texture::Kind::kVertexColor;
  colors.parts[0] = 0;
  const std::vector<Texture> textures = {constant, colors};
  EXPECT_EQ(TextureColor(textures, 1, {{}, {}, {}, {1, 0.5F, 0.25F}}), (Rgb{0.5F, 0.25F, 0.25F}));
  EXPECT_EQ(TextureColor(textures, 1, {}), constant.color);
}

TEST(TextureTest, MappingScaleAndInversionAreApplied) {
  Texture texture = PictureTexture();
  texture.mapping = ByUv(2, 4, 0.5F, 0.25F);
  ExpectColor({texture}, {0.125F, 0}, {0.5F, 0.5F, 0.5F});  // at (0.75, 0.25)
  texture.scale = 1.5F;
  ExpectColor({texture}, {0.125F, 0}, {0.75F, 0.75F, 0.75F});
  texture.tint = {1, 0.5F, 0};
  ExpectColor({texture}, {0.125F, 0}, {0.75F, 0.375F, 0});
  texture.tint = {1, 1, 1};
  texture.is_inverted = true;
  ExpectColor({texture}, {0.125F, 0}, {0.25F, 0.25F, 0.25F});
  texture.is_inverted = false;
  texture.scale = 3;
  ExpectColor({texture}, {0.125F, 0}, {1, 1, 1});
}

TEST(TextureTest, ScaledAndCheckeredTexturesAreMadeOfOthers) {
  Texture half;
  half.kind = Texture::Kind::kScaled;
  half.scale = 0.5F;
  half.parts[0] = 0;
  Texture checkers;
  checkers.kind = Texture::Kind::kCheckerboard;
  checkers.parts = {1, 0, -1, -1};
  checkers.mapping.scale_u = 2;
  const std::vector<Texture> textures = {Constant({0.8F, 0.4F, 0.2F}), half, checkers};
  const Rgb whole = {0.8F, 0.4F, 0.2F};
  ExpectColor(textures, {0.25F, 0.5F}, whole * 0.5F);
  ExpectColor(textures, {0.75F, 0.5F}, whole);
  ExpectColor(textures, {0.75F, 1.5F}, whole * 0.5F);
  ExpectColor(textures, {-0.25F, 0.5F}, whole);
  ExpectColor(textures, {-0.25F, -0.5F}, whole * 0.5F);
}

TEST(TextureTest, FarPlacesAndHugeScalesStayColours) {
  Texture checkers;
  checkers.kind = Texture::Kind::kCheckerboard;
  checkers.parts = {0, 0, -1, -1};
  Texture huge;
  huge.kind = Texture::Kind::kScaled;
  huge.scale = 3e38F;
  for (const Wrap wrap : {Wrap::kRepeat, Wrap::kClamp, Wrap::kBlack, Wrap::kMirror}) {
    Texture picture = PictureTexture(wrap);
    picture.mapping = ByUv(3e38F, -3e38F, 3e38F, -3e38F);
    std::vector<Texture> textures = {picture, checkers, huge, huge};
    textures[2].parts[0] = 1;
    textures[3].parts[0] = 2;
    for (const float place : {0.0F, 1.0F, -1.0F, 1e30F, -3e38F, 5e8F}) {
      for (std::int32_t number = 0; number < 4; ++number) {
        const Rgb color = TextureColor(textures, number, {{place, -place}, {}, {}});
        for (int c = 0; c < 3; ++c)
          EXPECT_TRUE(color[c] >= 0 && color[c] <= 1) << place << " " << number << " " << color[c];
      }
    }
  }
}

}  // namespace
}  // namespace lucerna
