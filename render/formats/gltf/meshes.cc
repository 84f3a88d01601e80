#include "render/formats/gltf/meshes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "render/base/text.h"
#include "render/formats/mesh_placement.h"
#include "render/scene/degenerate_triangles.h"

namespace lucerna {
namespace {

// Of primitives, by OpenGL's numbers.
constexpr std::uint64_t kLastOfPointsAndLines = 3;
constexpr std::uint64_t kTriangles = 4;
constexpr std::uint64_t kTriangleStrip = 5;
constexpr std::uint64_t kTriangleFan = 6;

std::size_t TriangleCount(std::uint64_t mode, std::size_t corners) {
  if (mode == kTriangles) return corners / 3;
  return corners < 3 ? 0 : corners - 2;
}

// The corners of triangle `i`, as numbers of the primitive's corners.
std::array<std::size_t, 3> CornersOf(std::uint64_t mode, std::size_t i) {
  switch (mode) {
    case kTriangleStrip:
      return {i, i + 1 + i % 2, i + 2 - i % 2};
    case kTriangleFan:
      return {i + 1, i + 2, 0};
    default:
      return {3 * i, 3 * i + 1, 3 * i + 2};
  }
}

Vec3 ToVec3(const std::array<double, 4>& numbers) {
  return {static_cast<float>(numbers[0]), static_cast<float>(numbers[1]),
          static_cast<float>(numbers[2])};
}

// Which vertices of the accessors a mesh has: all, or those that its triangles use, in rising
// order.
class VertexChoice {
 public:
  VertexChoice(std::size_t count, std::vector<std::uint32_t>& indices) : count_(count) {
    // Many primitives may share the vertices of one accessor.
    if (count <= 2 * indices.size()) return;
    used_ = indices;
    std::ranges::sort(used_);
    used_.erase(std::unique(used_.begin(), used_.end()), used_.end());
    for (std::uint32_t& index : indices) {
      index = static_cast<std::uint32_t>(std::ranges::lower_bound(used_, index) - used_.begin());
    }
    count_ = used_.size();
  }
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::size_t Of(std::size_t i) const { return used_.empty() ? i : used_[i]; }

 private:
  std::size_t count_ = 0;
  std::vector<std::uint32_t> used_;
};

}  // namespace

bool GltfBudget::Take(std::uint64_t triangles, std::uint64_t size_bytes) {
  if (is_spent_) return false;
  triangles_ += triangles;
  size_bytes_ += size_bytes;
  if (triangles_ > limits_.max_triangles) {
    document_.diagnostics().Error(
        document_.whole(), Concat("the scene has more than ", limits_.max_triangles, " triangles"));
    is_spent_ = true;
  } else if (size_bytes_ > limits_.max_shape_bytes) {
    document_.diagnostics().Error(
        document_.whole(),
        Concat("the shapes of the scene take more than the ", limits_.max_shape_bytes,
               " bytes of memory that there are for them; repeat meshes less often, or give "
               "meshes with fewer vertices"));
    is_spent_ = true;
  }
  return !is_spent_;
}

std::optional<TriangleMesh> GltfMeshes::ReadPrimitive(const GltfObject& primitive,
                                                      const GltfSurface& surface) {
  const GltfObject attributes = primitive.Child("attributes");
  const std::uint64_t mode = primitive.Whole("mode").value_or(kTriangles);
  if (mode <= kLastOfPointsAndLines) {
    document_.diagnostics().Note(document_.whole(), "points and lines are left out");
    return std::nullopt;
  }
  if (mode > kTriangleFan) {
    primitive.Error("mode must be from 0 to 6");
    return std::nullopt;
  }
  const std::optional<std::size_t> position_index = attributes.Index("POSITION", "accessors");
  if (!position_index.has_value()) {
    if (!attributes.Has("POSITION")) {
      document_.diagnostics().Note(document_.whole(), "a primitive without POSITION is left out");
    }
    return std::nullopt;
  }
  const GltfAccessor* positions = buffers_.Open(*position_index, GltfUse::kVec3);
  if (positions == nullptr) return std::nullopt;
  const GltfAccessor* corners = nullptr;
  if (primitive.Has("indices")) {
    const std::optional<std::size_t> index = primitive.Index("indices", "accessors");
    if (!index.has_value()) return std::nullopt;
    corners = buffers_.Open(*index, GltfUse::kIndices);
    if (corners == nullptr) return std::nullopt;
  }
  const auto vertex_count = positions->count();
  if (vertex_count > UINT32_MAX) {
    primitive.Error("has more vertices than 32 bits can number");
    return std::nullopt;
  }
  const std::size_t triangles =
      TriangleCount(mode, corners != nullptr ? corners->count() : vertex_count);
  // Of a vertex a triangle has up to three: position, normal and texture coordinates.
  const std::size_t vertices = std::min(vertex_count, 6 * triangles);
  if (!budget_.Take(triangles, triangles * 3 * sizeof(std::uint32_t) +
                                   vertices * (2 * sizeof(Vec3) + sizeof(Vec2)))) {
    return std::nullopt;
  }

  TriangleMesh mesh;
  mesh.traits = surface.traits;
  mesh.indices.reserve(3 * triangles);
  for (std::size_t i = 0; i < triangles; ++i) {
    for (const std::size_t corner : CornersOf(mode, i)) {
      const std::uint32_t vertex =
          corners != nullptr ? corners->WholeAt(corner) : static_cast<std::uint32_t>(corner);
      if (vertex >= vertex_count) {
        primitive.Error(Concat("its indices refer to vertex ", vertex, " of ", vertex_count));
        return std::nullopt;
      }
      mesh.indices.push_back(vertex);
    }
  }
  const VertexChoice chosen(vertex_count, mesh.indices);
  mesh.positions.reserve(chosen.count());
  for (std::size_t i = 0; i < chosen.count(); ++i) {
    mesh.positions.push_back(ToVec3(positions->At(chosen.Of(i))));
    if (!IsFinite(mesh.positions.back())) {
      primitive.Error(Concat("the position of vertex ", chosen.Of(i), " is not finite"));
      return std::nullopt;
    }
  }
  // nullptr when there is none; an error when it does not fit the positions.
  const auto attribute = [&](const char* name, GltfUse use, bool& has_error) {
    const GltfAccessor* none = nullptr;
    if (!attributes.Has(name)) return none;
    const std::optional<std::size_t> index = attributes.Index(name, "accessors");
    const GltfAccessor* accessor = index.has_value() ? buffers_.Open(*index, use) : nullptr;
    has_error = accessor == nullptr || accessor->count() != vertex_count;
    if (accessor != nullptr && has_error) {
      attributes.Error(Concat(name, " must have as many elements as POSITION (", vertex_count,
                              "), not ", accessor->count()));
    }
    return has_error ? none : accessor;
  };
  bool has_error = false;
  const GltfAccessor* normals = attribute("NORMAL", GltfUse::kVec3, has_error);
  if (has_error) return std::nullopt;
  for (std::size_t i = 0; normals != nullptr && i < chosen.count(); ++i) {
    // Without a direction the geometric normal is used.
    const Vec3 normal = ToVec3(normals->At(chosen.Of(i)));
    const float size = MaxAbs(normal);
    const bool has_direction = IsFinite(normal) && size > 0;
    mesh.normals.push_back(has_direction ? Normalize(normal * (1 / size)) : Vec3());
    if (!IsFinite(mesh.normals.back())) mesh.normals.back() = Vec3();
  }
  const std::string tex_coord_name = Concat("TEXCOORD_", surface.tex_coord);
  const GltfAccessor* tex_coords =
      surface.has_textures ? attribute(tex_coord_name.c_str(), GltfUse::kVec2, has_error) : nullptr;
  if (has_error) return std::nullopt;
  for (std::size_t i = 0; tex_coords != nullptr && i < chosen.count(); ++i) {
    const std::array<double, 4> uv = tex_coords->At(chosen.Of(i));
    // The file's v points down the image.
    mesh.uvs.push_back({static_cast<float>(uv[0]), static_cast<float>(1 - uv[1])});
    if (!std::isfinite(mesh.uvs.back().x) || !std::isfinite(mesh.uvs.back().y)) {
      primitive.Error(Concat(tex_coord_name, " of vertex ", chosen.Of(i), " is not finite"));
      return std::nullopt;
    }
  }
  const std::size_t dropped = DropTriangles(mesh, kLeastArea);
  if (dropped > 0) {
    document_.diagnostics().Note(document_.whole(),
                                 Concat(primitive.place(), ": ", dropped, " of ", triangles,
                                        " triangles have no area and are dropped"));
  }
  WindByNormals(mesh, false);
  return mesh;
}

std::vector<GltfPrimitive> GltfMeshes::Read(std::size_t mesh) {
  const GltfObject object = document_.At("meshes", mesh);
  std::vector<GltfPrimitive> read;
  for (const GltfObject& primitive : object.Children("primitives")) {
    if (budget_.is_spent()) break;
    std::optional<std::size_t> material;
    if (primitive.Has("material")) {
      material = primitive.Index("material", "materials");
      if (!material.has_value()) continue;
    }
    const GltfSurface& surface = materials_.Get(material);
    if (primitive.Child("attributes").Has("COLOR_0")) {
      document_.diagnostics().Note(document_.whole(), "colours of vertices are ignored");
    }
    if (primitive.Has("targets")) {
      document_.diagnostics().Warning(document_.whole(),
                                      "morph targets are ignored: meshes have their base shape");
    }
    // No ray meets what is transparent everywhere.
    if (surface.traits.alpha <= 0) continue;
    std::optional<TriangleMesh> triangles = ReadPrimitive(primitive, surface);
    if (!triangles.has_value() || triangles->indices.empty()) continue;
    read.push_back({*std::move(triangles), primitive.place()});
  }
  return read;
}

}  // namespace lucerna
