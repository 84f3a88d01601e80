// Sensors measure the irradiance that theory says: straight from lights of several shapes, in
// penumbras, on curved surfaces, at edges and in corners, and by photons alone.
//
// Deterministic cases are exact up to rounding. The others are means of independent renders, and
// their bounds Student's quantile of the spread, at a chance of a false alarm of 1e-3 for all of
// this file.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/warp.h"
#include "tests/support/chi_square.h"
#include "tests/support/local_render.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

constexpr int kParts = 16;
constexpr int kComparisons = 82;

void SetSensors(Scene& scene, std::vector<Sensor> sensors, double spacing) {
  scene.camera = Camera();
  scene.camera.kind = Camera::Kind::kSensors;
  scene.camera.window_scale = spacing;
  scene.sensors = std::move(sensors);
  for (Sensor& sensor : scene.sensors)
    sensor.spacing = static_cast<float>(spacing);
  scene.film.width = static_cast<int>(scene.sensors.size());
  scene.film.height = 1;
  scene.film.crop_x0 = 0;
  scene.film.crop_y0 = 0;
  scene.film.crop_x1 = scene.film.width;
  scene.film.crop_y1 = 1;
}

// Of each sensor.
std::vector<MeasuredMean> IrradianceOf(const Scene& scene, RenderSettings settings, int passes) {
  std::vector<std::vector<double>> parts(scene.sensors.size());
  for (int part = 0; part < kParts; ++part) {
    settings.seed = 100 + static_cast<std::uint64_t>(part);
    const Image image = RenderLocally(scene, settings, passes);
    for (std::size_t i = 0; i < parts.size(); ++i)
      parts[i].push_back(kPi64 * static_cast<double>(image.Find("G")->pixels[i]));
  }
  std::vector<MeasuredMean> measured;
  for (const std::vector<double>& of : parts)
    measured.push_back(MeanOf(of));
  return measured;
}

double Bound(const MeasuredMean& measured) {
  return StudentQuantile(SidakLevel(1e-3, kComparisons), kParts) * measured.standard_error;
}

// Measures, and compares with `expected` up to `slack` of it and chance, which must be below
// `precision`.
void ExpectIrradiance(const Scene& scene, const RenderSettings& settings, int passes,
                      const std::vector<double>& expected, double slack = 1e-4,
                      double precision = 0.03) {
  const std::vector<MeasuredMean> measured = IrradianceOf(scene, settings, passes);
  ASSERT_EQ(measured.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const double bound = Bound(measured[i]);
    EXPECT_NEAR(measured[i].mean, expected[i], slack * expected[i] + bound)
        << "sensor " << i << ", bound " << bound;
    EXPECT_LT(bound, precision * expected[i] + 1e-12) << "sensor " << i;
  }
}

// Without a depth: no light that was scattered.
RenderSettings SettingsOfSensors(const Scene& scene, std::int64_t photons_per_pass = 1000,
                                 int max_depth = 1) {
  RenderOverrides overrides;
  overrides.photons_per_pass = photons_per_pass;
  overrides.max_depth = max_depth;
  return SettingsFor(scene, overrides);
}

// A floor of 8 × 8 at z = 0 and sensors on it.
Scene Floor(const std::vector<Vec3>& places) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {-4, -4, 0}, {8, 0, 0}, {0, 8, 0}, 0);
  std::vector<Sensor> sensors;
  for (const Vec3 place : places)
    sensors.push_back({place, {0, 0, 1}, 0});
  SetSensors(scene, std::move(sensors), 0.1);
  return scene;
}

// Under the corner of a rectangle a × b of radiance 1 that is parallel to the floor at height h.
double UnderCorner(double a, double b, double h) {
  const double ra = std::hypot(a, h);
  const double rb = std::hypot(b, h);
  return (a / ra * std::atan(b / ra) + b / rb * std::atan(a / rb)) / 2;
}

TEST(SensorsTest, OfAPointLightFallsWithTheSquareOfTheDistance) {
  const std::vector<Vec3> places = {{0, 0, 0}, {1, 0, 0}, {2, -3, 0}, {-4, 4, 0}};
  Scene scene = Floor(places);
  PointLight light;
  light.position = {0.5F, 0, 2};
  light.intensity = Gray(3);
  scene.point_lights.push_back(light);
  std::vector<double> expected;
  for (const Vec3 place : places) {
    const double distance =
        std::hypot(static_cast<double>(place.x) - 0.5, static_cast<double>(place.y), 2.0);
    expected.push_back(3 * 2 / (distance * distance * distance));
  }
  ExpectIrradiance(scene, SettingsOfSensors(scene), 2, expected);
}

TEST(SensorsTest, OfADiskOnItsAxisAndBesideIt) {
  const std::vector<Vec3> places = {{0, 0, 0}, {0.5F, 0, 0}, {0, -2, 0}, {3, 3, 0}};
  Scene scene = Floor(places);
  AddDisk(scene, {0, 0, 1.5F}, {0, 0, -1}, 0.8F, 0, AddAreaLight(scene, 2));
  std::vector<double> expected;
  for (const Vec3 place : places) {
    const double r = std::hypot(static_cast<double>(place.x), static_cast<double>(place.y));
    const double h = 1.5;
    const double a = 0.8;
    const double sum = h * h + r * r + a * a;
    expected.push_back(2 * kPi64 / 2 *
                       (1 - (sum - 2 * a * a) / std::sqrt(sum * sum - 4 * r * r * a * a)));
  }
  // The radius is that of a float.
  ExpectIrradiance(scene, SettingsOfSensors(scene), 1024, expected);
}

TEST(SensorsTest, OfARectangleUnderItsCornerAndItsMiddle) {
  Scene scene = Floor({{0, 0, 0}, {1, 0.5F, 0}});
  AddQuad(scene, {0, 0, 1}, {0, 1, 0}, {2, 0, 0}, 0, AddAreaLight(scene, 1));
  ExpectIrradiance(scene, SettingsOfSensors(scene), 1024,
                   {UnderCorner(2, 1, 1), 4 * UnderCorner(1, 0.5, 1)});
}

// The direct light of the two luminaires of an office on its desks.
TEST(SensorsTest, OfTwoLuminairesOverADesk) {
  Scene scene = LoadScene("office.pbrt");
  std::vector<Sensor> sensors;
  std::vector<double> expected;
  for (const auto& [x, y] : {std::pair(1.8, 2.0), std::pair(1.1, 1.7), std::pair(4.9, 2.3)}) {
    sensors.push_back({{static_cast<float>(x), static_cast<float>(y), 0.75F}, {0, 0, 1}, 0});
    // Of the rectangle from (0, 0) to (a, b), seen from below (0, 0); odd in both.
    const auto up_to = [](double a, double b) {
      return std::copysign(1.0, a * b) * UnderCorner(std::abs(a), std::abs(b), 2.7 - 0.75);
    };
    double sum = 0;
    for (const double left : {1.2, 3.6}) {
      const double right = left + 1.2;
      sum += up_to(right - x, 2.15 - y) - up_to(left - x, 2.15 - y) - up_to(right - x, 1.85 - y) +
             up_to(left - x, 1.85 - y);
    }
    expected.push_back(6.0 * sum);
  }
  SetSensors(scene, std::move(sensors), 0.05);
  ExpectIrradiance(scene, SettingsOfSensors(scene), 512, expected, 1e-3);
}

TEST(SensorsTest, OfAPenumbra) {
  // Half-way up a sheet hides the light's half x > c, where c is seen along its rim x = 0.
  const std::vector<Vec3> places = {{-0.2F, 0, 0}, {-0.05F, 0, 0}, {0.3F, 0, 0}, {-1.5F, 0, 0}};
  Scene scene = Floor(places);
  AddQuad(scene, {-0.5F, -0.5F, 2}, {0, 1, 0}, {1, 0, 0}, 0, AddAreaLight(scene, 1));
  AddQuad(scene, {0, -3, 1}, {3, 0, 0}, {0, 6, 0}, 0);
  std::vector<double> expected;
  for (const Vec3 place : places) {
    const auto x = static_cast<double>(place.x);
    // Seen from `place`, the rim hides what lies beyond -x on the light's plane.
    const double end = std::min(std::max(-x, -0.5), 0.5);
    const auto up_to = [&](double to) {
      const double width = to - x;
      return std::copysign(2 * UnderCorner(std::abs(width), 0.5, 2), width);
    };
    expected.push_back(up_to(end) - up_to(-0.5));
  }
  ExpectIrradiance(scene, SettingsOfSensors(scene), 2048, expected, 1e-4, 0.05);
}

TEST(SensorsTest, OfTheSunOnASphereFallsWithTheCosine) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddSphere(scene, {1, 2, 3}, 0.5F, 0);
  DistantLight sun;
  sun.direction = {0, 0, -1};
  sun.irradiance = Gray(4);
  scene.distant_lights.push_back(sun);
  std::vector<Sensor> sensors;
  std::vector<double> expected;
  for (const double angle : {0.0, 0.5, 1.0, 1.5, 2.0, 3.0}) {
    const Vec3 normal = {static_cast<float>(std::sin(angle)), 0,
                         static_cast<float>(std::cos(angle))};
    sensors.push_back({Vec3{1, 2, 3} + normal * 0.5F, normal, 0});
    expected.push_back(std::max(0.0, 4 * std::cos(angle)));
  }
  SetSensors(scene, std::move(sensors), 0.05);
  ExpectIrradiance(scene, SettingsOfSensors(scene), 2, expected, 1e-3);
}

// A closed room in which everything shines 1 and reflects half: radiance 2 arrives everywhere, half
// of it by photons.
TEST(SensorsTest, OfAFurnaceIsTheSameInCornersAndAtEdges) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddAreaLight(scene, 1);
  AddBox(scene, {-1, -1, -1}, {1, 1, 1}, 0);
  TriangleMesh& walls = scene.meshes.back();
  walls.traits.area_light = 0;
  for (std::size_t i = 0; i < walls.indices.size(); i += 3)
    std::swap(walls.indices[i + 1], walls.indices[i + 2]);
  constexpr float kBeside = 1 - 1e-4F;
  std::vector<Sensor> sensors;
  // In the middle of the floor, near an edge of it, beside it, near a corner, beside it.
  for (const Vec3 place : {Vec3{0.1F, 0.2F, -1}, Vec3{0.97F, 0.2F, -1}, Vec3{kBeside, 0.2F, -1},
                           Vec3{-0.97F, 0.96F, -1}, Vec3{-kBeside, kBeside, -1}}) {
    sensors.push_back({place, {0, 0, 1}, 0});
  }
  sensors.push_back({{-1, kBeside, kBeside}, {1, 0, 0}, 0});
  SetSensors(scene, std::move(sensors), 0.15);
  ExpectIrradiance(scene, SettingsOfSensors(scene, 60000, 40), 24,
                   std::vector<double>(6, 2 * kPi64), 0.0005, 0.06);
}

TEST(SensorsTest, DoesNotPassAThinWall) {
  Scene scene = Floor({});
  // A point light in the half x < 0 of a closed box without light in the other half.
  AddBox(scene, {-1, -1, -1}, {1, 1, 1}, 0);
  AddQuad(scene, {0, -1, -1}, {0, 2, 0}, {0, 0, 2}, 0);
  PointLight light;
  light.position = {-0.5F, 0, 0};
  light.intensity = Gray(1);
  scene.point_lights.push_back(light);
  SetSensors(scene,
             {{{0, 0.3F, 0.2F}, {1, 0, 0}, 0},
              {{0.001F, 0, -1}, {0, 0, 1}, 0},
              {{0, 0.3F, 0.2F}, {-1, 0, 0}, 0}},
             0.1);
  const Image image = RenderLocally(scene, SettingsOfSensors(scene, 20000, 5), 4);
  EXPECT_EQ(image.Find("G")->pixels[0], 0);
  EXPECT_EQ(image.Find("G")->pixels[1], 0);
  EXPECT_GT(image.Find("G")->pixels[2], 0.1F);
}

// A point light within glass of an index of nearly 1: photons carry all its light. Each triangle of
// the floor is a bucket.
// The mean over a triangle, by the middles of small ones. `value_at`: of the shares of its corners.
template <typename Value>
double MeanOverTriangle(const Value& value_at) {
  constexpr int kFine = 400;
  double sum = 0;
  double count = 0;
  for (int i = 0; i < kFine; ++i) {
    for (int j = 0; j < kFine - i; ++j) {
      for (const double inside : {1.0 / 3, 2.0 / 3}) {
        // The second of two small triangles is not there at the slanted side.
        if (inside > 0.5 && i + j == kFine - 1) continue;
        const double u = (i + inside) / kFine;
        const double v = (j + inside) / kFine;
        sum += value_at(1 - u - v, u, v);
        ++count;
      }
    }
  }
  return sum / count;
}

TEST(SensorsTest, DirectLightOfABucketIsTheMeanOverIt) {
  // A light close above one corner; a screen hides a part of the triangle from it.
  Scene scene = Floor({{4.0F / 3, 4.0F / 3, 0}});
  scene.sensor_buckets = {{{Vec3{0, 0, 0}, Vec3{4, 0, 0}, Vec3{0, 4, 0}}, {}, 0}};
  AddQuad(scene, {2, -4, 0}, {0, 8, 0}, {0, 0, 8}, 0);
  PointLight light;
  light.position = {0.5F, 0.5F, 1};
  light.intensity = Gray(1);
  scene.point_lights.push_back(light);
  const double expected = MeanOverTriangle([](double /*at_a*/, double at_b, double at_c) {
    const double dx = 4 * at_b - 0.5;
    const double dy = 4 * at_c - 0.5;
    return 4 * at_b < 2 ? 1 / std::pow(dx * dx + dy * dy + 1, 1.5) : 0;
  });
  ExpectIrradiance(scene, SettingsOfSensors(scene), 256, {expected}, 1e-3);
  // That of the middle alone is another.
  EXPECT_GT(std::abs(1 / std::pow(2 * 25.0 / 36 + 1, 1.5) - expected), 0.1 * expected);
}

TEST(SensorsTest, DirectLightOfABucketOnABallIsThatOfTheBall) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddSphere(scene, {1, 2, 3}, 0.5F, 0);
  DistantLight sun;
  sun.direction = {0, 0, -1};
  sun.irradiance = Gray(4);
  scene.distant_lights.push_back(sun);
  const Vec3 middle = Normalize(Vec3{1, 1, 1});
  SetSensors(scene, {{Vec3{1, 2, 3} + middle * 0.5F, middle, 0}}, 0.05);
  scene.sensor_buckets = {
      {{Vec3{1.5F, 2, 3}, Vec3{1, 2.5F, 3}, Vec3{1, 2, 3.5F}}, {1, 2, 3}, 0.5F}};
  // Of the points over a triangle, the cosine towards the sun; inside of the ball it would be dark.
  const double expected = MeanOverTriangle([](double at_a, double at_b, double at_c) {
    return 4 * at_c / std::sqrt(at_a * at_a + at_b * at_b + at_c * at_c);
  });
  ExpectIrradiance(scene, SettingsOfSensors(scene), 256, {expected}, 1e-3);
}

TEST(SensorsTest, BucketsHoldThePhotonsOfTheirTriangles) {
  constexpr int kSide = 4;       // squares along a side of the floor
  constexpr double kHeight = 3;  // of the light
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {-4, -4, 0}, {8, 0, 0}, {0, 8, 0}, 0);
  AddMaterial(scene, DielectricMaterial(1.00001F));
  AddSphere(scene, {0, 0, static_cast<float>(kHeight)}, 0.2F, 1);
  PointLight light;
  light.position = {0, 0, static_cast<float>(kHeight)};
  light.intensity = Gray(1);
  scene.point_lights.push_back(light);

  std::vector<Sensor> sensors;
  std::vector<double> expected;
  std::vector<float> reach;
  constexpr float kWidth = 8.0F / kSide;
  const auto corner = [](int x, int y) {
    return Vec3{-4 + kWidth * static_cast<float>(x), -4 + kWidth * static_cast<float>(y), 0};
  };
  const auto irradiance_at = [](double x, double y) {
    return kHeight / std::pow(x * x + y * y + kHeight * kHeight, 1.5);
  };
  const auto add = [&](Vec3 a, Vec3 b, Vec3 c) {
    sensors.push_back({(a + b + c) * (1.0F / 3), {0, 0, 1}, 0});
    const Vec3 middle = sensors.back().position;
    reach.push_back(1.001F *
                    std::max({Length(a - middle), Length(b - middle), Length(c - middle)}));
    scene.sensor_borders.insert(scene.sensor_borders.end(), {{a, b}, {b, c}, {c, a}});
    // The mean over the triangle, by its parts.
    constexpr int kFine = 64;
    double sum = 0;
    int count = 0;
    for (int i = 0; i < kFine; ++i) {
      for (int j = 0; j < kFine - i; ++j) {
        for (const double inside : {1.0 / 3, 2.0 / 3}) {
          // The second of two small triangles is not there at the slanted side.
          if (inside > 0.5 && i + j == kFine - 1) continue;
          const double u = (i + inside) / kFine;
          const double v = (j + inside) / kFine;
          const auto at = [&](float of_a, float of_b, float of_c) {
            return static_cast<double>(of_a) * (1 - u - v) + static_cast<double>(of_b) * u +
                   static_cast<double>(of_c) * v;
          };
          sum += irradiance_at(at(a.x, b.x, c.x), at(a.y, b.y, c.y));
          ++count;
        }
      }
    }
    expected.push_back(sum / count);
  };
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      add(corner(x, y), corner(x + 1, y), corner(x + 1, y + 1));
      add(corner(x, y), corner(x + 1, y + 1), corner(x, y + 1));
    }
  }
  SetSensors(scene, std::move(sensors), 1);
  for (std::size_t i = 0; i < reach.size(); ++i)
    scene.sensors[i].spacing = reach[i];
  RenderOverrides overrides;
  overrides.photons_per_pass = 40000;
  overrides.max_depth = 4;
  overrides.radius_controller = RadiusControllerKind::kFixed;
  overrides.kernel = KernelKind::kConstant;
  overrides.initial_radius = 0;
  overrides.initial_footprints = 1;
  const RenderSettings settings = SettingsFor(scene, overrides);
  constexpr int kPasses = 4;
  // The film reflects 2.5e-11 of the light, the sphere is 0.2 wide: nothing else is lost.
  ExpectIrradiance(scene, settings, kPasses, expected, 1e-3, 0.06);

  // A photon counts in one bucket: their light is that of the solid angle of the floor.
  std::vector<double> totals;
  for (int part = 0; part < kParts; ++part) {
    RenderSettings of_part = settings;
    of_part.seed = 900 + static_cast<std::uint64_t>(part);
    const Image image = RenderLocally(scene, of_part, kPasses);
    double total = 0;
    for (std::size_t i = 0; i < expected.size(); ++i)
      total += kPi64 * static_cast<double>(image.Find("G")->pixels[i]) * kWidth * kWidth / 2;
    totals.push_back(total);
  }
  const MeasuredMean total = MeanOf(totals);
  const double solid_angle = 4 * std::atan(16 / (kHeight * std::sqrt(32 + kHeight * kHeight)));
  EXPECT_NEAR(total.mean, solid_angle, 1e-3 * solid_angle + Bound(total));
  EXPECT_LT(Bound(total), 0.01 * solid_angle);
}

// The same as a camera sees: a diffuse surface shows its irradiance times its reflectance over pi.
TEST(SensorsTest, IsWhatACameraSeesOfADiffuseSurface) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.6F));
  AddQuad(scene, {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, 0);
  AddQuad(scene, {-2, -2, 0}, {0, 4, 0}, {0, 0, 3}, 0);
  AddMaterial(scene, DielectricMaterial(1.5F));
  AddSphere(scene, {0.3F, 0, 1}, 0.5F, 1);
  PointLight light;
  light.position = {0.4F, 0.2F, 3};
  light.intensity = Gray(5);
  scene.point_lights.push_back(light);
  Scene seen = scene;
  // Nearly one point of the floor, from the side: in the light that the ball gathers, a tenth
  // beside its axis, where it has no bound.
  SetCamera(seen, {1.5, -1.5, 0.9}, {0.33, -0.04, 0}, {0, 0, 1}, 0.2, 1);
  RenderOverrides overrides;
  overrides.photons_per_pass = 30000;
  overrides.initial_radius = 0.05;
  constexpr int kPasses = 32;
  std::vector<double> of_camera;
  for (int part = 0; part < kParts; ++part) {
    overrides.seed = 500 + static_cast<std::uint64_t>(part);
    const Image image = RenderLocally(seen, SettingsFor(seen, overrides), kPasses);
    of_camera.push_back(static_cast<double>(image.Find("G")->pixels[0]) * kPi64 / 0.6);
  }
  const MeasuredMean camera = MeanOf(of_camera);
  SetSensors(scene, {{{0.33F, -0.04F, 0}, {0, 0, 1}, 0}}, 0.05);
  const MeasuredMean sensor = IrradianceOf(scene, SettingsFor(scene, overrides), kPasses).front();
  const double bound = std::hypot(Bound(camera), Bound(sensor));
  EXPECT_NEAR(sensor.mean, camera.mean, bound);
  EXPECT_LT(bound, 0.05 * camera.mean);
}

}  // namespace
}  // namespace lucerna
