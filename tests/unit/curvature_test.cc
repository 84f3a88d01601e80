// A mesh must be bent as the surface is that its vertices and normals were taken from, its
// gradients must bound that surface's, and no mesh, however broken, may give NaN.
#include "render/geometry/curvature.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

using std::numbers::pi;

struct Vertex {
  std::array<double, 3> position, normal;
};
using Surface = std::function<Vertex(double u, double v)>;

Vec3 ToVec3(const std::array<double, 3>& a) {
  return {static_cast<float>(a[0]), static_cast<float>(a[1]), static_cast<float>(a[2])};
}

// `surface` over [u0, u1] x [v0, v1] in columns x rows cells of two triangles. The outward normal
// is along du x dv.
TriangleMesh Tessellate(const Surface& surface, std::array<double, 2> u, std::array<double, 2> v,
                        std::uint32_t columns, std::uint32_t rows) {
  TriangleMesh mesh;
  for (std::uint32_t j = 0; j <= rows; ++j) {
    for (std::uint32_t i = 0; i <= columns; ++i) {
      const Vertex vertex =
          surface(u[0] + (u[1] - u[0]) * i / columns, v[0] + (v[1] - v[0]) * j / rows);
      mesh.positions.push_back(ToVec3(vertex.position));
      mesh.normals.push_back(ToVec3(vertex.normal));
    }
  }
  for (std::uint32_t j = 0; j < rows; ++j) {
    for (std::uint32_t i = 0; i < columns; ++i) {
      const std::uint32_t a = j * (columns + 1) + i;
      const std::uint32_t b = a + columns + 1;
      for (const std::uint32_t index : {a, a + 1, b + 1, a, b + 1, b}) {
        mesh.indices.push_back(index);
      }
    }
  }
  return mesh;
}

Surface SphereSurface(double radius) {
  return [radius](double longitude, double latitude) {
    const std::array<double, 3> n = {std::cos(longitude) * std::cos(latitude),
                                     std::sin(longitude) * std::cos(latitude), std::sin(latitude)};
    return Vertex{{radius * n[0], radius * n[1], radius * n[2]}, n};
  };
}

// z = height(x, y) with its slopes, seen from above.
Surface HeightField(const std::function<std::array<double, 3>(double, double)>& height) {
  return [height](double x, double y) {
    const auto [z, z_x, z_y] = height(x, y);
    const double length = std::sqrt(1 + z_x * z_x + z_y * z_y);
    return Vertex{{x, y, z}, {-z_x / length, -z_y / length, 1 / length}};
  };
}

Scene SceneOf(TriangleMesh mesh) {
  Scene scene;
  mesh.traits.material = AddMaterial(scene, DielectricMaterial(1.5F));
  scene.meshes.push_back(std::move(mesh));
  return scene;
}

bool Any(const Material&) {
  return true;
}

// The middle of a triangle.
SurfacePoint MiddleOf(const Scene& scene, std::uint32_t triangle) {
  const TriangleMesh& mesh = scene.meshes[0];
  const Vec3 p0 = mesh.positions[mesh.indices[3 * triangle]];
  const Vec3 p1 = mesh.positions[mesh.indices[3 * triangle + 1]];
  const Vec3 p2 = mesh.positions[mesh.indices[3 * triangle + 2]];
  SurfacePoint point;
  point.position = (p0 + p1 + p2) * (1.0F / 3);
  const Vec3 across = Cross(p1 - p0, p2 - p0);
  // At the poles of a tessellated sphere two corners are one.
  point.geometric_normal = LengthSquared(across) > 0 ? Normalize(across) : Vec3{0, 0, 1};
  point.shading_normal = point.geometric_normal;
  point.primitive = triangle;
  return point;
}

std::uint32_t TriangleCount(const Scene& scene) {
  return static_cast<std::uint32_t>(scene.TriangleCount());
}

TEST(SurfaceCurvatureTest, OfATessellatedSphereIsThatOfTheSphere) {
  for (const double radius : {0.01, 1.0, 300.0}) {
    for (const std::uint32_t cells : {6U, 24U, 96U}) {
      const Scene scene =
          SceneOf(Tessellate(SphereSurface(radius), {0, 2 * pi}, {-1.2, 1.2}, 2 * cells, cells));
      const SurfaceCurvature curvature(scene, Any);
      for (std::uint32_t i = 0; i < TriangleCount(scene); ++i) {
        const SurfacePoint point = MiddleOf(scene, i);
        const Frame frame(point.geometric_normal);
        for (const Vec3 tangent : {frame.s, frame.t, Normalize(frame.s - frame.t)}) {
          const NormalCurvature found = curvature.Along(point, tangent);
          // Normals are rounded to 6e-8, and the sides are 1.2 / cells or a third of it long.
          ASSERT_NEAR(found.curvature * radius, 1, 1e-6 * cells) << radius << " " << cells;
          // The rounding of the normals is not taken for a gradient.
          ASSERT_EQ(found.gradient, 0);
        }
        ASSERT_NEAR(curvature.SquaredPrincipals(point) * radius * radius, 2, 1e-5 * cells);
      }
    }
  }
}

TEST(SurfaceCurvatureTest, OfACylinderIsRoundOneWayAndStraightTheOther) {
  constexpr double kRadius = 0.25;
  const Surface cylinder = [](double angle, double z) {
    return Vertex{{kRadius * std::cos(angle), kRadius * std::sin(angle), z},
                  {std::cos(angle), std::sin(angle), 0}};
  };
  // Long thin triangles: 20 times as long as wide.
  const Scene scene = SceneOf(Tessellate(cylinder, {0, 2 * pi}, {0, 4}, 64, 8));
  const SurfaceCurvature curvature(scene, Any);
  for (std::uint32_t i = 0; i < TriangleCount(scene); ++i) {
    const SurfacePoint point = MiddleOf(scene, i);
    const Vec3 axis = {0, 0, 1};
    const Vec3 around = Cross(axis, point.geometric_normal);
    ASSERT_NEAR(curvature.Along(point, axis).curvature, 0, 1e-4);
    ASSERT_NEAR(curvature.Along(point, around).curvature, 4, 1e-4);
    ASSERT_NEAR(curvature.Along(point, Normalize(axis + around)).curvature, 2, 1e-4);
    // Along the normal there is no tangent: the mean.
    ASSERT_NEAR(curvature.Along(point, point.geometric_normal).curvature, 2, 1e-4);
    ASSERT_NEAR(curvature.SquaredPrincipals(point), 16, 1e-3);
  }
}

TEST(SurfaceCurvatureTest, OfANeedleIsNotTheRoundingOfItsNormals) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0.5F, 1e-5F, 0}};
  mesh.normals = {{0, 0, 1}, {0, 0, 1}, {0, 1e-6F, 1}};
  mesh.indices = {0, 1, 2};
  const Scene scene = SceneOf(mesh);
  const SurfaceCurvature curvature(scene, Any);
  EXPECT_LT(std::abs(curvature.Along(MiddleOf(scene, 0), {0, 1, 0}).curvature), 0.005);
}

TEST(SurfaceCurvatureTest, OfASaddleHasBothSigns) {
  const Scene scene = SceneOf(Tessellate(HeightField([](double x, double y) {
                                           return std::array{1.5 * (x * x - y * y), 3 * x, -3 * y};
                                         }),
                                         {-0.01, 0.01}, {-0.01, 0.01}, 4, 4));
  const SurfaceCurvature curvature(scene, Any);
  const SurfacePoint point = MiddleOf(scene, 10);
  EXPECT_NEAR(curvature.Along(point, {1, 0, 0}).curvature, -3, 0.01);  // hollow, seen from above
  EXPECT_NEAR(curvature.Along(point, {0, 1, 0}).curvature, 3, 0.01);
  EXPECT_NEAR(curvature.Along(point, Normalize({1, 1, 0})).curvature, 0, 0.01);
}

// The largest error of the curvature of a torus, at the middles of its triangles.
double TorusError(std::uint32_t cells) {
  const Surface torus = [](double major, double minor) {
    const double c = std::cos(minor), s = std::sin(minor);
    return Vertex{{(2 + c) * std::cos(major), (2 + c) * std::sin(major), s},
                  {c * std::cos(major), c * std::sin(major), s}};
  };
  const Scene scene = SceneOf(Tessellate(torus, {0, 2 * pi}, {0, 2 * pi}, 2 * cells, cells));
  const SurfaceCurvature curvature(scene, Any);
  double error = 0;
  for (std::uint32_t i = 0; i < TriangleCount(scene); ++i) {
    const SurfacePoint point = MiddleOf(scene, i);
    const double from_axis = std::hypot(point.position.x, point.position.y);
    const double cosine = std::cos(std::atan2(point.position.z, from_axis - 2));
    const Vec3 around = Normalize(Cross({0, 0, 1}, point.position));
    const Vec3 across = Cross(point.geometric_normal, around);
    error =
        std::max({error, std::abs(curvature.Along(point, around).curvature - cosine / (2 + cosine)),
                  std::abs(curvature.Along(point, across).curvature - 1.0)});
  }
  return error;
}

TEST(SurfaceCurvatureTest, ErrorOfATorusFallsWithTheLengthOfItsSides) {
  const double coarse = TorusError(32);
  const double fine = TorusError(128);
  EXPECT_LT(coarse, 0.12);
  EXPECT_LT(fine, coarse / 3.5);
}

// z = A sin(k x): curvature by arc length and its derivatives, from differences in double.
constexpr double kWaveHeight = 0.02;
constexpr double kWaveNumber = 12;

double WaveCurvature(double x) {
  const double slope = kWaveHeight * kWaveNumber * std::cos(kWaveNumber * x);
  return kWaveHeight * kWaveNumber * kWaveNumber * std::sin(kWaveNumber * x) /
         std::pow(1 + slope * slope, 1.5);
}
double PerArc(double x, const std::function<double(double)>& value) {
  constexpr double kStep = 1e-4;
  const double slope = kWaveHeight * kWaveNumber * std::cos(kWaveNumber * x);
  return (value(x + kStep) - value(x - kStep)) / (2 * kStep) / std::sqrt(1 + slope * slope);
}
double WaveGradient(double x) {
  return PerArc(x, WaveCurvature);
}
double WaveSecondGradient(double x) {
  return PerArc(x, WaveGradient);
}

const Surface& Wave() {
  static const Surface wave = HeightField([](double x, double) {
    return std::array{kWaveHeight * std::sin(kWaveNumber * x),
                      kWaveHeight * kWaveNumber * std::cos(kWaveNumber * x), 0.0};
  });
  return wave;
}

TEST(SurfaceCurvatureTest, OfAWaveIsAnalyticAndItsGradientsAreBounds) {
  for (const std::uint32_t cells : {50U, 200U}) {  // 26 and 105 to a wave
    const Scene scene = SceneOf(Tessellate(Wave(), {0, 1}, {0, 0.2}, cells, cells / 5));
    const SurfaceCurvature curvature(scene, Any);
    double largest_gradient = 0;
    for (std::uint32_t i = 0; i < TriangleCount(scene); ++i) {
      const SurfacePoint point = MiddleOf(scene, i);
      const double x = point.position.x;
      if (x < 0.05 || x > 0.95) continue;  // half of the ring is missing
      const NormalCurvature found = curvature.Along(point, {1, 0, 0});
      ASSERT_NEAR(found.curvature, WaveCurvature(x), 12.0 / cells) << x;
      ASSERT_NEAR(curvature.Along(point, {0, 1, 0}).curvature, 0, 0.02) << x;
      ASSERT_GE(found.gradient, 0.98 * std::abs(WaveGradient(x))) << x;
      ASSERT_GE(found.second_gradient, 0.98 * std::abs(WaveSecondGradient(x))) << x;
      largest_gradient = std::max(largest_gradient, static_cast<double>(found.gradient));
    }
    // A bound that is of use: A k³ is 34.6.
    EXPECT_LT(largest_gradient, 2 * kWaveHeight * std::pow(kWaveNumber, 3)) << cells;
  }
}

// What a mesh says of its gradients, over what they are.
struct Ratios {
  double least = 1e30, most = 0;

  // `here` at the middle of the triangle, `nearby` the largest in its surroundings, `anywhere`.
  void Add(double found, double here, double nearby, double anywhere) {
    most = std::max(most, found / nearby);
    if (here < 0.2 * anywhere) return;  // near a zero only the surroundings count
    least = std::min(least, found / here);
  }
};

// A function over [0, 1), repeated, and the largest of it around each place.
class Periodic {
 public:
  Periodic(const std::function<double(double)>& value, double reach) {
    constexpr int kCount = 1000;
    std::vector<double> values;
    for (int i = 0; i < kCount; ++i)
      values.push_back(std::abs(value(static_cast<double>(i) / kCount)));
    const int steps = static_cast<int>(reach * kCount);
    for (int i = 0; i < kCount; ++i) {
      double largest = 0;
      for (int j = i - steps; j <= i + steps; ++j)
        largest = std::max(largest, values[static_cast<std::size_t>((j + kCount) % kCount)]);
      nearby_.push_back(largest);
    }
    here_ = values;
    anywhere_ = *std::max_element(values.begin(), values.end());
  }
  void Compare(double found, double x, Ratios& ratios) const {
    const auto at = static_cast<std::size_t>((x - std::floor(x)) * 999.999);
    ratios.Add(found, here_[at], nearby_[at], anywhere_);
  }

 private:
  std::vector<double> here_, nearby_;
  double anywhere_ = 0;
};

struct BothRatios {
  Ratios first, second;
};

// Of z = A sin(2 pi x) with A k = 0.2, by arc length, away from the border. `jitter` [edges] moves
// vertices over the surface, `noise` turns the normals, `shift` moves the mesh. `rows` 0: many.
BothRatios RatiosOnAWave(std::uint32_t edges_per_wave, double jitter, float noise, float shift,
                         std::uint32_t rows = 0) {
  constexpr double k = 2 * pi;
  constexpr double kSteepness = 0.2;
  const auto arc = [](double x) { return std::hypot(1, kSteepness * std::cos(k * x)); };
  const auto curvature_at = [&](double x) {
    return kSteepness * k * std::sin(k * x) / std::pow(arc(x), 3);
  };
  constexpr double kStep = 1e-4;
  const auto first_at = [&](double x) {
    return (curvature_at(x + kStep) - curvature_at(x - kStep)) / (2 * kStep) / arc(x);
  };
  const auto second_at = [&](double x) {
    return (first_at(x + kStep) - first_at(x - kStep)) / (2 * kStep) / arc(x);
  };
  // Noise is left behind only by looking farther.
  const double reach = std::max(0.15, 4.0 / edges_per_wave);
  const Periodic first(first_at, reach);
  const Periodic second(second_at, reach);

  KeyedRng rng(11);
  const auto uniform = [&] { return 2 * rng.Uniform() - 1; };
  const Surface wave = HeightField([&](double x, double) {
    return std::array{kSteepness / k * std::sin(k * x), kSteepness * std::cos(k * x), 0.0};
  });
  const std::uint32_t columns = edges_per_wave * 3 / 2;
  const bool is_ribbon = rows > 0;
  if (!is_ribbon) rows = std::max(12U, edges_per_wave * 3 / 4);
  const double edge = 1.0 / edges_per_wave;
  TriangleMesh mesh = Tessellate(
      [&](double x, double y) {
        return wave(x + jitter * edge * static_cast<double>(uniform()),
                    y + jitter * edge * static_cast<double>(uniform()));
      },
      {0, columns * edge}, {0, rows * edge}, columns, rows);
  for (Vec3& n : mesh.normals)
    n = Normalize(n + Vec3{uniform(), uniform(), uniform()} * noise);
  for (Vec3& p : mesh.positions)
    p = p + Vec3{shift, shift, shift};

  const Scene scene = SceneOf(std::move(mesh));
  const SurfaceCurvature curvature(scene, Any);
  const double border = std::max(0.1, 4 * edge);
  BothRatios ratios;
  for (std::uint32_t i = 0; i < TriangleCount(scene); ++i) {
    const SurfacePoint point = MiddleOf(scene, i);
    const double x = static_cast<double>(point.position.x - shift);
    const double y = static_cast<double>(point.position.y - shift);
    if (x < border || x > columns * edge - border) continue;
    if (!is_ribbon && (y < border || y > rows * edge - border)) continue;
    const NormalCurvature found = curvature.Along(point, {1, 0, 0});
    first.Compare(static_cast<double>(found.gradient), x, ratios.first);
    second.Compare(static_cast<double>(found.second_gradient), x, ratios.second);
  }
  return ratios;
}

TEST(SurfaceCurvatureTest, GradientsOfAWaveDoNotGrowWithTheFinenessOfItsMesh) {
  for (const std::uint32_t edges_per_wave : {16U, 64U, 256U}) {
    for (const double jitter : {0.0, 0.3}) {
      const auto [first, second] = RatiosOnAWave(edges_per_wave, jitter, 0, 0);
      EXPECT_GE(first.least, 0.9) << edges_per_wave << " " << jitter;
      EXPECT_LE(first.most, 1.3) << edges_per_wave << " " << jitter;
      EXPECT_GE(second.least, 0.9) << edges_per_wave << " " << jitter;
      EXPECT_LE(second.most, 1.5) << edges_per_wave << " " << jitter;
    }
  }
}

// Not even where there are few: a wave of eight edges is hardly one.
TEST(SurfaceCurvatureTest, GradientsOfACoarseWaveAreNotBlurred) {
  for (const double jitter : {0.0, 0.3}) {
    const auto [first, second] = RatiosOnAWave(8, jitter, 0, 0);
    EXPECT_GE(first.least, 0.85) << jitter;
    EXPECT_GE(second.least, 0.85) << jitter;
  }
}

// Normals as a text file with six digits has them.
TEST(SurfaceCurvatureTest, NoiseOfTheNormalsIsNotTakenForGradients) {
  for (const std::uint32_t edges_per_wave : {16U, 64U, 256U}) {
    for (const double jitter : {0.0, 0.3}) {
      const auto [first, second] = RatiosOnAWave(edges_per_wave, jitter, 1e-6F, 0);
      EXPECT_GE(first.least, 0.9) << edges_per_wave << " " << jitter;
      EXPECT_LE(first.most, 1.3) << edges_per_wave << " " << jitter;
      EXPECT_GE(second.least, 0.9) << edges_per_wave << " " << jitter;
      EXPECT_LE(second.most, 1.6) << edges_per_wave << " " << jitter;
    }
  }
}

// Positions on a grid of 6e-5, at the finest 1/64 of an edge.
TEST(SurfaceCurvatureTest, RoundingOfThePositionsIsNotTakenForGradients) {
  for (const std::uint32_t edges_per_wave : {16U, 64U, 256U}) {
    for (const double jitter : {0.0, 0.3}) {
      const auto [first, second] = RatiosOnAWave(edges_per_wave, jitter, 0, 1000);
      EXPECT_GE(first.least, 0.9) << edges_per_wave << " " << jitter;
      EXPECT_LE(first.most, 1.3) << edges_per_wave << " " << jitter;
      EXPECT_GE(second.least, 0.9) << edges_per_wave << " " << jitter;
      EXPECT_LE(second.most, 1.6) << edges_per_wave << " " << jitter;
    }
  }
}

// One row of cells has no y², and its xy² is not for the rounding of y to tell.
TEST(SurfaceCurvatureTest, OfARibbonTheGradientsLengthwiseAreKnown) {
  for (const std::uint32_t rows : {1U, 2U, 3U}) {
    for (const double jitter : {0.0, 0.02}) {
      const auto [first, second] = RatiosOnAWave(64, jitter, 0, 0, rows);
      EXPECT_GE(first.least, 0.9) << rows << " " << jitter;
      EXPECT_LE(first.most, 1.3) << rows << " " << jitter;
      EXPECT_GE(second.least, 0.9) << rows << " " << jitter;
      EXPECT_LE(second.most, 1.5) << rows << " " << jitter;
    }
  }
}

// An octahedron's faces cut into cells x cells triangles, blown up to a sphere.
TriangleMesh SubdividedOctahedron(double radius, std::uint32_t cells) {
  TriangleMesh mesh;
  for (int face = 0; face < 8; ++face) {
    const std::array<double, 3> sign = {face & 1 ? -1.0 : 1.0, face & 2 ? -1.0 : 1.0,
                                        face & 4 ? -1.0 : 1.0};
    std::vector<std::uint32_t> row_begin;
    for (std::uint32_t i = 0; i <= cells; ++i) {
      row_begin.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
      for (std::uint32_t j = 0; i + j <= cells; ++j) {
        std::array<double, 3> n = {sign[0] * i, sign[1] * j, sign[2] * (cells - i - j)};
        const double length = std::hypot(n[0], n[1], n[2]);
        for (double& c : n)
          c /= length;
        mesh.normals.push_back(ToVec3(n));
        mesh.positions.push_back(ToVec3({radius * n[0], radius * n[1], radius * n[2]}));
      }
    }
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      if (sign[0] * sign[1] * sign[2] < 0) std::swap(b, c);
      for (const std::uint32_t index : {a, b, c})
        mesh.indices.push_back(index);
    };
    for (std::uint32_t i = 0; i < cells; ++i) {
      for (std::uint32_t j = 0; i + j < cells; ++j) {
        const std::uint32_t here = row_begin[i] + j, next = row_begin[i + 1] + j;
        add(here, next, here + 1);
        if (i + j + 1 < cells) add(next, next + 1, here + 1);
      }
    }
  }
  return mesh;
}

TEST(SurfaceCurvatureTest, SpheresAndCylindersHaveNoGradientsWhereverTheyLie) {
  for (const double radius : {0.01, 1.0, 300.0}) {
    for (const std::uint32_t cells : {8U, 32U, 128U}) {
      const Surface cylinder = [radius](double angle, double z) {
        return Vertex{{radius * std::cos(angle), radius * std::sin(angle), radius * z},
                      {std::cos(angle), std::sin(angle), 0}};
      };
      // Poles included, where sides meet by the hundred.
      const std::array meshes = {
          Tessellate(SphereSurface(radius), {0, 2 * pi}, {-pi / 2, pi / 2}, 2 * cells, cells),
          SubdividedOctahedron(radius, cells),
          Tessellate(cylinder, {0, 2 * pi}, {0, 6}, 2 * cells, cells),
          // Sides 20 times as long as wide, at the finest.
          Tessellate(cylinder, {0, 2 * pi}, {0, 8}, 2 * cells, 8)};
      for (std::size_t which = 0; which < meshes.size(); ++which) {
        for (const double distance : {0.0, 1.0, 10.0}) {  // radii
          if (which == 3 && distance > 0) continue;
          TriangleMesh mesh = meshes[which];
          const auto moved = static_cast<float>(distance * radius);
          for (Vec3& p : mesh.positions)
            p = p + Vec3{moved, moved, moved};
          const Scene scene = SceneOf(std::move(mesh));
          const SurfaceCurvature curvature(scene, Any);
          double first = 0, second = 0;
          for (std::uint32_t i = 0; i < TriangleCount(scene); ++i) {
            const NormalCurvature found = curvature.Along(MiddleOf(scene, i), {1, 0, 0});
            first = std::max(first, static_cast<double>(found.gradient));
            second = std::max(second, static_cast<double>(found.second_gradient));
          }
          EXPECT_EQ(first, 0) << which << " " << radius << " " << cells << " " << distance;
          EXPECT_LE(second * std::pow(radius, 3), 2e-4)
              << which << " " << radius << " " << cells << " " << distance;
        }
      }
    }
  }
}

// A torus of radii 2 and 1, in the frame of its circles at the angle b of the minor one: with
// r = 2 + cos b, covariant derivatives of the second fundamental form, x around and y along b.
//   h_xx;y = -2 sin b / r²; all others of the first order follow from symmetry or are 0
//   h_xx;xx = 6 sin² b / r³, h_yy;xx = -4 sin² b / r³, h_xx;yy = -2 cos b / r² - 4 sin² b / r³
double TorusFirst(double b) {
  // 3 cos² t sin t h_xx;y, at its largest.
  return 2 / std::sqrt(3) * 2 * std::abs(std::sin(b)) / std::pow(2 + std::cos(b), 2);
}
double TorusSecond(double b) {
  const double r = 2 + std::cos(b), squared = std::pow(std::sin(b), 2) / std::pow(r, 3);
  const double xx_xx = 6 * squared, yy_xx = -4 * squared;
  const double xx_yy = -2 * std::cos(b) / (r * r) - 4 * squared;
  double largest = 0;
  for (int i = 0; i < 180; ++i) {
    const double c = std::cos(i * pi / 180), s = std::sin(i * pi / 180);
    const double along_x = xx_xx * c * c + xx_yy * s * s, along_y = yy_xx * c * c;
    const double mixed = (xx_yy + yy_xx) * c * s;
    largest = std::max(
        largest, 0.5 * (std::abs(along_x + along_y) + std::hypot(along_x - along_y, 2 * mixed)));
  }
  return largest;
}

TEST(SurfaceCurvatureTest, GradientsOfATorusAreItsOwn) {
  // Closed: a whole turn is none, to the bit.
  const Surface torus = [](double major, double minor) {
    if (major >= 2 * pi) major = 0;
    if (minor >= 2 * pi) minor = 0;
    const double c = std::cos(minor), s = std::sin(minor);
    return Vertex{{(2 + c) * std::cos(major), (2 + c) * std::sin(major), s},
                  {c * std::cos(major), c * std::sin(major), s}};
  };
  for (const std::uint32_t cells : {32U, 128U, 400U}) {
    const Scene scene = SceneOf(Tessellate(torus, {0, 2 * pi}, {0, 2 * pi}, 2 * cells, cells));
    const SurfaceCurvature curvature(scene, Any);
    const double reach = std::max(0.1, 4.0 / cells);
    const Periodic first([](double turn) { return TorusFirst(2 * pi * turn); }, reach);
    const Periodic second([](double turn) { return TorusSecond(2 * pi * turn); }, reach);
    BothRatios ratios;
    for (std::uint32_t i = 0; i < TriangleCount(scene); ++i) {
      const SurfacePoint point = MiddleOf(scene, i);
      const double turn =
          std::atan2(point.position.z, std::hypot(point.position.x, point.position.y) - 2) /
          (2 * pi);
      const NormalCurvature found = curvature.Along(point, {1, 0, 0});
      first.Compare(static_cast<double>(found.gradient), turn, ratios.first);
      second.Compare(static_cast<double>(found.second_gradient), turn, ratios.second);
    }
    EXPECT_GE(ratios.first.least, 1) << cells;
    EXPECT_LE(ratios.first.most, 1.3) << cells;
    EXPECT_GE(ratios.second.least, 1) << cells;
    EXPECT_LE(ratios.second.most, 1.3) << cells;
  }
}

TEST(SurfaceCurvatureTest, ScalesExactlyWithPowersOfTwo) {
  const TriangleMesh mesh = Tessellate(Wave(), {0, 1}, {0, 0.2}, 40, 8);
  const Scene scene = SceneOf(mesh);
  const SurfaceCurvature curvature(scene, Any);
  for (const int exponent : {-20, 7, 20}) {
    TriangleMesh scaled_mesh = mesh;
    for (Vec3& p : scaled_mesh.positions)
      p = p * std::ldexp(1.0F, exponent);
    const Scene scaled_scene = SceneOf(scaled_mesh);
    const SurfaceCurvature scaled(scaled_scene, Any);
    for (std::uint32_t i = 0; i < TriangleCount(scene); ++i) {
      const NormalCurvature one = curvature.Along(MiddleOf(scene, i), {0.6F, 0.8F, 0});
      const NormalCurvature other = scaled.Along(MiddleOf(scaled_scene, i), {0.6F, 0.8F, 0});
      ASSERT_EQ(std::ldexp(other.curvature, exponent), one.curvature);
      ASSERT_EQ(std::ldexp(other.gradient, 2 * exponent), one.gradient);
      ASSERT_EQ(std::ldexp(other.second_gradient, 3 * exponent), one.second_gradient);
    }
  }
}

TEST(SurfaceCurvatureTest, DoesNotCareHowVerticesAreShared) {
  const Scene shared = SceneOf(Tessellate(Wave(), {0, 1}, {0, 0.2}, 40, 8));
  TriangleMesh apart;
  for (const std::uint32_t index : shared.meshes[0].indices) {
    apart.indices.push_back(static_cast<std::uint32_t>(apart.positions.size()));
    apart.positions.push_back(shared.meshes[0].positions[index]);
    apart.normals.push_back(shared.meshes[0].normals[index]);
  }
  const Scene soup = SceneOf(apart);
  const SurfaceCurvature one(shared, Any);
  const SurfaceCurvature other(soup, Any);
  for (std::uint32_t i = 0; i < TriangleCount(shared); ++i) {
    const NormalCurvature a = one.Along(MiddleOf(shared, i), {1, 0, 0});
    const NormalCurvature b = other.Along(MiddleOf(soup, i), {1, 0, 0});
    ASSERT_EQ(a.curvature, b.curvature);
    ASSERT_GT(a.gradient, 0);
    ASSERT_NEAR(a.gradient, b.gradient, 1e-5F * a.gradient);
    ASSERT_NEAR(a.second_gradient, b.second_gradient, 1e-5F * a.second_gradient);
  }
}

TEST(SurfaceCurvatureTest, SeesNoGradientAcrossACrease) {
  // Half a cylinder, and a plane that leaves from it at an angle: bent and flat, edge to edge.
  TriangleMesh mesh = Tessellate(
      [](double angle, double y) {
        return Vertex{{std::sin(angle), y, std::cos(angle)}, {std::sin(angle), 0, std::cos(angle)}};
      },
      {-1, 0}, {0, 0.5}, 16, 8);
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  const TriangleMesh plane = Tessellate(
      [](double x, double y) {
        return Vertex{{x, y, 1 + x}, {-std::sqrt(0.5), 0, std::sqrt(0.5)}};
      },
      {0, 1}, {0, 0.5}, 16, 8);
  mesh.positions.insert(mesh.positions.end(), plane.positions.begin(), plane.positions.end());
  mesh.normals.insert(mesh.normals.end(), plane.normals.begin(), plane.normals.end());
  for (const std::uint32_t index : plane.indices)
    mesh.indices.push_back(first + index);
  const Scene scene = SceneOf(mesh);
  const SurfaceCurvature curvature(scene, Any);
  for (std::uint32_t i = 0; i < TriangleCount(scene); ++i) {
    ASSERT_LT(curvature.Along(MiddleOf(scene, i), {1, 0, 0}).gradient, 1e-2) << i;
  }
}

TEST(SurfaceCurvatureTest, IsNegativeWhenTheOutwardNormalPointsToTheHollow) {
  TriangleMesh mesh = Tessellate(SphereSurface(2), {0, 2 * pi}, {-1, 1}, 32, 16);
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    std::swap(mesh.indices[i], mesh.indices[i + 1]);
  }
  // By the winding alone: rays see the normals turned to the triangle's side.
  const Scene wound = SceneOf(mesh);
  for (Vec3& n : mesh.normals)
    n = -n;
  const Scene turned = SceneOf(mesh);
  for (const Scene* scene : {&wound, &turned}) {
    const SurfaceCurvature curvature(*scene, Any);
    const SurfacePoint point = MiddleOf(*scene, 100);
    const Frame frame(point.geometric_normal);
    EXPECT_NEAR(curvature.Along(point, frame.s).curvature, -0.5, 1e-4);
  }
}

TEST(SurfaceCurvatureTest, OfSpheresIsExactAndOfDisksAndFacetsZero) {
  Scene scene;
  const std::int32_t glass = AddMaterial(scene, DielectricMaterial(1.5F));
  AddBox(scene, {0, 0, 0}, {1, 1, 1}, glass);
  AddSphere(scene, {1, 2, 3}, 0.75F, glass);
  AddSphere(scene, {1, 2, 3}, 0.75F, glass, kNoAreaLight, /*inward=*/true);
  AddDisk(scene, {0, 0, 0}, {0, 0, 1}, 1, glass);
  const SurfaceCurvature curvature(scene, Any);
  SurfacePoint point;
  point.geometric_normal = {0, 0, 1};
  EXPECT_EQ(curvature.Along(point, {1, 0, 0}).curvature, 0);
  point.geometry = 1;
  EXPECT_EQ(curvature.Along(point, {1, 0, 0}).curvature, 1 / 0.75F);
  EXPECT_EQ(curvature.Along(point, {1, 0, 0}).gradient, 0);
  EXPECT_FLOAT_EQ(curvature.SquaredPrincipals(point), 2 / (0.75F * 0.75F));
  point.primitive = 1;
  EXPECT_EQ(curvature.Along(point, {1, 0, 0}).curvature, -1 / 0.75F);
  point.geometry = 2;
  point.primitive = 0;
  EXPECT_EQ(curvature.Along(point, {1, 0, 0}).curvature, 0);
  EXPECT_EQ(curvature.SquaredPrincipals(point), 0);
}

TEST(SurfaceCurvatureTest, OfAFlatMeshOrOneThatNobodyWantsIsZero) {
  const Scene flat = SceneOf(Tessellate(HeightField([](double x, double y) {
                                          return std::array{0.3 * x - 0.7 * y, 0.3, -0.7};
                                        }),
                                        {0, 1}, {0, 1}, 13, 7));
  const SurfaceCurvature of_flat(flat, Any);
  const Scene wave = SceneOf(Tessellate(Wave(), {0, 1}, {0, 1}, 13, 7));
  const SurfaceCurvature unwanted(
      wave, [](const Material& m) { return m.kind == Material::Kind::kConductor; });
  for (const auto& [scene, curvature] : {std::pair(&flat, &of_flat), std::pair(&wave, &unwanted)}) {
    for (std::uint32_t i = 0; i < TriangleCount(*scene); ++i) {
      const NormalCurvature found = curvature->Along(MiddleOf(*scene, i), {0, 1, 0});
      ASSERT_EQ(found.curvature, 0);
      ASSERT_EQ(found.gradient, 0);
      ASSERT_EQ(found.second_gradient, 0);
    }
  }
}

TEST(SurfaceCurvatureTest, StaysFiniteAndClampedOnBrokenMeshes) {
  KeyedRng rng(7);
  const auto coordinate = [&] { return 2 * rng.Uniform() - 1; };
  for (int round = 0; round < 300; ++round) {
    TriangleMesh mesh;
    const float scale = std::ldexp(1.0F, static_cast<int>(rng.Uniform() * 200) - 110);
    for (int i = 0; i < 12; ++i) {
      // Needles, repeated points, points on one line, and far from the origin.
      Vec3 p = {coordinate(), coordinate(), coordinate()};
      if (i % 4 == 1) p = {p.x, 1e-6F * p.y, 0};
      if (i % 5 == 2) p = mesh.positions[0];
      if (round % 3 == 0) p = p * 1e-4F + Vec3{1, 1, 1};
      mesh.positions.push_back(p * scale);
      const Vec3 n = {coordinate(), coordinate(), coordinate()};
      mesh.normals.push_back(i % 7 == 3 ? Vec3{} : Normalize(n));
    }
    for (int i = 0; i < 60; ++i) {
      mesh.indices.push_back(static_cast<std::uint32_t>(rng.Uniform() * 12));
    }
    const Scene scene = SceneOf(mesh);
    const SurfaceCurvature curvature(scene, Any);
    for (std::uint32_t i = 0; i < TriangleCount(scene); ++i) {
      SurfacePoint point;
      point.geometric_normal = Normalize({coordinate(), coordinate(), coordinate()});
      point.primitive = i;
      const Vec3 tangent = i % 3 == 0 ? point.geometric_normal : Frame(point.geometric_normal).s;
      const NormalCurvature found = curvature.Along(point, tangent);
      ASSERT_TRUE(std::isfinite(found.curvature) && std::isfinite(found.gradient) &&
                  std::isfinite(found.second_gradient) &&
                  std::isfinite(curvature.SquaredPrincipals(point)));
      ASSERT_GE(found.gradient, 0);
      ASSERT_GE(found.second_gradient, 0);
      // Sides are no longer than 4 scale, and the tangent here is any: the tensor's own norm.
      const Vec3 p0 = mesh.positions[mesh.indices[3 * i]];
      if (MaxAbs(p0) > 0) {
        ASSERT_LE(std::abs(found.curvature), 2.0 * 0.1 / (kClearance * double{MaxAbs(p0)}));
      }
    }
  }
}

}  // namespace
}  // namespace lucerna
