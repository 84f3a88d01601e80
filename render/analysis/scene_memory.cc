#include "render/analysis/scene_memory.h"

#include <algorithm>
#include <set>
#include <utility>

#include "absl/strings/str_format.h"

#include "render/geometry/bend_radii.h"
#include "render/scene/density_grid.h"
#include "render/scene/measured_table.h"
#include "render/scene/shape_lists.h"
#include "render/scene/subsurface_table.h"

namespace lucerna {
namespace {

// Bytes, measured (docs/measurements/scene-memory.md).

// Of a process over that of its blocks.
constexpr double kOfHeaps = 1.1;
// Of the C library for a block, of which a mesh has three or four.
constexpr double kAllocation = 16;
// Of Embree's tree, for a triangle or analytic shape, with copies of large ones that are split.
constexpr double kTreePrimitive = 62;
constexpr double kSplitTreePrimitive = 74;
constexpr double kTreeShape = 85;  // analytic
constexpr double kTreeMesh = 520;
constexpr double kTreeInstance = 430;
constexpr double kBuildingPrimitive = 36;  // beside the tree
// Of the set of lights, with the tree of those that are sampled, and while that is made.
constexpr double kEmitter = 320;
// Of an emitter that shows a picture: the distribution of places on it, with and without its cells,
// of which all emitters have so many (transport/light.cc).
constexpr double kSpread = 320;
constexpr double kSpreadCells = 4.0 * (1 << 22);
constexpr double kSpreadCellsOfOne = 4.0 * (1 << 16);
// Of feature edges: a segment, with the tree; and while they are found.
constexpr double kSegment = 52;
constexpr double kEdgesPerTriangle = 77, kEdgesPerVertex = 28, kEdgesPerMesh = 24;
// Of bends: a triangle of a mesh with facets; and while they are found.
constexpr double kBend = 4;
constexpr double kBendsPerTriangle = 52, kBendsPerVertex = 4;
// Of the analysis of what a job needs: a triangle, a vertex, a mesh, and a triangle of a closed
// surface.
constexpr double kAnalysisPerTriangle = 108, kAnalysisPerVertex = 29, kAnalysisPerMesh = 650;
constexpr double kAnalysisOfClosed = 90;
// A surface counts as open when a larger share of its triangles has an edge of its own.
constexpr double kOpenShare = 1e-3;

double SizeOf(const Picture& picture) {
  return static_cast<double>(picture.coded.size()) +
         static_cast<double>(picture.linear.size() * sizeof(float)) + sizeof(Picture);
}

double SizeOf(const TriangleMesh& mesh) {
  return sizeof(TriangleMesh) + 4 * kAllocation +
         static_cast<double>(mesh.positions.size() * sizeof(Vec3) +
                             mesh.indices.size() * sizeof(std::uint32_t) +
                             mesh.normals.size() * sizeof(Vec3) + mesh.uvs.size() * sizeof(Vec2) +
                             mesh.colors.size() * sizeof(Rgb));
}

// How many edges belong to one triangle alone, by Euler's formula for surfaces of one piece: exact
// for a grid and for loose triangles. Vertices that are doubled along seams look like open edges;
// where a mesh has normals or texture coordinates, half of what looks open is taken for seams.
double OpenEdges(const TriangleMesh& mesh) {
  const auto triangles = static_cast<double>(mesh.indices.size()) / 3;
  const auto vertices = static_cast<double>(mesh.positions.size());
  const double open = std::clamp(2 * vertices - triangles, 0.0, 3 * triangles);
  return mesh.normals.empty() && mesh.uvs.empty() ? open : open / 2;
}

}  // namespace

double SceneMemory::PeakOfCoordinator() const {
  return files + kOfHeaps * (shapes + textures + tables + moving +
                             std::max(analysing, acceleration + lights + at_another_time + bends +
                                                     std::max(building_trees, building_bends)));
}

double SceneMemory::PeakOfWorker() const {
  return kOfHeaps *
         (shapes + textures + tables + moving +
          std::max(std::max(edges, building_edges), edges + acceleration + lights + bends +
                                                        std::max(building_trees, building_bends)));
}

SceneMemory SceneMemoryOf(const Scene& scene, const RayNeeds& rays) {
  SceneMemory memory;
  const double tree = rays.split_triangles ? kSplitTreePrimitive : kTreePrimitive;
  double open_edges = 0;
  double primitives = 0;
  double spreads = 0;
  const auto shows_picture = [&](const ShapeTraits& traits) {
    return traits.area_light != kNoAreaLight &&
           scene.area_lights[static_cast<std::size_t>(traits.area_light)].picture != nullptr;
  };
  for (const auto* list : {&scene.meshes, &scene.object_meshes}) {
    for (const TriangleMesh& mesh : *list) {
      const auto triangles = static_cast<double>(mesh.indices.size()) / 3;
      const auto vertices = static_cast<double>(mesh.positions.size());
      primitives += triangles;
      memory.shapes += SizeOf(mesh);
      memory.acceleration +=
          kTreeMesh + tree * triangles + sizeof(Vec3) * (vertices + 1) + kAllocation;
      if (HasFacets(mesh)) {
        memory.bends += kBend * triangles;
        // One mesh after the other.
        memory.building_bends = std::max(
            memory.building_bends, kBendsPerTriangle * triangles + kBendsPerVertex * vertices);
      }
      // The rest concerns what is written out.
      if (list != &scene.meshes) continue;
      open_edges += OpenEdges(mesh);
      memory.building_edges +=
          kEdgesPerTriangle * triangles + kEdgesPerVertex * vertices + kEdgesPerMesh;
      const bool is_open = mesh.normals.empty() && mesh.uvs.empty() &&
                           2 * vertices - triangles > 8 + kOpenShare * triangles;
      memory.analysing += (kAnalysisPerTriangle + (is_open ? 0 : kAnalysisOfClosed)) * triangles +
                          kAnalysisPerVertex * vertices + kAnalysisPerMesh;
      if (mesh.traits.area_light >= 0) memory.lights += kEmitter * triangles;
      if (shows_picture(mesh.traits)) spreads += triangles;
    }
  }
  ForEachAnalyticList(scene, [&](const auto& list) {
    const auto count = static_cast<double>(list.size());
    if (list.empty()) return;
    primitives += count;
    memory.shapes += count * sizeof(list.front());
    memory.acceleration += count * kTreeShape;
  });
  const auto instances = static_cast<double>(scene.instances.size());
  memory.instances = kTreeInstance * instances;
  memory.acceleration += memory.instances;
  memory.shapes += sizeof(Instance) * instances;
  memory.building_trees = kBuildingPrimitive * (primitives + instances);
  memory.shapes += static_cast<double>(
      scene.materials.size() * sizeof(Material) + scene.textures.size() * sizeof(Texture) +
      scene.area_lights.size() * sizeof(AreaLight) + scene.sensors.size() * sizeof(Sensor) +
      scene.infinite_lights.size() * sizeof(InfiniteLight));
  ForEachDeltaList(scene, [&](const auto& lights) {
    if (!lights.empty()) memory.lights += static_cast<double>(lights.size()) * kEmitter;
  });
  ForEachAnalyticShape(scene,
                       [&](const auto& shape) { spreads += shows_picture(shape.traits) ? 1 : 0; });
  memory.lights += kSpread * spreads + std::min(kSpreadCellsOfOne * spreads, kSpreadCells);
  if (scene.motion.Moves()) {
    for (const TriangleMesh& mesh : scene.meshes) {
      if (mesh.traits.motion != kNoMotion) memory.moving += SizeOf(mesh);
    }
    ForEachAnalyticShape(scene, [&](const auto& shape) {
      if (shape.traits.motion != kNoMotion) memory.moving += sizeof(shape);
    });
    for (const Instance& instance : scene.instances)
      memory.moving += instance.motion != kNoMotion ? sizeof(instance) : 0;
    memory.moving += static_cast<double>(scene.motion.of_shapes.size()) *
                     (sizeof(ShapeMotion) + sizeof(AnimatedTransform) + kAllocation);
    memory.at_another_time =
        memory.shapes + memory.acceleration + memory.building_trees + memory.lights;
  }
  memory.edges = kSegment * open_edges;

  std::set<const MeasuredTable*> tables;
  // Made from a material's numbers when the scene is prepared (transport/subsurface.h).
  std::set<std::pair<float, float>> of_subsurface;
  for (const Material& material : scene.materials) {
    if (material.measured != nullptr && tables.insert(material.measured).second)
      memory.textures += static_cast<double>(material.measured->bytes());
    if (material.kind == Material::Kind::kSubsurface &&
        of_subsurface.emplace(material.ior, material.phase_g).second)
      memory.tables += SubsurfaceTable::kBytes;
  }
  for (const Medium& medium : scene.media) {
    if (medium.density != nullptr) memory.textures += static_cast<double>(medium.density->bytes());
  }
  // A picture is in memory once, however many refer to it.
  std::set<const Picture*> pictures;
  const auto add = [&](const std::shared_ptr<const Picture>& picture) {
    if (picture != nullptr && pictures.insert(picture.get()).second)
      memory.textures += SizeOf(*picture);
  };
  for (const Texture& texture : scene.textures)
    add(texture.picture);
  for (const InfiniteLight& light : scene.infinite_lights)
    add(light.map);
  for (const AreaLight& light : scene.area_lights)
    add(light.picture);
  for (const GoniometricLight& light : scene.goniometric_lights)
    add(light.map);
  for (const ProjectionLight& light : scene.projection_lights)
    add(light.map);
  return memory;
}

Status CheckSceneFits(const SceneMemory& memory, double peak_bytes, std::uint64_t available_bytes) {
  const double beside = peak_bytes - memory.shapes - memory.textures;
  const auto available = static_cast<double>(available_bytes);
  if (beside <= available) return absl::OkStatus();
  constexpr double kGigabyte = 1e9;
  return absl::ResourceExhaustedError(absl::StrFormat(
      "the scene takes about %.1f GB of memory, %.1f GB of which are still to be built, and %.1f "
      "GB "
      "are free here; use a machine with more memory, or a scene with fewer triangles",
      peak_bytes / kGigabyte, beside / kGigabyte, available / kGigabyte));
}

}  // namespace lucerna
