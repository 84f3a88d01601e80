// The detail of textures and skies is that of patterns whose derivatives are known.
#include "worker/texture_detail.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "render/analysis/needs.h"
#include "render/math/equal_area_square.h"
#include "render/math/warp.h"
#include "render/transport/light.h"
#include "render/transport/sky_detail.h"
#include "tests/support/test_scenes.h"
#include "worker/photon_spectrum.h"

namespace lucerna {
namespace {

template <typename Value>
std::shared_ptr<const Picture> GreyPicture(int width, int height, Value&& value) {
  Picture picture;
  picture.width = width;
  picture.height = height;
  picture.channels = 1;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      picture.linear.push_back(static_cast<float>(value(x, y)));
  }
  return std::make_shared<const Picture>(std::move(picture));
}

Texture OfPicture(std::shared_ptr<const Picture> picture) {
  Texture texture;
  texture.kind = Texture::Kind::kPicture;
  texture.picture = std::move(picture);
  return texture;
}

// The mean of |A''| / (2 A) over a period of A = 1 + m cos kx.
double WaveDetail(double m, double k) {
  constexpr int kSteps = 100000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double wave = std::cos(2 * kPi64 * (i + 0.5) / kSteps);
    sum += m * std::abs(wave) / (1 + m * wave);
  }
  return k * k * sum / kSteps / 2;
}

TEST(TextureDetailTest, OfAWaveIsItsSecondDerivative) {
  constexpr int kWidth = 512;
  constexpr double kWaves = 8;
  const double k = 2 * kPi64 * kWaves;
  for (const double m : {0.1, 0.5, 0.8}) {
    Texture texture = OfPicture(GreyPicture(
        kWidth, 3, [&](int x, int) { return 0.5 * (1 + m * std::cos(k * (x + 0.5) / kWidth)); }));
    const TextureDetail plain = TextureDetails({texture})[0];
    EXPECT_NEAR(plain.u / WaveDetail(m, k), 1, 2e-3) << m;
    EXPECT_NEAR(plain.v, 0, 1e-6 * plain.u);
    // Relative to the albedo: brightness does not matter, size does.
    texture.scale = 0.5F;
    texture.mapping.scale_u = 3;
    EXPECT_NEAR(TextureDetails({texture})[0].u / (9 * plain.u), 1, 1e-4);
  }
}

TEST(TextureDetailTest, OfFlatTexturesIsNone) {
  const Texture constant;
  const std::vector<TextureDetail> details =
      TextureDetails({constant, OfPicture(GreyPicture(4, 4, [](int, int) { return 0.25; }))});
  for (const TextureDetail& detail : details) {
    EXPECT_EQ(detail.u, 0);
    EXPECT_EQ(detail.v, 0);
  }
}

TEST(TextureDetailTest, TurnsWithItsTexture) {
  Texture texture = OfPicture(GreyPicture(
      64, 32, [](int x, int y) { return 0.5 + 0.3 * std::cos(0.1 * x * x) * std::sin(0.3 * y); }));
  texture.mapping.scale_u = 2;
  const TextureDetail plain = TextureDetails({texture})[0];
  // The same by its matrix, and a quarter turn.
  texture.mapping.kind = TextureMapping::Kind::kUvAffine;
  texture.mapping.axis_u = {2, 0, 0};
  texture.mapping.axis_v = {0, 1, 0};
  EXPECT_EQ(TextureDetails({texture})[0].u, plain.u);
  EXPECT_EQ(TextureDetails({texture})[0].v, plain.v);
  texture.mapping.axis_u = {0, 2, 0};
  texture.mapping.axis_v = {-1, 0, 0};
  EXPECT_EQ(TextureDetails({texture})[0].u, plain.v);
  EXPECT_EQ(TextureDetails({texture})[0].v, plain.u);
}

TEST(TextureDetailTest, OfACheckerboardIsThatOfItsPicture) {
  // Eight pixels a square, two squares: the board as a picture.
  const auto picture =
      GreyPicture(16, 16, [](int x, int y) { return (x / 8 + y / 8) % 2 == 0 ? 0.6 : 0.2; });
  Texture even;
  even.color = Gray(0.6F);
  Texture odd;
  odd.color = Gray(0.2F);
  Texture board;
  board.kind = Texture::Kind::kCheckerboard;
  board.parts = {0, 1};
  board.mapping.scale_u = 2;
  board.mapping.scale_v = 2;
  const std::vector<TextureDetail> details = TextureDetails({even, odd, board, OfPicture(picture)});
  EXPECT_GT(details[2].u, 0);
  EXPECT_NEAR(details[2].u / details[3].u, 1, 1e-5);
  EXPECT_NEAR(details[2].v / details[3].v, 1, 1e-5);
}

// Light that leaves a picture has its detail beside that of the light's outline: waves over the
// two metres of a square light, and as strong for one that is brighter.
TEST(TextureDetailTest, OfAPictureOnALightIsThatOfItsLight) {
  constexpr int kWidth = 512;
  constexpr double kDepth = 0.5;
  const double k = 2 * kPi64 * 16;
  const auto curvature_of = [&](float scale, bool has_picture) {
    Scene scene;
    AddMaterial(scene, DiffuseMaterial(0.5F));
    AddQuad(scene, {-1, -1, -3}, {2, 0, 0}, {0, 2, 0}, 0);
    AreaLight light;
    light.radiance = Gray(1);
    if (has_picture) {
      light.picture = GreyPicture(kWidth, 3, [&](int x, int) {
        return static_cast<double>(scale) * (1 + kDepth * std::cos(k * (x + 0.5) / kWidth));
      });
      light.largest_pixel = light.picture->Largest();
    }
    scene.area_lights.push_back(light);
    AddQuad(scene, {-1, -1, 0}, {0, 2, 0}, {2, 0, 0}, 0, 0);
    scene.meshes.back().uvs = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
    const auto intersector = Intersector::Create(scene).value();
    const LightSet lights(scene, *intersector);
    RenderSettings settings;
    settings.width = settings.height = 64;
    settings.initial_radius = 0.01;
    settings.radius_controller = RadiusControllerKind::kFrequency;
    const auto tracer =
        SpectrumTracer::Create(scene, settings, NeedsOf(scene, settings), *intersector, lights)
            .value();
    Emission emission;
    EXPECT_TRUE(lights.SampleEmission(0.5, 0.3F, 0.4F, 0.1F, 0.2F, emission));
    return tracer->Leave(emission).spectrum.s;
  };
  const double plain = curvature_of(1, false);
  for (const float scale : {1.0F, 40.0F}) {
    EXPECT_NEAR((curvature_of(scale, true) - plain) / (WaveDetail(kDepth, k) / 4), 1, 1e-2)
        << scale;
  }
}

// A sky of luminance 1 + a z: the Laplacian over the sphere is -2 a z.
TEST(SkyDetailTest, OfASlopeIsItsLaplacian) {
  constexpr int kSize = 64;
  constexpr double kSlope = 0.6;
  InfiniteLight light;
  light.radiance = Gray(1);
  light.kind = InfiniteLight::Kind::kEnvironment;
  light.map = GreyPicture(kSize, kSize, [](int x, int y) {
    return 1 +
           kSlope * static_cast<double>(EqualAreaDirection({(static_cast<float>(x) + 0.5F) / kSize,
                                                            (static_cast<float>(y) + 0.5F) / kSize})
                                            .z);
  });
  const EnvironmentMap sky(light);
  const SkyDetail detail(sky);
  const SpectrumLimits limits = SpectrumLimits::ForDiagonal(1);
  // In the middle of those around a parallel: at the square's creases the map bends more.
  for (const double z : {0.8, 0.6, -0.7}) {
    std::vector<double> around;
    constexpr int kAround = 400;
    for (int i = 0; i < kAround; ++i) {
      const double angle = 2 * kPi64 * i / kAround;
      const double r = std::sqrt(1 - z * z);
      const Vec3 d = {static_cast<float>(r * std::cos(angle)),
                      static_cast<float>(r * std::sin(angle)), static_cast<float>(z)};
      around.push_back(1 / detail.Source(d, limits).p);
    }
    std::sort(around.begin(), around.end());
    EXPECT_NEAR(around[kAround / 2] / (2 * kSlope * std::abs(z) / (1 + kSlope * z)), 1, 0.15) << z;
  }
}

TEST(SkyDetailTest, OfAnEvenSkyIsNoneAndOfASunItsSize) {
  InfiniteLight even;
  even.radiance = Gray(2);
  even.kind = InfiniteLight::Kind::kEnvironment;
  even.map = GreyPicture(7, 7, [](int, int) { return 1.0; });
  const SpectrumLimits limits = SpectrumLimits::ForDiagonal(1);
  {
    const EnvironmentMap sky(even);
    EXPECT_EQ(SkyDetail(sky).Source(Normalize({1, 2, 3}), limits).p, kLargestAngularVariance);
  }
  constexpr int kSize = 64;
  InfiniteLight sun = even;
  sun.map =
      GreyPicture(kSize, kSize, [](int x, int y) { return x == 20 && y == 30 ? 1000.0 : 0.1; });
  const EnvironmentMap sky(sun);
  const Vec3 towards = EqualAreaDirection({20.5F / kSize, 30.5F / kSize});
  const double texel = std::sqrt(4 * kPi64) / kSize;
  const double p = SkyDetail(sky).Source(towards, limits).p;
  EXPECT_GE(p, texel * texel / 12);
  EXPECT_LE(p, texel * texel);
}

}  // namespace
}  // namespace lucerna
