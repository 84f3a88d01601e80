// What a scene takes is counted, each thing once, and edges are those that are found.
#include "render/analysis/scene_memory.h"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/geometry/feature_edges.h"
#include "render/math/transform.h"
#include "render/scene/density_grid.h"
#include "tests/support/measured_file.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

constexpr RayNeeds kRays;

// A flat grid of side x side squares.
TriangleMesh Grid(std::uint32_t side) {
  TriangleMesh mesh;
  mesh.traits.material = 0;
  for (std::uint32_t y = 0; y <= side; ++y) {
    for (std::uint32_t x = 0; x <= side; ++x)
      mesh.positions.push_back({static_cast<float>(x), static_cast<float>(y), 0});
  }
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const std::uint32_t a = y * (side + 1) + x;
      mesh.indices.insert(mesh.indices.end(),
                          {a, a + 1, a + side + 2, a, a + side + 2, a + side + 1});
    }
  }
  return mesh;
}

// The same triangles, each with corners of its own, apart from each other.
TriangleMesh Loose(const TriangleMesh& mesh) {
  TriangleMesh loose;
  loose.traits = mesh.traits;
  for (const std::uint32_t index : mesh.indices) {
    const auto corner = static_cast<std::uint32_t>(loose.positions.size());
    loose.positions.push_back(mesh.positions[index] + Vec3{0, 0, static_cast<float>(corner / 3)});
    loose.indices.push_back(corner);
  }
  return loose;
}

Scene With(TriangleMesh mesh) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  scene.meshes.push_back(std::move(mesh));
  return scene;
}

// One for each index and phase function.
TEST(SceneMemoryTest, CountsTablesOfSubsurface) {
  const auto tables = [](const std::vector<float>& indices) {
    Scene scene = With(Grid(2));
    for (const float ior : indices) {
      Material material = DiffuseMaterial(0.5F);
      material.kind = Material::Kind::kSubsurface;
      material.ior = ior;
      AddMaterial(scene, material);
    }
    const SceneMemory memory = SceneMemoryOf(scene, kRays);
    SceneMemory without = memory;
    without.tables = 0;
    EXPECT_NEAR(memory.PeakOfWorker() - without.PeakOfWorker(), 1.1 * memory.tables, 1);
    EXPECT_NEAR(memory.PeakOfCoordinator() - without.PeakOfCoordinator(), 1.1 * memory.tables, 1);
    EXPECT_NEAR(memory.KeptByCoordinator() - without.KeptByCoordinator(), memory.tables, 1);
    return memory.tables;
  };
  EXPECT_EQ(tables({}), 0);
  EXPECT_NEAR(tables({1.3F}), 110e3, 2e3);
  EXPECT_EQ(tables({1.3F, 1.4F, 1.3F}), 2 * tables({1.3F}));
}

TEST(SceneMemoryTest, CountsTheDensitiesOfMedia) {
  Scene scene;
  scene.media.resize(2);
  const double without = SceneMemoryOf(scene, kRays).textures;
  scene.media[1].density =
      std::make_shared<const DensityGrid>(std::array<int, 3>{8, 8, 8}, std::vector<float>(512, 1),
                                          Vec3{0, 0, 0}, Vec3{1, 1, 1}, Transform());
  EXPECT_EQ(SceneMemoryOf(scene, kRays).textures - without, 10 * 10 * 10 * sizeof(float));
}

TEST(SceneMemoryTest, CountsTheEdgesThatAreFound) {
  constexpr double kSegment = 52;
  for (const std::uint32_t side : {100U, 200U}) {
    for (const bool is_loose : {false, true}) {
      SCOPED_TRACE(testing::Message() << side << " " << is_loose);
      const TriangleMesh grid = Grid(side);
      const Scene scene = With(is_loose ? Loose(grid) : grid);
      const auto found = static_cast<double>(FeatureEdges(scene).segments().size());
      EXPECT_EQ(found, is_loose ? 6.0 * side * side : 4.0 * side);
      // Euler's characteristic of a grid is 1, for which two edges more are counted.
      const double predicted = SceneMemoryOf(scene, kRays).edges;
      EXPECT_EQ(predicted, kSegment * (is_loose ? found : found + 2));
    }
  }
}

TEST(SceneMemoryTest, OnlyMeshesWithFacetsHaveBends) {
  TriangleMesh grid = Grid(100);
  EXPECT_EQ(SceneMemoryOf(With(grid), kRays).bends, 4 * 2 * 100 * 100);
  grid.normals.assign(grid.positions.size(), Vec3{0, 0, 1});
  EXPECT_EQ(SceneMemoryOf(With(grid), kRays).bends, 4 * 2 * 100 * 100) << "flat normals are facets";
  for (std::size_t i = 0; i < grid.normals.size(); ++i)
    grid.normals[i] = Normalize({grid.positions[i].x, grid.positions[i].y, 100});
  const SceneMemory with_normals = SceneMemoryOf(With(grid), kRays);
  EXPECT_EQ(with_normals.bends, 0);
  EXPECT_EQ(with_normals.building_bends, 0);
}

TEST(SceneMemoryTest, GrowsWithTheTriangles) {
  const SceneMemory small = SceneMemoryOf(With(Grid(100)), kRays);
  const SceneMemory large = SceneMemoryOf(With(Grid(200)), kRays);
  // Fourfold, but for what each mesh takes and for the vertices of the rim.
  EXPECT_NEAR(large.PeakOfCoordinator() / small.PeakOfCoordinator(), 4, 0.05);
  EXPECT_NEAR(large.acceleration / small.acceleration, 4, 0.05);
  EXPECT_GT(SceneMemoryOf(With(Grid(100)), {.split_triangles = true}).acceleration,
            small.acceleration);
  EXPECT_GE(small.PeakOfCoordinator(), small.KeptByCoordinator());
}

TEST(SceneMemoryTest, AnInstanceTakesNoMemoryOfItsMesh) {
  Scene scene = With(Grid(1));
  scene.object_meshes.push_back(Grid(200));
  InstancedObject object;
  object.mesh_count = 1;
  scene.objects.push_back(object);
  const SceneMemory none = SceneMemoryOf(scene, kRays);
  scene.instances.resize(1000);
  const SceneMemory many = SceneMemoryOf(scene, kRays);
  EXPECT_EQ(many.instances, 430'000);
  EXPECT_EQ(many.acceleration, none.acceleration + many.instances);
  EXPECT_EQ(many.edges, none.edges) << "discs are not cut at edges of instances";
  EXPECT_LT(many.shapes - none.shapes, 1000.0 * 256);
}

TEST(SceneMemoryTest, APictureCountsOnceHoweverManyTexturesShowIt) {
  Scene scene = With(Grid(1));
  const auto picture = std::make_shared<Picture>();
  picture->width = picture->height = 1024;
  picture->coded.resize(3 << 20);
  Texture texture;
  texture.kind = Texture::Kind::kPicture;
  texture.picture = picture;
  scene.textures.assign(5, texture);
  InfiniteLight sky;
  sky.map = picture;
  scene.infinite_lights.push_back(sky);
  EXPECT_EQ(SceneMemoryOf(scene, kRays).textures, (3 << 20) + sizeof(Picture));
}

// The picture, and the distribution of places on each of its triangles.
TEST(SceneMemoryTest, CountsPicturesOfLights) {
  Scene scene;
  const std::int32_t white = AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, white, AddAreaLight(scene, 1));
  const SceneMemory even = SceneMemoryOf(scene, kRays);
  Picture picture;
  picture.width = picture.height = 100;
  picture.linear.resize(3 * 100 * 100);
  scene.area_lights[0].picture = std::make_shared<const Picture>(std::move(picture));
  const SceneMemory shown = SceneMemoryOf(scene, kRays);
  EXPECT_GE(shown.textures - even.textures, 3 * 100 * 100 * sizeof(float));
  // 256 x 256 cells of four bytes.
  EXPECT_NEAR(shown.lights - even.lights, 2 * 4 * 256 * 256, 2 * 1024);
}

TEST(SceneMemoryTest, AMeasuredSurfaceCountsOnceHoweverManyMaterialsHaveIt) {
  Scene scene = With(Grid(1));
  const Material material = MeasuredMaterial(MeasureMetal({}));
  AddMaterial(scene, material);
  AddMaterial(scene, material);
  const std::size_t values = 8 * 7 * 32 * 32;  // [thetas × (wavelengths + 3) × knots]
  EXPECT_EQ(SceneMemoryOf(scene, kRays).textures, material.measured->bytes());
  EXPECT_GT(material.measured->bytes(), values * sizeof(float));
}

TEST(SceneMemoryTest, SaysWhatIsStillToBeBuiltAndWhatToDo) {
  const SceneMemory memory = SceneMemoryOf(With(Grid(200)), kRays);
  const double peak = memory.PeakOfWorker();
  const auto beside = static_cast<std::uint64_t>(peak - memory.shapes) + 1;
  EXPECT_TRUE(CheckSceneFits(memory, peak, beside).ok());
  const Status refused = CheckSceneFits(memory, peak, beside - 2);
  EXPECT_TRUE(absl::IsResourceExhausted(refused));
  EXPECT_THAT(std::string(refused.message()),
              testing::AllOf(testing::HasSubstr("the scene takes about 0.0 GB"),
                             testing::HasSubstr("use a machine with more memory")));
}

}  // namespace
}  // namespace lucerna
