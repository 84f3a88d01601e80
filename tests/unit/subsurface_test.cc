// Light that goes below a surface comes out as far away as the model says, and all of it does.
#include "render/transport/subsurface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "render/math/sobol.h"
#include "render/math/warp.h"
#include "render/tracing/eye_path.h"
#include "render/transport/bsdf.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

constexpr std::size_t kLast = SubsurfaceTable::kNodes - 1;

TEST(SubsurfaceTableTest, AMixHasTheReflectanceThatItIsNamedBy) {
  const SubsurfaceTable table = MakeSubsurfaceTable(1.33F, 0);
  EXPECT_EQ(table.reflectances.front(), 0);
  EXPECT_TRUE(std::ranges::is_sorted(table.reflectances));
  // Diffusion may give back a little more than it gets.
  EXPECT_LE(table.reflectances.back(), 1.03F);
  for (const float reflectance : {0.01F, 0.3F, 0.77F, 0.9F}) {
    const SubsurfaceTable::Mix mix = table.MixOf(reflectance);
    EXPECT_NEAR(table.Cumulative(mix, kLast), reflectance, 1e-6F);
    // The density, which is linear between nodes, integrates to the cumulatives.
    double sum = 0;
    for (std::size_t i = 1; i <= kLast; ++i) {
      const float middle = 0.5F * (table.nodes[i - 1] + table.nodes[i]);
      sum +=
          static_cast<double>(table.Density(mix, middle) * (table.nodes[i] - table.nodes[i - 1]));
      ASSERT_NEAR(sum, static_cast<double>(table.Cumulative(mix, i)), 1e-5);
    }
    for (const float share : {0.0F, 0.01F, 0.5F, 0.9F, 0.999F}) {
      const float r = table.RadiusWithin(mix, share * reflectance);
      const auto above =
          static_cast<std::size_t>(std::ranges::upper_bound(table.nodes, r) - table.nodes.begin());
      ASSERT_LE(above, kLast);
      const float before = table.nodes[above - 1];
      const float within =
          table.Cumulative(mix, above - 1) +
          (r - before) * 0.5F * (table.Density(mix, before) + table.Density(mix, r));
      EXPECT_NEAR(within, share * reflectance, 2e-6F) << reflectance << " " << share;
    }
  }
}

// A flux of 1 goes straight down into a half space of extinction 1 and isotropic scattering, and
// walks until it is absorbed or leaves: what leaves, in all and within a distance.
struct Walked {
  double all = 0, near = 0;
};
Walked WalkBelow(float ior, double albedo, double near, int walks) {
  KeyedRng rng(7);
  Walked left;
  for (int walk = 0; walk < walks; ++walk) {
    double x = 0;
    double y = 0;
    double depth = 0;
    Vec3 direction = {0, 0, 1};  // z downward
    double weight = 1;
    while (weight > 1e-4) {
      double length = -std::log1p(-static_cast<double>(rng.Uniform()));
      const auto go = [&](double by) {
        x += static_cast<double>(direction.x) * by;
        y += static_cast<double>(direction.y) * by;
        depth += static_cast<double>(direction.z) * by;
      };
      if (depth + static_cast<double>(direction.z) * length < 0) {
        const double to_surface = depth / static_cast<double>(-direction.z);
        go(to_surface);
        depth = 0;
        length -= to_surface;
        float cos_t = 0;
        const auto reflected = static_cast<double>(FresnelDielectric(-direction.z, 1 / ior, cos_t));
        left.all += weight * (1 - reflected) / walks;
        if (std::hypot(x, y) < near) left.near += weight * (1 - reflected) / walks;
        weight *= reflected;
        direction.z = -direction.z;
      }
      go(length);
      weight *= albedo;
      const float u1 = rng.Uniform();
      direction = SquareToSphere(u1, rng.Uniform());
    }
  }
  return left;
}

// The model is diffusion with a correction: it is as far from the walk as
// docs/decisions/subsurface.md states, more for less light and at an index of 1.
TEST(SubsurfaceTableTest, ReflectsAboutAsMuchAsARandomWalk) {
  struct Index {
    float ior;
    double most;  // of the reflectance over the walk's, less 1
  };
  for (const auto& [ior, most] :
       std::vector<Index>{{1.0F, 0.16}, {1.33F, 0.12}, {1.5F, 0.12}, {2.0F, 0.1}}) {
    const SubsurfaceTable table = MakeSubsurfaceTable(ior, 0);
    for (const double albedo : {0.6, 0.8, 0.9, 0.95, 0.98, 0.995}) {
      constexpr double kNear = 2;
      const Walked walked = WalkBelow(ior, albedo, kNear, 40000);
      const float reflectance = table.ReflectanceOf(static_cast<float>(albedo));
      EXPECT_NEAR(static_cast<double>(reflectance) / walked.all, 1, most) << ior << " " << albedo;
      // And as far from where it entered.
      const SubsurfaceTable::Mix mix = table.MixOf(reflectance);
      const auto last = static_cast<std::size_t>(
          std::ranges::upper_bound(table.nodes, static_cast<float>(kNear)) - table.nodes.begin());
      const double near =
          static_cast<double>(table.Cumulative(mix, last) / table.Cumulative(mix, kLast));
      EXPECT_NEAR(near, walked.near / walked.all, 0.04) << ior << " " << albedo;
    }
  }
}

// What leaves by SampleBelow per channel, of all that enters per reflectance, and the part of it
// that leaves within a distance.
struct Left {
  std::array<double, 3> all{}, near{};
};
Left LeftOf(const Scene& scene, const SurfacePoint& point, Vec3 wo, float near, int samples) {
  const auto intersector = Intersector::Create(scene).value();
  Left sums;
  for (int i = 0; i < samples; ++i) {
    const SobolPoint u = OwenSobol(static_cast<std::uint64_t>(i), 5);
    LeftBelow left;
    int rays = 0;
    if (!SampleBelow(scene, *intersector, scene.materials[point.material], point, wo, u[0], u[1],
                     u[2], u[3], left, rays)) {
      continue;
    }
    for (int c = 0; c < 3; ++c) {
      const auto weight = static_cast<double>(left.weight[c]) / samples;
      sums.all[static_cast<std::size_t>(c)] += weight;
      if (Length(left.surface.position - point.position) < near)
        sums.near[static_cast<std::size_t>(c)] += weight;
    }
  }
  return sums;
}

Material ColoredSubsurface() {
  Material material = SubsurfaceMaterial(0.8F, 1);
  material.reflectance = {0.9F, 0.6F, 0.2F};
  material.extinction = {5, 10, 40};
  return material;
}

// The integral of the density up to a distance, over the reflectance.
double Within(const Material& material, int channel, double distance) {
  const SubsurfaceTable& table = *material.below;
  const SubsurfaceTable::Mix mix = table.MixOf(material.reflectance[channel]);
  constexpr int kSteps = 200000;
  const double r = distance * static_cast<double>(material.extinction[channel]);
  double sum = 0;
  for (int i = 0; i < kSteps; ++i)
    sum += static_cast<double>(table.Density(mix, static_cast<float>(r * (i + 0.5) / kSteps)));
  return sum * r / kSteps / static_cast<double>(material.reflectance[channel]);
}

SurfacePoint PointAt(Vec3 position, Vec3 normal, std::uint32_t material) {
  SurfacePoint point;
  point.position = position;
  point.geometric_normal = point.shading_normal = normal;
  point.material = material;
  point.clearance = 1e-6F;
  return point;
}

// Probes reach 0.999 of what would leave, which stands for all of it.
constexpr double kProbed = 0.999;

TEST(SampleBelowTest, APlaneGivesBackAllByDistance) {
  Scene scene;
  const std::int32_t material = AddMaterial(scene, ColoredSubsurface());
  AddQuad(scene, {-90, -90, 0}, {180, 0, 0}, {0, 180, 0}, material);
  const SurfacePoint point = PointAt({0.3F, 0.2F, 0}, {0, 0, 1}, 0);
  constexpr float kNear = 0.1F;
  const Left left = LeftOf(scene, point, {0, 0, 1}, kNear, 1 << 16);
  for (int c = 0; c < 3; ++c) {
    const auto channel = static_cast<std::size_t>(c);
    EXPECT_NEAR(left.all[channel], 1, 0.005) << c;
    EXPECT_NEAR(left.near[channel], Within(scene.materials[0], c, 0.1) / kProbed, 0.005) << c;
  }
}

// The area of a sphere within a chord d of a point is πd², as that of a plane: what leaves is what
// would leave a plane within the diameter.
TEST(SampleBelowTest, ABallGivesBackWhatAPlaneWouldWithinItsDiameter) {
  constexpr float kRadius = 0.1F;
  Scene scene;
  AddSphere(scene, {1, 2, 3}, kRadius, AddMaterial(scene, ColoredSubsurface()));
  const Vec3 normal = Normalize({0.3F, -0.5F, 0.7F});
  const SurfacePoint point = PointAt(Vec3{1, 2, 3} + normal * kRadius, normal, 0);
  constexpr float kNear = 0.12F;
  const Left left = LeftOf(scene, point, normal, kNear, 1 << 17);
  for (int c = 0; c < 3; ++c) {
    const auto channel = static_cast<std::size_t>(c);
    const double all = std::min(1.0, Within(scene.materials[0], c, 0.2) / kProbed);
    EXPECT_NEAR(left.all[channel], all, 0.01) << c;
    EXPECT_NEAR(left.near[channel], Within(scene.materials[0], c, 0.12) / kProbed, 0.01) << c;
  }
}

// A sheet of two planes: what the far one gives back is what a plane does beyond their distance.
TEST(SampleBelowTest, ASheetLetsThroughWhatLiesBeyondItsThickness) {
  constexpr float kThickness = 0.05F;
  Scene scene;
  const std::int32_t material = AddMaterial(scene, ColoredSubsurface());
  AddQuad(scene, {-90, -90, 0}, {180, 0, 0}, {0, 180, 0}, material);
  AddQuad(scene, {-90, -90, -kThickness}, {0, 180, 0}, {180, 0, 0}, material);
  const SurfacePoint point = PointAt({0.3F, 0.2F, 0}, {0, 0, 1}, 0);
  const Left left = LeftOf(scene, point, {0, 0, 1}, 0, 1 << 17);
  for (int c = 0; c < 3; ++c) {
    const double through = 1 - Within(scene.materials[0], c, 0.05) / kProbed;
    EXPECT_NEAR(left.all[static_cast<std::size_t>(c)], 1 + through, 0.01) << c;
  }
}

// A channel that leaves nearer than rounding leaves where it entered, and takes no light from
// others nor gives them any.
TEST(SampleBelowTest, AChannelWithoutALengthLeavesWhereItEntered) {
  Scene scene;
  const std::int32_t material = AddMaterial(scene, ColoredSubsurface());
  scene.materials[0].extinction.g = 1e12F;
  AddQuad(scene, {-90, -90, 0}, {180, 0, 0}, {0, 180, 0}, material);
  const SurfacePoint point = PointAt({0.3F, 0.2F, 0}, {0, 0, 1}, 0);
  const Left left = LeftOf(scene, point, {0, 0, 1}, 1e-6F, 1 << 16);
  for (const double all : left.all)
    EXPECT_NEAR(all, 1, 0.005);
  EXPECT_NEAR(left.near[1], 1, 0.005);
  EXPECT_LT(left.near[0], 0.005);
}

// Another material beside it gives back nothing.
TEST(SampleBelowTest, LeavesOnItsOwnMaterialAlone) {
  Scene scene;
  const std::int32_t material = AddMaterial(scene, ColoredSubsurface());
  const std::int32_t other = AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {-90, -90, 0}, {90, 0, 0}, {0, 180, 0}, material);
  AddQuad(scene, {0, -90, 0}, {90, 0, 0}, {0, 180, 0}, other);
  // On the border: half of the plane.
  const SurfacePoint point = PointAt({0, 0, 0}, {0, 0, 1}, 0);
  const Left left = LeftOf(scene, point, {0, 0, 1}, 0, 1 << 16);
  for (const double all : left.all)
    EXPECT_NEAR(all, 0.5, 0.01);
}

// Under a sky of radiance 1 a ball that is large beside its free path is as bright as a plane: the
// surface's reflection and, of what enters, the reflectance.
TEST(SubsurfaceTest, IsAsBrightAsAPlaneInAFurnace) {
  constexpr float kReflectance = 0.7F;
  Scene scene;
  AddSphere(scene, {0, 0, 0}, 1, AddMaterial(scene, SubsurfaceMaterial(kReflectance, 1e-3F)));
  scene.infinite_lights.push_back({Gray(1)});
  SetCamera(scene, {0, 0, -4}, {0, 0, 0}, {0, 1, 0}, 0.1, 1);
  const RenderSettings settings = TestSettings(scene, 1000, 0.01, 40);
  const SceneNeeds needs = NeedsOf(scene, settings);
  const auto intersector = Intersector::Create(scene).value();
  const LightSet lights(scene, *intersector);
  const EyePathTracer tracer(scene, settings, needs, *intersector, lights);
  constexpr int kPaths = 1 << 14;
  double sum = 0;
  for (std::uint64_t pass = 0; pass < kPaths; ++pass)
    sum += static_cast<double>(tracer.Trace(0, 0, pass, {}).direct.g);
  float cos_t = 0;
  const auto reflected = static_cast<double>(FresnelDielectric(1, 1.5F, cos_t));
  const double expected = reflected + (1 - reflected) * static_cast<double>(kReflectance);
  EXPECT_NEAR(sum / kPaths, expected, 0.01);
}

// Light in a closed shade comes through it, from its inner side to its outer one.
TEST(SubsurfaceTest, AShadeIsNotOpaque) {
  const auto is_lit = [](const Material& material) {
    Scene scene;
    const std::int32_t shade = AddMaterial(scene, material);
    AddSphere(scene, {0, 0, 0}, 1, shade);
    AddSphere(scene, {0, 0, 0}, 0.95F, shade, kNoAreaLight, true);
    scene.point_lights.push_back({{0, 0, 0}, Gray(1)});
    SetCamera(scene, {0, 0, -4}, {0, 0, 0}, {0, 1, 0}, 10, 1);
    const RenderSettings settings = TestSettings(scene, 1000, 0.01, 40);
    const SceneNeeds needs = NeedsOf(scene, settings);
    if (!needs.Uses(Part::kDeltaLights)) return false;
    const auto intersector = Intersector::Create(scene).value();
    const LightSet lights(scene, *intersector);
    const EyePathTracer tracer(scene, settings, needs, *intersector, lights);
    float seen = 0;
    for (std::uint64_t pass = 0; pass < 256; ++pass)
      seen += tracer.Trace(0, 0, pass, {}).direct.g;
    return seen > 0;
  };
  EXPECT_TRUE(is_lit(SubsurfaceMaterial(0.8F, 0.05F)));
  EXPECT_FALSE(is_lit(DiffuseMaterial(0.8F)));
}

}  // namespace
}  // namespace lucerna
