// Lights whose intensity is a picture: goniometric and projection, as pbrt-v4 texts give them.
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
#include "render/transport/light.h"
#include "render/transport/working_space.h"
#include "tests/support/memory_files.h"

namespace lucerna {
namespace {

using ::testing::HasSubstr;

// Grey, rows from the top.
std::string Pfm(int width, const std::vector<float>& values) {
  const int height = static_cast<int>(values.size()) / width;
  std::string bytes = "Pf\n" + std::to_string(width) + " " + std::to_string(height) + "\n-1\n";
  // A PFM file begins with the lowest row.
  for (int y = height - 1; y >= 0; --y) {
    for (int x = 0; x < width; ++x) {
      char raw[4];
      std::memcpy(raw, &values[static_cast<std::size_t>(y * width + x)], 4);
      bytes.append(raw, 4);
    }
  }
  return bytes;
}

ParsedScene Parse(const std::string& light, const std::string& picture) {
  // Something that holds the light: photons need a scene.
  MemoryFiles files(
      {{"s.pbrt", "Camera \"perspective\" WorldBegin\n" + light +
                      "\nAttributeBegin Translate 0 0 20 Shape \"sphere\" AttributeEnd"},
       {"p.pfm", picture}});
  return ReadScene(files, "s.pbrt");
}

struct Lit {
  Lit(const std::string& light, const std::string& picture) {
    const ParsedScene parsed = Parse(light, picture);
    EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
    scene = std::make_unique<Scene>(InWorkingSpace(parsed.scene));
    intersector = Intersector::Create(*scene).value();
    lights = std::make_unique<LightSet>(*scene, *intersector);
  }

  // [W·sr⁻¹] in a direction away from the light, which is at the origin, of what arrives there.
  [[nodiscard]] double IntensityAt(Vec3 direction) const {
    LightSample sample;
    constexpr float kDistance = 2;
    if (!lights->SampleDirect({Normalize(direction) * kDistance}, 0.5, 0.5F, 0.5F, sample))
      return 0;
    return static_cast<double>(Luminance(sample.radiance_over_pdf)) * 4;
  }

  std::unique_ptr<Scene> scene;
  std::unique_ptr<Intersector> intersector;
  std::unique_ptr<LightSet> lights;
};

std::string Said(const std::string& light, const std::string& picture) {
  std::string all;
  for (const Diagnostic& diagnostic : Parse(light, picture).diagnostics)
    all += diagnostic.ToString() + "\n";
  return all;
}

// Photons bring into cones around these directions what arrives there.
void ExpectPhotonsBringTheIntensity(const Lit& lit, const std::vector<Vec3>& directions) {
  constexpr int kPhotons = 400'000;
  const double one_minus_cos = 0.01;
  const double solid_angle = 2 * kPi64 * one_minus_cos;
  std::vector<double> sums(directions.size());
  std::vector<double> squares(directions.size());
  double all = 0;
  KeyedRng rng(17);
  for (int i = 0; i < kPhotons; ++i) {
    const auto choice = static_cast<double>(rng.Uniform());
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    Emission emission;
    if (!lit.lights->SampleEmission(choice, 0.5F, 0.5F, u1, u2, emission)) continue;
    const auto flux = static_cast<double>(Luminance(emission.flux));
    all += flux / kPhotons;
    for (std::size_t d = 0; d < directions.size(); ++d) {
      if (1 - static_cast<double>(Dot(emission.ray.direction, Normalize(directions[d]))) >
          one_minus_cos) {
        continue;
      }
      sums[d] += flux / kPhotons;
      squares[d] += flux * flux / kPhotons;
    }
  }
  EXPECT_NEAR(all, static_cast<double>(Luminance(lit.lights->TotalPower())), 0.005 * all);
  for (std::size_t d = 0; d < directions.size(); ++d) {
    const double error = std::sqrt(squares[d] / kPhotons);
    EXPECT_NEAR(sums[d], lit.IntensityAt(directions[d]) * solid_angle, 4.5 * error + 1e-9) << d;
  }
}

const char* const kSlide = "LightSource \"projection\" \"string filename\" \"p.pfm\" ";

TEST(ProjectionLightTest, ThrowsThePictureUpright) {
  // Twice as wide as high: 90 degrees up and down, and slopes of up to 2 to the sides.
  const Lit lit(std::string(kSlide) + "\"float scale\" 3", Pfm(4, {1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_NEAR(lit.IntensityAt({-1.5F, 0.5F, 1}), 3 * 1, 1e-4);
  EXPECT_NEAR(lit.IntensityAt({1.5F, 0.5F, 1}), 3 * 4, 1e-4);
  EXPECT_NEAR(lit.IntensityAt({-1.5F, -0.5F, 1}), 3 * 5, 1e-4);
  EXPECT_NEAR(lit.IntensityAt({0.5F, -0.5F, 1}), 3 * 7, 1e-4);
  EXPECT_EQ(lit.IntensityAt({2.1F, 0, 1}), 0);
  EXPECT_EQ(lit.IntensityAt({0, 1.1F, 1}), 0);
  EXPECT_EQ(lit.IntensityAt({0.5F, 0.5F, -1}), 0);
  ExpectPhotonsBringTheIntensity(lit, {{-1.38F, 0.5F, 1}, {0.5F, -0.5F, 1}, {1.38F, -0.5F, 1}});
}

// A white square of 90 degrees has a third of a hemisphere.
TEST(ProjectionLightTest, HasThePowerOfItsSolidAngle) {
  const Lit lit(kSlide, Pfm(1, {1}));
  EXPECT_NEAR(static_cast<double>(Luminance(lit.lights->TotalPower())), 2 * kPi64 / 3, 1e-4);
  const Lit given(std::string(kSlide) + "\"float power\" 7 \"float fov\" 40", Pfm(1, {0.3F}));
  EXPECT_NEAR(static_cast<double>(Luminance(given.lights->TotalPower())), 7, 1e-3);
  ExpectPhotonsBringTheIntensity(given, {{0, 0, 1}, {0.2F, -0.2F, 1}});
}

const char* const kLamp = "LightSource \"goniometric\" \"string filename\" \"p.pfm\" ";

TEST(GoniometricLightTest, HasThePoleOfItsPictureAlongItsY) {
  // The middle of the square is the pole, its corners the other one.
  const Lit lit(std::string(kLamp) + "\"rgb I\" [ 2 2 2 ]", Pfm(3, {1, 2, 1, 3, 5, 4, 1, 6, 1}));
  EXPECT_NEAR(lit.IntensityAt({0, 1, 0}), 2 * 5, 1e-3);
  EXPECT_NEAR(lit.IntensityAt({0, -1, 0}), 2 * 1, 1e-3);
  // u grows along x, v along z of the light.
  EXPECT_NEAR(lit.IntensityAt({1, 0.1F, 0}), 2 * 4, 1e-3);
  EXPECT_NEAR(lit.IntensityAt({-1, 0.1F, 0}), 2 * 3, 1e-3);
  EXPECT_NEAR(lit.IntensityAt({0, 0.1F, 1}), 2 * 6, 1e-3);
  ExpectPhotonsBringTheIntensity(lit, {{0, 1, 0}, {1, 0.1F, 0}, {0, 0.1F, 1}, {0, -1, 0}});
}

TEST(GoniometricLightTest, OfAnEvenPictureIsAPoint) {
  const Lit lit(kLamp, Pfm(2, {0.5F, 0.5F, 0.5F, 0.5F}));
  EXPECT_NEAR(static_cast<double>(Luminance(lit.lights->TotalPower())), 2 * kPi64, 1e-4);
  EXPECT_NEAR(lit.IntensityAt({1, 2, -3}), 0.5, 1e-5);
  const Lit given(std::string(kLamp) + "\"float power\" 9", Pfm(2, {0, 1, 0.5F, 0.5F}));
  EXPECT_NEAR(static_cast<double>(Luminance(given.lights->TotalPower())), 9, 1e-3);
}

TEST(PictureLightsTest, SayWhatIsWrongWithThePicture) {
  EXPECT_THAT(Said(kLamp, Pfm(2, {1, 1})), HasSubstr("square"));
  EXPECT_THAT(Said("LightSource \"projection\"", ""), HasSubstr("needs \"string filename\""));
  EXPECT_THAT(Said(kSlide, "no picture"), HasSubstr("cannot be read"));
  EXPECT_THAT(Said(kSlide, Pfm(1, {1e30F})), HasSubstr("too bright"));
  EXPECT_THAT(Said(kSlide, Pfm(1, {0})), HasSubstr("emits nothing"));
  EXPECT_THAT(Said(std::string("Scale 1 2 1 ") + kSlide, Pfm(1, {1})), HasSubstr("stretched"));
}

}  // namespace
}  // namespace lucerna
