// Light of a sky through a rectangle: as pbrt-v4's texts give it, as much as geometry says, and the
// same by photons as by direct light.
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/formats/read_scene.h"
#include "render/geometry/intersector.h"
#include "render/math/rng.h"
#include "render/math/warp.h"
#include "render/math/windowed_constant.h"
#include "render/transport/light.h"
#include "render/transport/working_space.h"
#include "tests/support/memory_files.h"

namespace lucerna {
namespace {

using ::testing::HasSubstr;

// Grey, rows from the top.
std::string PortalPfm(int width, const std::vector<float>& values) {
  const int height = static_cast<int>(values.size()) / width;
  std::string bytes = "Pf\n" + std::to_string(width) + " " + std::to_string(height) + "\n-1\n";
  for (int y = height - 1; y >= 0; --y) {
    for (int x = 0; x < width; ++x) {
      char raw[4];
      std::memcpy(raw, &values[static_cast<std::size_t>(y * width + x)], 4);
      bytes.append(raw, 4);
    }
  }
  return bytes;
}

ParsedScene Parse(const std::string& world) {
  std::vector<float> pixels;
  for (int i = 0; i < 64; ++i)
    pixels.push_back(i == 27 ? 30.0F : 0.2F * static_cast<float>(i * 7 % 5));
  MemoryFiles files(
      {{"s.pbrt", "Camera \"perspective\" WorldBegin\n" + world +
                      "\nAttributeBegin Translate 0 0 -3 Shape \"disk\" AttributeEnd"},
       {"sky.pfm", PortalPfm(8, pixels)}});
  return ReadScene(files, "s.pbrt");
}

struct LitByPortal {
  explicit LitByPortal(const std::string& world) {
    const ParsedScene parsed = Parse(world);
    EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
    scene = std::make_unique<Scene>(InWorkingSpace(parsed.scene));
    intersector = Intersector::Create(*scene).value();
    lights = std::make_unique<LightSet>(*scene, *intersector);
  }

  std::unique_ptr<Scene> scene;
  std::unique_ptr<Intersector> intersector;
  std::unique_ptr<LightSet> lights;
};

std::string Said(const std::string& world) {
  std::string all;
  for (const Diagnostic& diagnostic : Parse(world).diagnostics)
    all += diagnostic.ToString() + "\n";
  return all;
}

// A rectangle in the plane z = 1, from (-0.3, -0.2) to (0.9, 0.4), through which light goes down.
const char* const kWindow = "\"point3 portal\" [ -0.3 -0.2 1  -0.3 0.4 1  0.9 0.4 1  0.9 -0.2 1 ] ";
// As pbrt-v4 has it: from the first corner x is towards the fourth and y towards the second.
const std::string kEven = std::string("LightSource \"infinite\" \"rgb L\" [ 2 2 2 ] ") + kWindow;
const std::string kMapped =
    std::string("LightSource \"infinite\" \"string filename\" \"sky.pfm\" ") + kWindow;

// The form factor from a horizontal element at (x, y, 0) to the rectangle: the sum over its
// corners, with signs, of that of a rectangle with a corner right above.
double FormFactor(double x, double y) {
  const auto corner = [](double a, double b) {
    const double p = std::sqrt(1 + a * a);
    const double q = std::sqrt(1 + b * b);
    return (a / p * std::atan(b / p) + b / q * std::atan(a / q)) / (2 * kPi64);
  };
  return corner(0.9 - x, 0.4 - y) - corner(-0.3 - x, 0.4 - y) - corner(0.9 - x, -0.2 - y) +
         corner(-0.3 - x, -0.2 - y);
}

// The irradiance at `from` on a plane that looks up, and its standard error.
std::array<double, 2> Irradiance(const LightSet& lights, Vec3 from, int samples) {
  KeyedRng rng(7);
  double sum = 0;
  double squares = 0;
  for (int i = 0; i < samples; ++i) {
    LightSample sample;
    const auto choice = static_cast<double>(rng.Uniform());
    const float u1 = rng.Uniform();
    if (!lights.SampleDirect({from}, choice, u1, rng.Uniform(), sample)) continue;
    const auto value =
        static_cast<double>(Luminance(sample.radiance_over_pdf) * std::max(sample.wi.z, 0.0F));
    sum += value / samples;
    squares += value * value / samples;
  }
  return {sum, std::sqrt(std::max(0.0, squares - sum * sum) / samples)};
}

TEST(PortalLightTest, LightsByTheFormFactorOfTheRectangle) {
  const LitByPortal lit(kEven);
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {0.3, 0.1}, {-2.0, 0.5}, {1.0, -3.0}}) {
    const auto [irradiance, error] =
        Irradiance(*lit.lights, {static_cast<float>(x), static_cast<float>(y), 0}, 20'000);
    const double expected = 2 * kPi64 * FormFactor(x, y);
    EXPECT_NEAR(irradiance, expected, 4.5 * error + 1e-5 * expected) << x << " " << y;
    // Drawn from the rectangle alone, by light: only the cosine is left.
    EXPECT_LT(error * std::sqrt(20'000.0), 0.6 * expected);
  }
}

TEST(PortalLightTest, HasThePowerThatPassesTheRectangle) {
  const LitByPortal lit(kEven);
  EXPECT_NEAR(static_cast<double>(Luminance(lit.lights->TotalPower())), 2 * kPi64 * 1.2 * 0.6,
              1e-3);
  EXPECT_EQ(NameOf(lit.lights->emitter(0).kind), "environment light behind a portal");
}

TEST(PortalLightTest, IsSeenThroughTheRectangleAndFromBelowAlone) {
  const LitByPortal lit(kEven);
  const auto seen = [&](Vec3 from, Vec3 at) {
    return lit.lights->InfiniteRadiance(from, Normalize(at - from)).g;
  };
  EXPECT_FLOAT_EQ(seen({0, 0, 0}, {0.89F, 0.39F, 1}), 2);
  EXPECT_EQ(seen({0, 0, 0}, {0.91F, 0.39F, 1}), 0);
  EXPECT_EQ(seen({0, 0, 0}, {0.89F, 0.41F, 1}), 0);
  EXPECT_EQ(seen({0, 0, 0}, {-0.31F, 0, 1}), 0);
  EXPECT_EQ(seen({0, 0, 0}, {0, -0.21F, 1}), 0);
  EXPECT_FLOAT_EQ(seen({-5, 0, 0.9F}, {0.5F, 0, 1}), 2);
  // From above nothing is seen, through the rectangle or past it.
  EXPECT_EQ(seen({0, 0, 2}, {0, 0, 1}), 0);
  EXPECT_EQ(seen({0, 0, 2}, {0, 0, 3}), 0);
  EXPECT_EQ(seen({0, 0, 0}, {0, 0, -1}), 0);
  LightSample sample;
  EXPECT_FALSE(lit.lights->SampleDirect({0, 0, 2}, 0.5, 0.5F, 0.5F, sample));
  EXPECT_TRUE(lit.lights->Lights(0, {0, 0, 0.9F}));
  EXPECT_FALSE(lit.lights->Lights(0, {0, 0, 1.1F}));
}

// Photons bring to small disks below, some far aside, what sampling brings there.
TEST(PortalLightTest, SendsPhotonsAsItLights) {
  for (const std::string& world : {kEven, kMapped, "Rotate 70 1 2 3 " + kMapped, kMapped + kEven}) {
    const LitByPortal lit(world);
    const std::array<Vec3, 4> places = {
        Vec3{0, 0, 0}, {0.5F, 0.2F, 0}, {-1, 0.5F, 0}, {1.5F, -1, 0}};
    constexpr float kRadius = 0.1F;
    constexpr int kPhotons = 200'000;
    std::array<double, 4> sums{};
    std::array<double, 4> squares{};
    double all = 0;
    double all_squares = 0;
    KeyedRng rng(11);
    for (int i = 0; i < kPhotons; ++i) {
      std::array<float, 5> u{};
      for (float& number : u)
        number = rng.Uniform();
      Emission emission;
      if (!lit.lights->SampleEmission(static_cast<double>(u[0]), u[1], u[2], u[3], u[4], emission))
        continue;
      const Ray& ray = emission.ray;
      const auto flux = static_cast<double>(Luminance(emission.flux));
      all += flux / kPhotons;
      all_squares += flux * flux / kPhotons;
      EXPECT_GT(Length(ray.origin - lit.intersector->bounds().Center()),
                0.49F * lit.intersector->bounds().Diagonal());
      const Vec3 at = ray.origin - ray.direction * (ray.origin.z / ray.direction.z);
      for (std::size_t p = 0; p < places.size(); ++p) {
        if (Length(at - places[p]) > kRadius) continue;
        sums[p] += flux / kPhotons;
        squares[p] += flux * flux / kPhotons;
      }
    }
    const auto power = static_cast<double>(Luminance(lit.lights->TotalPower()));
    EXPECT_NEAR(all, power, 4.5 * std::sqrt(all_squares / kPhotons) + 1e-3 * power);
    for (std::size_t p = 0; p < places.size(); ++p) {
      // The disk's irradiance, of points spread evenly over it.
      double expected = 0;
      double variance = 0;
      constexpr int kPoints = 12;
      for (int i = 0; i < kPoints; ++i) {
        const double r = static_cast<double>(kRadius) * std::sqrt((i % 3 + 0.5) / 3);
        const double angle = 2 * kPi64 * (i / 3 + 0.3) / 4;
        const auto [irradiance, error] =
            Irradiance(*lit.lights,
                       places[p] + Vec3{static_cast<float>(r * std::cos(angle)),
                                        static_cast<float>(r * std::sin(angle)), 0},
                       2000);
        expected += irradiance / kPoints;
        variance += error * error / (kPoints * kPoints);
      }
      const double area = kPi64 * static_cast<double>(kRadius * kRadius);
      // Of a map, the points stand for the disk within a percent.
      EXPECT_NEAR(
          sums[p] / area, expected,
          4.5 * std::sqrt(squares[p] / kPhotons / (area * area) + variance) + 0.01 * expected)
          << world << " " << p;
    }
  }
}

TEST(PortalLightTest, IsReadAsPbrtHasIt) {
  const ParsedScene parsed = Parse("Rotate 90 0 0 1 Translate 5 5 5 " + kEven);
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  const InfiniteLight& light = parsed.scene.infinite_lights.at(0);
  EXPECT_EQ(light.kind, InfiniteLight::Kind::kPortal);
  // In the world, whatever the light's own space is.
  ASSERT_TRUE(light.portal.has_value());
  EXPECT_EQ(light.portal->corner, (Vec3{-0.3F, -0.2F, 1}));
  EXPECT_NEAR(Length(light.portal->along_x - Vec3{1.2F, 0, 0}), 0, 1e-6F);
  EXPECT_NEAR(Length(light.portal->along_y - Vec3{0, 0.6F, 0}), 0, 1e-6F);
  EXPECT_EQ(light.radiance, Gray(2));
  // Illuminance and scale are those of the whole sky.
  const ParsedScene lux = Parse(kEven + "\"float illuminance\" 5");
  ASSERT_TRUE(lux.ok());
  EXPECT_NEAR(static_cast<double>(lux.scene.infinite_lights.at(0).radiance.g), 5 / (2 * kPi64),
              1e-5);
}

TEST(PortalLightTest, IsAlsoScaledWithAScene) {
  const ParsedScene parsed = Parse(
      "LightSource \"infinite\" \"point3 portal\" [ 0 0 1e9  0 1e9 1e9  1e9 1e9 1e9  1e9 0 1e9 ] "
      "AttributeBegin Scale 1e9 1e9 1e9 Shape \"sphere\" AttributeEnd");
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  const Portal& portal = *parsed.scene.infinite_lights.at(0).portal;
  EXPECT_GT(parsed.scene.unit, 1);
  EXPECT_FLOAT_EQ(static_cast<float>(static_cast<double>(portal.corner.z) * parsed.scene.unit),
                  1e9F);
  EXPECT_FLOAT_EQ(static_cast<float>(static_cast<double>(portal.along_x.x) * parsed.scene.unit),
                  1e9F);
  EXPECT_FLOAT_EQ(static_cast<float>(static_cast<double>(portal.along_y.y) * parsed.scene.unit),
                  1e9F);
}

TEST(PortalLightTest, SaysWhatIsWrongWithThePortal) {
  const auto said = [](const std::string& points) {
    return Said("LightSource \"infinite\" \"point3 portal\" [ " + points + " ]");
  };
  EXPECT_THAT(said("0 0 0 0 1 0 1 1 0"), HasSubstr("needs four points"));
  EXPECT_THAT(said("0 0 0 0 1 0 1 2 0 1 0 0"), HasSubstr("is no rectangle"));
  EXPECT_THAT(said("0 0 0 0 1 0 2 1 0 1 0 0"), HasSubstr("is no rectangle"));
  EXPECT_THAT(said("0 0 0 0 0 0 1 0 0 1 0 0"), HasSubstr("is no rectangle"));
  EXPECT_THAT(said("0 0 0 1 1 0 0 1 0 1 0 0"), HasSubstr("is no rectangle"));
  EXPECT_EQ(said("0 0 0 0 1 0 1 1 0 1 0 0"), "");
}

TEST(WindowedConstantTest, HasTheSumOfAnyWindow) {
  const WindowedConstant2D grid(3, 2, {1, 2, 3, 4, 0, 6});
  EXPECT_DOUBLE_EQ(grid.SumIn({0, 3, 0, 2}), 16);
  EXPECT_DOUBLE_EQ(grid.SumIn({1, 2, 0, 1}), 2);
  EXPECT_DOUBLE_EQ(grid.SumIn({0.5, 1.25, 0.5, 2}), 0.5 * 0.5 * 1 + 0.25 * 0.5 * 2 + 0.5 * 4);
  EXPECT_DOUBLE_EQ(grid.WeightAt({2.9F, 1.1F}), 6);
  EXPECT_DOUBLE_EQ(grid.WeightAt({3, 2}), 6);
}

TEST(WindowedConstantTest, DrawsFromTheWindowByWeight) {
  KeyedRng rng(5);
  std::vector<double> weights;
  for (int i = 0; i < 7 * 5; ++i)
    weights.push_back(i % 4 == 0 ? 0 : static_cast<double>(rng.Uniform()));
  const WindowedConstant2D grid(7, 5, weights);
  for (const GridWindow& window :
       {GridWindow{0, 7, 0, 5}, {0.3, 4.6, 1.2, 3.9}, {2.2, 2.7, 1.1, 1.4}, {5.5, 7, 0, 0.75}}) {
    // A quarter of the window has the share of the draws that it has of the weights.
    const double x = window.low_x + 0.4 * (window.high_x - window.low_x);
    const double y = window.low_y + 0.7 * (window.high_y - window.low_y);
    const double share = grid.SumIn({window.low_x, x, window.low_y, y}) / grid.SumIn(window);
    constexpr int kDraws = 100'000;
    int inside = 0;
    for (int i = 0; i < kDraws; ++i) {
      const double u1 = static_cast<double>(rng.Uniform());
      const Vec2 place = grid.Sample(window, u1, static_cast<double>(rng.Uniform()));
      ASSERT_GE(place.x, static_cast<float>(window.low_x));
      ASSERT_LE(place.x, static_cast<float>(window.high_x));
      ASSERT_GE(place.y, static_cast<float>(window.low_y));
      ASSERT_LE(place.y, static_cast<float>(window.high_y));
      ASSERT_GT(grid.WeightAt(place), 0);
      inside += static_cast<double>(place.x) < x && static_cast<double>(place.y) < y ? 1 : 0;
    }
    EXPECT_NEAR(inside, share * kDraws, 4.5 * std::sqrt(share * (1 - share) * kDraws) + 1);
  }
}

}  // namespace
}  // namespace lucerna
