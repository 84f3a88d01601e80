#include "render/formats/pbrt/shapes.h"

// Which way shapes face, by pbrt-v4's rules. A mesh without normals faces along the cross product
// of its world-space edges, turned over by ReverseOrientation and by a mirroring transform, one
// undoing the other. A mesh with normals faces with its normals, which are mapped as normals and
// turned over by ReverseOrientation alone. Spheres face outward, flat shapes along +z of their own
// space; they are turned over by ReverseOrientation and, where light meets them, by a mirroring
// transform: pbrt-v4 turns their normals for it and then maps them as normals. The light of those
// that emit leaves on the side that ReverseOrientation alone decides.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "render/base/text.h"
#include "render/formats/displaced_mesh.h"
#include "render/formats/mesh_placement.h"
#include "render/formats/parametric_mesh.h"
#include "render/formats/pbrt/kinds.h"
#include "render/formats/pbrt/shape_readers.h"
#include "render/math/double3.h"
#include "render/scene/degenerate_triangles.h"
#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

constexpr std::array<std::string_view, 4> kPoint2Types = {"point2", "vector2", "point", "float"};
constexpr std::array<std::string_view, 1> kIntegerType = {"integer"};

std::vector<Vec3> Triples(std::span<const double> numbers) {
  std::vector<Vec3> triples;
  triples.reserve(numbers.size() / 3);
  for (std::size_t i = 0; i + 2 < numbers.size(); i += 3) {
    triples.push_back({static_cast<float>(numbers[i]), static_cast<float>(numbers[i + 1]),
                       static_cast<float>(numbers[i + 2])});
  }
  return triples;
}

void ReadTriangleMesh(const ShapeInput& input, ShapeSet& shapes) {
  ParameterList& parameters = input.parameters;
  TriangleMesh mesh;
  if (parameters.Has("S")) {
    parameters.Warning("S",
                       "is ignored: stretched highlights and normal maps follow the texture "
                       "coordinates");
  }
  for (const std::string_view name : {"S", "faceIndices"})
    parameters.Ignore(name);
  const bool has_positions = ReadPositions(parameters, 3, mesh);
  ReadNormals(parameters, mesh);
  ReadUvs(parameters, mesh);
  if (!has_positions) return;
  shapes.parts = mesh.indices.size() / 3;
  PlaceMesh(std::move(mesh), parameters, input.placement, shapes);
}

// False, and reported, where that cannot be done.
bool DisplaceMesh(const ShapeInput& input, TriangleMesh& mesh) {
  ParameterList& parameters = input.parameters;
  const Transform& to_world = input.placement.to_world;
  const double edge_length = parameters.Float(
      "displacement.edgelength", parameters.Float("edgelength", 1, kAboveZero), kAboveZero);
  HeightOf height;
  if (parameters.IsTexture("displacement")) {
    const NamedTexture* texture = FindNumbers("displacement", parameters, input.textures.numbers);
    if (texture == nullptr) return false;
    // At places in the world, as textures are looked up everywhere; pbrt-v4 takes those of the
    // shape's own space here.
    height = [&to_world, number = texture->number, all = input.textures.all](Vec3 position, Vec2 uv,
                                                                             Vec3 normal) {
      return static_cast<double>(
          TextureNumber(all, number, {uv, to_world.Point(position), to_world.Normal(normal)}));
    };
  } else {
    height = [everywhere = parameters.Float("displacement", 0)](Vec3, Vec2, Vec3) {
      return everywhere;
    };
  }
  if (mesh.uvs.empty()) {
    parameters.Error("displacement", "needs a mesh with texture coordinates");
    return false;
  }
  const Status displaced =
      Displace(edge_length, to_world, MostTriangles(input.assets), height, mesh);
  if (!displaced.ok()) parameters.Error("displacement", std::string(displaced.message()));
  return displaced.ok();
}

// Patches made of quadrangles, whose texture coordinates a mesh of triangles does not have.
struct QuadPatches {
  TriangleMesh flat, curved;
};

// Takes the quadrangles out of a mesh that need it: those that do not lie in a plane, and all where
// texture coordinates are needed and the mesh has none. `most_triangles`: with more, all are flat,
// with a warning.
QuadPatches TakePatches(const std::vector<std::size_t>& quads, bool needs_uv,
                        std::size_t most_triangles, ParameterList& parameters, TriangleMesh& mesh) {
  const auto vertex_of = [&](std::size_t triangle, std::size_t corner) {
    // Of p00, p10, p01 and p11: the corners of a face go around.
    constexpr std::array<std::size_t, 4> kInTriangles = {0, 1, 5, 2};
    return mesh.indices[3 * triangle + kInTriangles[corner]];
  };
  const auto patch_of = [&](std::size_t triangle) {
    BilinearPatch patch;
    for (std::size_t corner = 0; corner < 4; ++corner) {
      const std::uint32_t vertex = vertex_of(triangle, corner);
      patch.corners[corner] = mesh.positions[vertex];
      if (!mesh.uvs.empty()) patch.uvs[corner] = mesh.uvs[vertex];
    }
    return patch;
  };
  std::vector<int> sides(quads.size());
  std::size_t triangles = 0;
  for (std::size_t i = 0; i < quads.size(); ++i) {
    sides[i] = FewestPatchSides(patch_of(quads[i]));
    triangles += 2 * static_cast<std::size_t>(sides[i]) * static_cast<std::size_t>(sides[i]);
  }
  if (triangles > most_triangles && triangles > 2 * quads.size()) {
    parameters.Warning("filename", "has so many quadrangles that each is two flat triangles");
    std::ranges::fill(sides, 1);
  }
  QuadPatches patches;
  std::vector<bool> is_taken(mesh.indices.size() / 3, false);
  for (std::size_t i = 0; i < quads.size(); ++i) {
    // Flat ones share vertices as triangles, and only triangles have colours.
    const bool is_done = sides[i] == 1 && (!mesh.uvs.empty() || !needs_uv);
    if (is_done || !mesh.colors.empty()) continue;
    std::array<Vec3, 4> normals;
    for (std::size_t corner = 0; corner < 4 && !mesh.normals.empty(); ++corner)
      normals[corner] = mesh.normals[vertex_of(quads[i], corner)];
    AddBilinearPatch(patch_of(quads[i]), mesh.normals.empty() ? nullptr : &normals, sides[i],
                     sides[i] == 1 ? patches.flat : patches.curved);
    is_taken[quads[i]] = is_taken[quads[i] + 1] = true;
  }
  if (mesh.normals.empty()) patches.flat.normals.clear();
  std::size_t kept = 0;
  for (std::size_t triangle = 0; triangle < is_taken.size(); ++triangle) {
    if (is_taken[triangle]) continue;
    std::copy_n(&mesh.indices[3 * triangle], 3, &mesh.indices[3 * kept++]);
  }
  mesh.indices.resize(3 * kept);
  return patches;
}

void ReadPlyMesh(const ShapeInput& input, ShapeSet& shapes) {
  ParameterList& parameters = input.parameters;
  const std::optional<std::string> file = parameters.FindString("filename");
  if (!file.has_value()) {
    if (!parameters.Has("filename")) parameters.Error("needs \"string filename\"");
    return;
  }
  PlyFaces faces;
  StatusOr<TriangleMesh> mesh = input.assets.ReadMesh(*file, &faces);
  if (!mesh.ok()) {
    parameters.Error("filename", Concat("cannot be read: ", mesh.status().message()));
    return;
  }
  WarnOfSkipped(faces, parameters);
  shapes.parts = mesh->indices.size() / 3 - faces.quads.size();
  QuadPatches patches;
  if (parameters.Has("displacement")) {
    if (!DisplaceMesh(input, *mesh)) return;
  } else {
    for (const std::string_view name : {"edgelength", "displacement.edgelength"})
      parameters.Ignore(name);
    const bool needs_uv = input.placement.may_show_uv || parameters.IsTexture("alpha");
    patches = TakePatches(faces.quads, needs_uv, MostTriangles(input.assets), parameters, *mesh);
  }
  PlaceMesh(*std::move(mesh), parameters, input.placement, shapes);
  PlaceMesh(std::move(patches.flat), parameters, input.placement, shapes);
  PlaceMesh(std::move(patches.curved), parameters, input.placement, shapes);
}

using ShapeReader = void (*)(const ShapeInput&, ShapeSet&);
#define LUCERNA_ROW(Name, list, name) {name, &Read##Name},
constexpr Kind<ShapeReader> kKinds[] = {
    {"trianglemesh", &ReadTriangleMesh}, {"plymesh", &ReadPlyMesh},
    {"bilinearmesh", &ReadBilinearMesh}, {"loopsubdiv", &ReadLoopSubdivision},
    {"cylinder", &ReadCylinder},
    LUCERNA_ANALYTIC_SHAPES(LUCERNA_ROW)  //
};
#undef LUCERNA_ROW

void ReadAlpha(ParameterList& parameters, const TextureNames& numbers, ShapeTraits& traits) {
  if (!parameters.IsTexture("alpha")) {
    traits.alpha = static_cast<float>(std::min(parameters.Float("alpha", 1), 1.0));
    return;
  }
  const NamedTexture* alpha = FindNumbers("alpha", parameters, numbers);
  if (alpha == nullptr) return;
  traits.alpha = std::min(alpha->largest, 1.0F);
  if (alpha->least >= 1 || alpha->largest <= 0) return;
  traits.alpha_texture = alpha->number;
}

}  // namespace

void WarnOfSkipped(const PlyFaces& faces, ParameterList& parameters) {
  if (faces.skipped == 0) return;
  parameters.Warning("filename",
                     Concat("has ", faces.skipped, faces.skipped == 1 ? " face" : " faces",
                            " with neither three nor four corners, left out"));
}

void PlaceMesh(TriangleMesh mesh, ParameterList& parameters, const ShapePlacement& placement,
               ShapeSet& shapes) {
  // New vertices of a displaced mesh have none.
  if (mesh.colors.size() != mesh.positions.size()) mesh.colors.clear();
  if (!MoveMesh(placement.to_world, mesh)) {
    parameters.Error("is moved out of the finite numbers by its transform");
    return;
  }
  if (placement.reverse_orientation) {
    for (Vec3& normal : mesh.normals)
      normal = -normal;
  }
  const std::size_t dropped = DropTriangles(mesh, kLeastArea);
  if (dropped > 0) {
    parameters.diagnostics().Note(
        parameters.location(),
        Concat(parameters.subject(), ": ", dropped, " of ", dropped + mesh.indices.size() / 3,
               " triangles have no area and are dropped"));
  }
  WindByNormals(mesh, placement.reverse_orientation != placement.to_world.SwapsHandedness());
  if (mesh.indices.empty()) return;
  mesh.traits = placement.traits;
  shapes.meshes.push_back(std::move(mesh));
}

bool ReadPositions(ParameterList& parameters, std::uint32_t corners, TriangleMesh& mesh) {
  mesh.positions = Triples(parameters.Numbers("P", kPointTypes, 3));
  const std::span<const double> given = parameters.Numbers("indices", kIntegerType, 1);
  const std::size_t excess = given.size() % corners;
  const std::span<const double> indices = given.first(given.size() - excess);
  if (mesh.positions.empty()) {
    if (!parameters.Has("P")) parameters.Error("needs vertex positions: \"point3 P\" [ ... ]");
    return false;
  }
  if (!parameters.Has("indices") && mesh.positions.size() == corners) {
    for (std::uint32_t i = 0; i < corners; ++i)
      mesh.indices.push_back(i);
    return true;
  }
  if (indices.empty()) {
    if (!parameters.Has("indices") || excess > 0) {
      parameters.Error(Concat("needs vertex indices, ", corners == 3 ? "three" : "four",
                              " for each ", corners == 3 ? "triangle" : "patch"));
    }
    return false;
  }
  if (excess > 0) {
    parameters.Warning(
        "indices", Concat("has ", given.size(), " values, no multiple of ", corners, ": the last ",
                          excess, excess == 1 ? " is" : " are", " left out"));
  }
  for (const double index : indices) {
    if (!(index >= 0 && index < static_cast<double>(mesh.positions.size()))) {
      parameters.Error("indices",
                       Concat("refers to vertex ", index, " of ", mesh.positions.size()));
      return false;
    }
    mesh.indices.push_back(static_cast<std::uint32_t>(index));
  }
  return true;
}

void ReadNormals(ParameterList& parameters, TriangleMesh& mesh) {
  mesh.normals = Triples(parameters.Numbers("N", kNormalTypes, 3));
  if (mesh.normals.empty() || mesh.normals.size() == mesh.positions.size()) return;
  if (!mesh.positions.empty()) {
    parameters.Warning("N", Concat("has ", mesh.normals.size(), " normals for the ",
                                   mesh.positions.size(), " vertices of P and is ignored"));
  }
  mesh.normals.clear();
}

void ReadUvs(ParameterList& parameters, TriangleMesh& mesh) {
  const std::string_view name = parameters.Has("uv") ? "uv" : "st";
  const std::span<const double> uvs = parameters.Numbers(name, kPoint2Types, 2);
  for (std::size_t i = 0; i + 1 < uvs.size(); i += 2) {
    mesh.uvs.push_back({static_cast<float>(uvs[i]), static_cast<float>(uvs[i + 1])});
  }
  if (mesh.uvs.empty() || mesh.uvs.size() == mesh.positions.size()) return;
  if (!mesh.positions.empty()) {
    parameters.Warning(name, Concat("has ", mesh.uvs.size(), " pairs for the ",
                                    mesh.positions.size(), " vertices of P and is ignored"));
  }
  mesh.uvs.clear();
}

std::size_t MostTriangles(const AssetReader& assets) {
  constexpr std::size_t kBytesPerTriangle = 256;
  constexpr std::size_t kMost = std::size_t{1} << 24;
  return std::min<std::size_t>(kMost, assets.limits().max_shape_bytes / kBytesPerTriangle);
}

bool IsFlattened(ParameterList& parameters, const Transform& to_world) {
  if (to_world.Inverse().ok()) return false;
  parameters.diagnostics().Note(
      parameters.location(),
      Concat(parameters.subject(), " is flattened by its transform and left out"));
  return true;
}

ShapePlacement PlacementOfQuadric(const ShapePlacement& placement) {
  ShapePlacement turned = placement;
  if (placement.to_world.SwapsHandedness() && !placement.emits)
    turned.reverse_orientation = !turned.reverse_orientation;
  return turned;
}

double ReadPhiMax(ParameterList& parameters) {
  // pbrt-v4 holds it at a whole turn.
  return std::min(parameters.Float("phimax", 360, kAboveZero), 360.0) * std::numbers::pi / 180;
}

void PutOnAxes(Vec3 center, const ShapeAxes& axes, bool is_reversed, TriangleMesh& mesh) {
  const auto turned = [&](Vec3 v) { return axes.x * v.x + axes.y * v.y + axes.z * v.z; };
  for (Vec3& position : mesh.positions)
    position = center + turned(position);
  for (Vec3& normal : mesh.normals)
    normal = turned(normal) * (is_reversed ? -1.0F : 1.0F);
  WindByNormals(mesh, false);
}

std::uint64_t ShapeSet::Cost() const {
  std::uint64_t cost = 0;
  ForEachAnalyticList(*this, [&](const auto& list) { cost += list.size(); });
  for (const TriangleMesh& mesh : meshes) {
    cost += std::max<std::uint64_t>({1, mesh.indices.size() / 3, mesh.positions.size() / 3});
  }
  return cost;
}

std::uint64_t ShapeSet::SizeBytes() const {
  std::uint64_t size = 0;
  for (const TriangleMesh& mesh : meshes) {
    size += lucerna::SizeBytes(mesh);
  }
  ForEachAnalyticShape(*this, [&](const auto& shape) { size += sizeof(shape); });
  return size;
}

double ShapeSet::Area() const {
  double area_m2 = 0;
  for (const TriangleMesh& mesh : meshes) {
    for (std::size_t triangle = 0; triangle < mesh.indices.size() / 3; ++triangle) {
      area_m2 += Length(EdgeCross(mesh, triangle)) / 2;
    }
  }
  ForEachAnalyticShape(*this, [&](const auto& shape) { area_m2 += shape.template Area<double>(); });
  return area_m2;
}

ShapeSet ReadShapes(std::string_view type, ParameterList& parameters,
                    const ShapePlacement& placement, const ShapeTextures& textures,
                    AssetReader& assets) {
  ShapeSet shapes;
  const ShapeReader read = FindReader<ShapeReader>(kKinds, type);
  if (read == nullptr) {
    parameters.Error(Concat("is not supported; ", SupportedKinds<ShapeReader>(kKinds)));
    return shapes;
  }
  ShapePlacement with_alpha = placement;
  ReadAlpha(parameters, textures.numbers, with_alpha.traits);
  read({parameters, with_alpha, assets, textures}, shapes);
  parameters.WarnOfUnread();
  return shapes;
}

ShapeSet PlaceMadeMesh(TriangleMesh mesh, ParameterList& parameters,
                       const ShapePlacement& placement, const TextureNames& numbers) {
  ShapeSet shapes;
  ShapePlacement with_alpha = placement;
  ReadAlpha(parameters, numbers, with_alpha.traits);
  PlaceMesh(std::move(mesh), parameters, with_alpha, shapes);
  parameters.WarnOfUnread();
  return shapes;
}

StatusOr<ShapeSet> Instantiate(const ShapeSet& object, const Transform& to_world,
                               bool stays_similar) {
  ShapeSet shapes;
  for (const TriangleMesh& original : object.meshes) {
    TriangleMesh mesh = original;
    if (!MoveMesh(to_world, mesh)) return MovedAway();
    DropTriangles(mesh, kLeastArea);
    if (mesh.indices.empty()) continue;
    // The outward side stays outward: a mirror image is wound the other way round.
    if (to_world.SwapsHandedness()) SwapWinding(mesh);
    shapes.meshes.push_back(std::move(mesh));
  }
  // What the transform makes another shape of is given as triangles.
  const auto add_mesh = [&](TriangleMesh mesh, const ShapeTraits& traits) {
    if (!MoveMesh(to_world, mesh)) return MovedAway();
    DropTriangles(mesh, kLeastArea);
    if (to_world.SwapsHandedness()) SwapWinding(mesh);
    mesh.traits = traits;
    if (!mesh.indices.empty()) shapes.meshes.push_back(std::move(mesh));
    return absl::OkStatus();
  };
#define LUCERNA_MOVE(Name, list, name)                                      \
  for (Name shape : object.list) {                                          \
    if constexpr (!Name::kIsThin) {                                         \
      if (!stays_similar || !to_world.UniformScale().ok()) {                \
        LUCERNA_RETURN_IF_ERROR(add_mesh(Mesh##Name(shape), shape.traits)); \
        continue;                                                           \
      }                                                                     \
    }                                                                       \
    LUCERNA_RETURN_IF_ERROR(Move##Name(shape, to_world));                   \
    shapes.list.push_back(shape);                                           \
  }
  LUCERNA_ANALYTIC_SHAPES(LUCERNA_MOVE)
#undef LUCERNA_MOVE
  return shapes;
}

}  // namespace lucerna
