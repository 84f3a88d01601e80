// A textured surface has at each point the material that its texture says, in the working space,
// and photons take the texture's detail along.
#include "render/transport/material_at.h"

#include <cmath>
#include <memory>
#include <optional>

#include "gtest/gtest.h"

#include "render/frequency/spectrum.h"
#include "render/math/color_space.h"
#include "render/transport/bsdf.h"
#include "render/transport/light.h"
#include "tests/support/test_scenes.h"
#include "worker/photon_spectrum.h"

namespace lucerna {
namespace {

constexpr Rgb kOrange = {0.9F, 0.4F, 0.1F};

// A floor of 4 x 4 whose texture is a board of 2 x 2 squares: orange and black.
struct Floor {
  explicit Floor(const Material& material) {
    Texture orange;
    orange.color = kOrange;
    const Texture black;
    Texture board;
    board.kind = Texture::Kind::kCheckerboard;
    board.parts = {0, 1, -1, -1};
    board.mapping.scale_u = board.mapping.scale_v = 2;
    scene.textures = {orange, black, board};
    AddQuad(scene, {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, AddMaterial(scene, material));
    scene.meshes[0].uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    scene.point_lights.push_back({{0, 0, 2}, Gray(1)});
    intersector = Intersector::Create(scene).value();
  }
  [[nodiscard]] SurfacePoint At(float x, float y) const {
    const Ray ray = {{x, y, 1}, {0, 0, -1}, HUGE_VALF};
    Hit hit;
    EXPECT_TRUE(intersector->Intersect(ray, hit));
    return intersector->SurfaceAt(ray, hit);
  }
  [[nodiscard]] const Material& MaterialOf(float x, float y,
                                           std::optional<Material>& storage) const {
    SurfacePoint point = At(x, y);
    return MaterialAt(scene, point, {0, 0, 1}, storage);
  }

  Scene scene;
  std::unique_ptr<Intersector> intersector;
};

Material Textured(Material material) {
  material.texture = 2;
  return material;
}

TEST(MaterialAtTest, DiffuseSurfacesHaveTheTexturesColour) {
  const Floor floor(Textured(DiffuseMaterial(0.5F)));
  std::optional<Material> storage;
  EXPECT_EQ(floor.MaterialOf(-1, -0.5F, storage).reflectance, ToWorking(kOrange));
  EXPECT_EQ(floor.MaterialOf(1, 1.5F, storage).reflectance, ToWorking(kOrange));
  EXPECT_EQ(floor.MaterialOf(1, -0.5F, storage).reflectance, Rgb{});
  EXPECT_TRUE(Gathers(floor.MaterialOf(1, 1, storage)));
  EXPECT_FALSE(Gathers(floor.MaterialOf(1, -1, storage)));
}

TEST(MaterialAtTest, MetalsReflectTheTexturesColourAtRightAnglesAndAreNotGatheredOn) {
  const Floor floor(Textured(ConductorMaterial(Gray(1), Gray(1), 0.4F, 0.3F)));
  std::optional<Material> storage;
  const Material& metal = floor.MaterialOf(-1, -0.5F, storage);
  const Rgb expected = ToWorking(kOrange);
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(AlbedoOf(metal)[c], expected[c], 1e-5) << c;
  EXPECT_EQ(metal.alpha_u, 0.4F);
  EXPECT_EQ(metal.alpha_v, 0.3F);
  EXPECT_FALSE(Gathers(metal));
  EXPECT_FALSE(Gathers(floor.scene.materials[0]));
}

TEST(MaterialAtTest, WithoutATextureItIsTheScenesOwn) {
  const Floor floor(DiffuseMaterial(0.5F));
  std::optional<Material> storage;
  EXPECT_EQ(&floor.MaterialOf(0, 0, storage), &floor.scene.materials[0]);
  EXPECT_FALSE(storage.has_value());
}

// What arrives far behind a diffuse bounce, with the texture and without.
double TraceAfterBounce(const Floor& floor, float distance) {
  const LightSet lights(floor.scene, *floor.intersector);
  RenderSettings settings;
  settings.width = settings.height = 64;
  settings.initial_radius = 0.01;
  settings.radius_controller = RadiusControllerKind::kFrequency;
  const auto tracer = SpectrumTracer::Create(floor.scene, settings, NeedsOf(floor.scene, settings),
                                             *floor.intersector, lights)
                          .value();
  Emission emission;
  emission.ray = {{0, 0, 2}, Normalize({-0.3F, -0.3F, -1}), HUGE_VALF};
  auto carried = tracer->Leave(emission);
  Hit hit;
  EXPECT_TRUE(floor.intersector->Intersect(emission.ray, hit));
  SurfacePoint surface = floor.intersector->SurfaceAt(emission.ray, hit);
  tracer->Fly(carried, emission.ray, hit.t, SpectrumTracer::Shadows::kFound);
  std::optional<Material> storage;
  const Vec3 wi = {0, 0, 1};
  const Vec3 wo = -emission.ray.direction;
  const Material& material = MaterialAt(floor.scene, surface, wo, storage);
  tracer->Scatter(carried, surface, material, wo, wi);
  tracer->Fly(carried, {surface.position, wi, HUGE_VALF}, distance,
              SpectrumTracer::Shadows::kFound);
  SurfacePoint ceiling = surface;
  ceiling.shading_normal = ceiling.geometric_normal = -wi;
  return static_cast<double>(tracer->Received(carried, ceiling, DiffuseMaterial(0.5F), -wi));
}

TEST(MaterialAtTest, FrequencyPhotonsCarryTheTexturesDetail) {
  const Floor textured(Textured(DiffuseMaterial(0.5F)));
  const Floor plain(DiffuseMaterial(0.5F));
  // The board: 8 pixels a square, 2 squares over 4 metres, so slopes of 1/4 per metre.
  const TextureDetail detail = TextureDetails(textured.scene.textures)[2];
  const double per_m2 = (detail.u + detail.v) / 16;
  EXPECT_GT(per_m2, 1);
  const SpectrumLimits limits =
      SpectrumLimits::ForDiagonal(static_cast<double>(textured.intersector->bounds().Diagonal()));
  for (const float distance : {0.1F, 1.0F, 4.0F}) {
    const auto distance_m = static_cast<double>(distance);
    const auto expected = [&](double texture_detail) {
      // Of the point light, at the angle of its photon.
      const double leg2 = 4 * (1 + 2 * 0.09);
      const double cosine = 1 / std::sqrt(1 + 2 * 0.09);
      const double trace =
          ReceivedTrace(Travel(PointSource(limits), std::sqrt(leg2), limits), cosine, 0, 0, limits);
      const Spectrum left =
          LeaveDiffuse(ScatterDiffusely(trace, texture_detail, limits), distance_m, limits);
      return ReceivedTrace(Travel(left, distance_m, limits), 1, 0, 0, limits);
    };
    EXPECT_NEAR(TraceAfterBounce(textured, distance) / expected(per_m2), 1, 1e-3) << distance;
    EXPECT_NEAR(TraceAfterBounce(plain, distance) / expected(0), 1, 1e-3) << distance;
  }
  // Nearer than that, the end of the floor is taken to be as near as the next surface.
  EXPECT_GT(TraceAfterBounce(textured, 4), 1.02 * TraceAfterBounce(plain, 4));
}

}  // namespace
}  // namespace lucerna
