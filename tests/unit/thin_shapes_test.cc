// Nothing is gathered on thin shapes, and no light is lost there: the image is that of surfaces on
// which photons are gathered, and tubes are their meshes.
#include <cmath>
#include <numbers>

#include "gtest/gtest.h"

#include "render/analysis/needs.h"
#include "tests/support/local_render.h"
#include "tests/support/measure.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

void ExpectSameMean(const Scene& one, const Scene& other, const RenderSettings& settings) {
  const MeasuredMean a = Measure(one, settings, 12, 8, "G");
  const MeasuredMean b = Measure(other, settings, 12, 8, "G");
  EXPECT_LT(std::abs(a.mean - b.mean),
            StudentQuantile(1e-4, 8) * std::hypot(a.standard_error, b.standard_error))
      << a.mean << " " << b.mean;
  // Else the test says nothing.
  EXPECT_LT(std::hypot(a.standard_error, b.standard_error), 0.01 * a.mean);
}

// A room with a ball, half of whose light comes by the walls.
Scene Room(bool is_thin) {
  Scene scene;
  const std::int32_t wall = AddMaterial(scene, DiffuseMaterial(0.7F));
  Material material = DiffuseMaterial(0.6F);
  material.is_on_thin_shapes = is_thin;
  const std::int32_t ball = AddMaterial(scene, material);
  AddBox(scene, {-1, -1, -1}, {1, 1, 1}, wall);
  AddDisk(scene, {0, 0, 0.98F}, {0, 0, -1}, 0.3F, wall, AddAreaLight(scene, 5));
  AddSphere(scene, {0, 0.2F, -0.3F}, 0.6F, ball);
  SetCamera(scene, {0, -0.95, 0.2}, {0, 0.2, -0.3}, {0, 0, 1}, 70, 16);
  return scene;
}

TEST(ThinShapesTest, NoLightIsLostWhereNothingIsGathered) {
  const Scene gathered = Room(false);
  const Scene thin = Room(true);
  // Small discs, so that the ball's curvature is no bias.
  const RenderSettings settings = TestSettings(gathered, 4000, 0.1, 30);
  EXPECT_TRUE(NeedsOf(thin, settings).Uses(Part::kSpecular));
  ExpectSameMean(gathered, thin, settings);
}

// A cone with round ends, as a piece and as a mesh of the same material.
TEST(ThinShapesTest, ATubeIsItsMesh) {
  Scene piece_scene;
  const std::int32_t floor = AddMaterial(piece_scene, DiffuseMaterial(0.5F));
  Material material = DiffuseMaterial(0.8F);
  material.is_on_thin_shapes = true;
  const std::int32_t thin = AddMaterial(piece_scene, material);
  AddQuad(piece_scene, {-2, -2, -1}, {4, 0, 0}, {0, 4, 0}, floor);
  AddDisk(piece_scene, {0, -1, 2}, {0, 0, -1}, 0.7F, floor, AddAreaLight(piece_scene, 5));
  SetCamera(piece_scene, {0, -4, 1}, {0, 0, 0}, {0, 0, 1}, 40, 16);
  Scene mesh_scene = piece_scene;

  CurvePiece piece;
  piece.from = {-0.8F, 0, 0};
  piece.to = {0.8F, 0, 0};
  piece.from_radius = 0.5F;
  piece.to_radius = 0.2F;
  piece.traits.material = thin;
  piece_scene.curve_pieces = {piece};

  // The profile: a cap, the touching cone, a cap; its normals run over half a turn.
  TriangleMesh mesh;
  mesh.traits.material = thin;
  constexpr int kAround = 64;
  constexpr int kCap = 24;
  const double pi = std::numbers::pi;
  const double cone = std::asin(0.3 / 1.6);    // of the cone's normals towards +x
  std::vector<std::array<double, 2>> profile;  // angle of the normal from -x, and which end
  for (int i = 0; i <= kCap; ++i)
    profile.push_back({(pi / 2 + cone) * i / kCap, 0});
  for (int i = 0; i <= kCap; ++i)
    profile.push_back({pi / 2 + cone + (pi / 2 - cone) * i / kCap, 1});
  for (const auto& [angle, end] : profile) {
    const double radius = end == 0 ? 0.5 : 0.2;
    for (int i = 0; i < kAround; ++i) {
      const double phi = 2 * pi * i / kAround;
      const Double3 normal = {-std::cos(angle), std::sin(angle) * std::cos(phi),
                              std::sin(angle) * std::sin(phi)};
      mesh.normals.push_back(ToFloat(normal));
      mesh.positions.push_back(ToFloat(Double3{end == 0 ? -0.8 : 0.8, 0, 0} + normal * radius));
    }
  }
  for (std::uint32_t ring = 0; ring + 1 < profile.size(); ++ring) {
    for (std::uint32_t i = 0; i < kAround; ++i) {
      const std::uint32_t a = ring * kAround + i;
      const std::uint32_t b = ring * kAround + (i + 1) % kAround;
      const auto add = [&](std::uint32_t p, std::uint32_t q, std::uint32_t r) {
        if (Length(TriangleCross(mesh.positions[p], mesh.positions[q], mesh.positions[r])) > 1e-9)
          mesh.indices.insert(mesh.indices.end(), {p, q, r});
      };
      add(a, a + kAround, b);
      add(b, a + kAround, b + kAround);
    }
  }
  mesh_scene.meshes.push_back(mesh);
  ExpectSameMean(piece_scene, mesh_scene, TestSettings(piece_scene, 2000, 0.1, 8));
}

}  // namespace
}  // namespace lucerna
