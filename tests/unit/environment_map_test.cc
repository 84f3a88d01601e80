// An environment map shines as its pixels say: the square covers the sphere evenly, directions are
// drawn by the density that is told, and what photons bring is what the sampled lights bring.
#include "render/transport/environment_map.h"

#include <cmath>
#include <memory>
#include <utility>

#include "gtest/gtest.h"

#include "render/math/equal_area_square.h"
#include "render/math/rng.h"
#include "render/math/warp.h"
#include "render/transport/light.h"
#include "render/transport/working_space.h"
#include "tests/support/chi_square.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

template <typename Pixel>
InfiniteLight SkyOf(int size, Pixel&& pixel, Rgb scale = Gray(1)) {
  Picture picture;
  picture.width = picture.height = size;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const Rgb color = pixel(x, y);
      picture.linear.insert(picture.linear.end(), {color.r, color.g, color.b});
    }
  }
  InfiniteLight light;
  light.radiance = scale;
  light.kind = InfiniteLight::Kind::kEnvironment;
  light.map = std::make_shared<const Picture>(std::move(picture));
  return light;
}

// Bright and dark, with a black row and a sun.
InfiniteLight UnevenSky() {
  InfiniteLight light = SkyOf(8, [](int x, int y) {
    if (y == 2) return Gray(0);
    if (x == 5 && y == 4) return Rgb{60, 50, 30};
    return Rgb{0.2F * static_cast<float>(x), 1, 0.3F * static_cast<float>(y)};
  });
  light.axes = {Normalize({1, 1, 0}), {0, 0, 1}, Normalize({1, -1, 0})};
  return light;
}

TEST(EqualAreaSquareTest, GoesToTheSphereAndBack) {
  KeyedRng rng(1);
  for (int i = 0; i < 100000; ++i) {
    const Vec2 place = {rng.Uniform(), rng.Uniform()};
    const Vec3 direction = EqualAreaDirection(place);
    ASSERT_NEAR(Length(direction), 1, 1e-6);
    const Vec2 back = EqualAreaPlace(direction);
    ASSERT_NEAR(back.x, place.x, 2e-6) << place.x << " " << place.y;
    ASSERT_NEAR(back.y, place.y, 2e-6) << place.x << " " << place.y;
  }
}

TEST(EqualAreaSquareTest, HasItsPolesInTheMiddleAndTheCorners) {
  EXPECT_NEAR(EqualAreaDirection({0.5F, 0.5F}).z, 1, 1e-6);
  EXPECT_NEAR(EqualAreaDirection({0, 0}).z, -1, 1e-6);
  EXPECT_NEAR(EqualAreaDirection({1, 0.5F}).x, 1, 1e-6);
  EXPECT_NEAR(EqualAreaDirection({0.5F, 0}).y, -1, 1e-6);
  EXPECT_EQ(EqualAreaPlace({0, 0, 1}), (Vec2{0.5F, 0.5F}));
}

TEST(EqualAreaSquareTest, IsEven) {
  const double p_value = DirectionsPValue(
      [](float, float u1, float u2, Vec3& direction) {
        direction = EqualAreaDirection({u1, u2});
        return true;
      },
      [](Vec3) { return 1 / (4 * kPi64); }, 200000, 2);
  EXPECT_GT(p_value, 1e-3);
}

TEST(EnvironmentMapTest, DrawsByItsDensity) {
  const EnvironmentMap sky(UnevenSky());
  // The map's own patches are the cells: within one the density is even.
  constexpr int kDraws = 400000;
  constexpr int kSide = 16;  // four cells to a patch
  std::vector<double> observed(kSide * kSide);
  std::vector<double> expected(kSide * kSide);
  const auto cell = [&](Vec3 direction) {
    const Vec2 place = sky.PlaceOf(direction);
    const auto index = [](float c) {
      return std::min(static_cast<std::size_t>(c * kSide), std::size_t{kSide - 1});
    };
    return index(place.y) * kSide + index(place.x);
  };
  KeyedRng rng(3);
  for (int i = 0; i < kDraws; ++i) {
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    observed[cell(sky.Sample(u1, u2))] += 1;
  }
  // By even directions, which do not use what is tested.
  constexpr int kLattice = 480;
  for (int i = 0; i < kLattice; ++i) {
    for (int j = 0; j < kLattice; ++j) {
      const Vec3 local = EqualAreaDirection(
          {(static_cast<float>(i) + 0.5F) / kLattice, (static_cast<float>(j) + 0.5F) / kLattice});
      const ShapeAxes axes = UnevenSky().axes;
      const Vec3 d = axes.x * local.x + axes.y * local.y + axes.z * local.z;
      expected[cell(d)] +=
          kDraws * 4 * kPi64 * static_cast<double>(sky.PdfSolidAngle(d)) / (kLattice * kLattice);
    }
  }
  EXPECT_GT(ChiSquarePValue(observed, expected), 1e-3);
  double total = 0;
  for (const double count : expected)
    total += count;
  EXPECT_NEAR(total / kDraws, 1, 1e-5);
}

TEST(EnvironmentMapTest, LiesAsItsAxesSay) {
  InfiniteLight light = SkyOf(2, [](int x, int y) { return Gray(static_cast<float>(2 * y + x)); });
  // Row 0 is v = 0, which is -y; column 0 is -x.
  EXPECT_EQ(EnvironmentMap(light).Radiance(Normalize({-1, -1, 0.1F})).g, 0);
  EXPECT_NEAR(EnvironmentMap(light).Radiance(Normalize({1, -1, 0.1F})).g, 1, 1e-6);
  EXPECT_NEAR(EnvironmentMap(light).Radiance(Normalize({-1, 1, -0.1F})).g, 2, 1e-6);
  light.axes = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
  EXPECT_NEAR(EnvironmentMap(light).Radiance(Normalize({0.1F, 1, -1})).g, 1, 1e-6);
}

// A disk under a sky, and nothing else.
struct Lit {
  explicit Lit(const std::vector<InfiniteLight>& skies) {
    AddMaterial(scene, DiffuseMaterial(0));
    AddDisk(scene, {0, 0, -1}, {0, 0, 1}, 0.5F, 0);
    AddDisk(scene, {0, 3, 0}, {0, 1, 0}, 0.2F, 0);  // makes the scene larger than the disk
    scene.infinite_lights = skies;
    scene = InWorkingSpace(std::move(scene));
    intersector = Intersector::Create(scene).value();
    lights = std::make_unique<LightSet>(scene, *intersector);
  }

  Scene scene;
  std::unique_ptr<Intersector> intersector;
  std::unique_ptr<LightSet> lights;
};

struct Estimate {
  double mean = 0;
  double error = 0;  // standard
};

// Irradiance on the upper side of the first disk, by photons.
Estimate IrradianceByPhotons(const Lit& lit, std::uint64_t key) {
  constexpr int kPhotons = 1000000;
  KeyedRng rng(key);
  double sum = 0;
  double squares = 0;
  for (int i = 0; i < kPhotons; ++i) {
    const float choice = rng.Uniform();
    const float a = rng.Uniform();
    const float b = rng.Uniform();
    const float c = rng.Uniform();
    const float d = rng.Uniform();
    Emission emission;
    if (!lit.lights->SampleEmission(static_cast<double>(choice), a, b, c, d, emission)) continue;
    Hit hit;
    if (!lit.intersector->Intersect(emission.ray, hit) || hit.primitive != 0 ||
        emission.ray.direction.z > 0) {
      continue;
    }
    const double irradiance = static_cast<double>(emission.flux.g) / (kPi64 * 0.25);
    sum += irradiance;
    squares += irradiance * irradiance;
  }
  return {sum / kPhotons, std::sqrt(squares) / kPhotons};
}

// The same by sampled direct light at the middle of the disk.
Estimate IrradianceByLights(const Lit& lit, std::uint64_t key) {
  constexpr int kSamples = 1000000;
  KeyedRng rng(key);
  double sum = 0;
  double squares = 0;
  for (int i = 0; i < kSamples; ++i) {
    const float choice = rng.Uniform();
    const float a = rng.Uniform();
    const float b = rng.Uniform();
    LightSample sample;
    if (!lit.lights->SampleDirect({0, 0, -1}, static_cast<double>(choice), a, b, sample)) continue;
    if (!(sample.wi.z > 0)) continue;
    if (lit.intersector->Occluded({{0, 0, -0.9999F}, sample.wi, HUGE_VALF})) continue;
    const double irradiance = static_cast<double>(sample.radiance_over_pdf.g * sample.wi.z);
    sum += irradiance;
    squares += irradiance * irradiance;
  }
  return {sum / kSamples, std::sqrt(squares) / kSamples};
}

void ExpectEqual(const Estimate& a, double expected, double slack = 0) {
  EXPECT_NEAR(a.mean, expected, 4.5 * a.error + slack + 1e-5 * expected);
  EXPECT_LT(a.error, 0.01 * expected);
}

TEST(EnvironmentLightTest, AnEvenMapIsTheConstantLight) {
  InfiniteLight constant;
  constant.radiance = {0.75F, 1.5F, 3};
  const Lit even({SkyOf(
      5,
      [](int, int) {
        return Rgb{0.5F, 1, 2};
      },
      Gray(1.5F))});
  const Lit plain({constant});
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(even.lights->TotalPower()[c] / plain.lights->TotalPower()[c], 1, 1e-5) << c;
    EXPECT_NEAR(even.lights->InfiniteRadiance({}, {0, 0.6F, 0.8F})[c] /
                    plain.lights->InfiniteRadiance({}, {0, 0.6F, 0.8F})[c],
                1, 1e-5);
  }
  EXPECT_NEAR(even.lights->PdfDirectInfinite({}, {0, 0, 1}) /
                  plain.lights->PdfDirectInfinite({}, {0, 0, 1}),
              1, 1e-5);
  const double radiance = static_cast<double>(plain.lights->InfiniteRadiance({}, {0, 0, 1}).g);
  // The second disk hides a little.
  ExpectEqual(IrradianceByPhotons(even, 10), radiance * kPi64, 2e-3 * radiance);
  ExpectEqual(IrradianceByLights(even, 11), radiance * kPi64, 2e-3 * radiance);
}

TEST(EnvironmentLightTest, OneBrightPixelGivesItsPatchsIrradiance) {
  constexpr int kSize = 6;
  const InfiniteLight light =
      SkyOf(kSize, [](int x, int y) { return x == 2 && y == 3 ? Gray(50) : Gray(0); });
  const Lit lit({light});
  double expected = 0;
  constexpr int kLattice = 500;
  for (int i = 0; i < kLattice; ++i) {
    for (int j = 0; j < kLattice; ++j) {
      const float z = EqualAreaDirection({(2 + (static_cast<float>(i) + 0.5F) / kLattice) / kSize,
                                          (3 + (static_cast<float>(j) + 0.5F) / kLattice) / kSize})
                          .z;
      expected += 50 * static_cast<double>(std::max(z, 0.0F)) * 4 * kPi64 / (kSize * kSize) /
                  (kLattice * kLattice);
    }
  }
  ExpectEqual(IrradianceByPhotons(lit, 12), expected);
  ExpectEqual(IrradianceByLights(lit, 13), expected);
}

TEST(EnvironmentLightTest, PhotonsAndSampledLightsAgreeForSeveralSkies) {
  InfiniteLight haze;
  haze.radiance = {0.3F, 0.2F, 0.5F};
  const Lit lit(
      {UnevenSky(), haze, SkyOf(3, [](int x, int) { return Gray(static_cast<float>(x)); })});
  const Estimate photons = IrradianceByPhotons(lit, 14);
  const Estimate lights = IrradianceByLights(lit, 15);
  // The disk is not a point: what the second disk hides of the sky differs over it.
  EXPECT_NEAR(photons.mean, lights.mean,
              4.5 * std::hypot(photons.error, lights.error) + 2e-3 * lights.mean);
  EXPECT_LT(photons.error, 0.01 * photons.mean);
  // The density is of all of them: the sum over the sphere is 1.
  double total = 0;
  constexpr int kLattice = 480;
  for (int i = 0; i < kLattice; ++i) {
    for (int j = 0; j < kLattice; ++j) {
      total += static_cast<double>(lit.lights->PdfDirectInfinite(
                   {}, EqualAreaDirection({(static_cast<float>(i) + 0.5F) / kLattice,
                                           (static_cast<float>(j) + 0.5F) / kLattice}))) *
               4 * kPi64 / (kLattice * kLattice);
    }
  }
  EXPECT_NEAR(total, 1, 2e-3);
}

TEST(EnvironmentLightTest, ABlackMapIsNoLight) {
  EXPECT_TRUE(Lit({SkyOf(4, [](int, int) { return Gray(0); })}).lights->empty());
}

}  // namespace
}  // namespace lucerna
