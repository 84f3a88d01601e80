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

// Zero without a direction: there the geometric normal is used.
Vec3 UnitOrZero(Vec3 normal) {
  const float size = MaxAbs(normal);
  if (!IsFinite(normal) || size == 0) return {};
  normal = Normalize(normal * (1 / size));
  return IsFinite(normal) ? normal : Vec3();
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
  VertexChoice() = default;
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::size_t Of(std::size_t i) const { return used_.empty() ? i : used_[i]; }

 private:
  std::size_t count_ = 0;
  std::vector<std::uint32_t> used_;
};

// Reads one primitive. Each function returns false when there is nothing to read, with an error or
// a note.
class PrimitiveReader {
 public:
  PrimitiveReader(const GltfDocument& document, GltfBuffers& buffers, GltfBudget& budget,
                  const JsonObject& primitive)
      : document_(document), buffers_(buffers), budget_(budget), primitive_(primitive) {}

  [[nodiscard]] bool ReadTriangles();
  [[nodiscard]] bool ReadVertices(const GltfSurface& surface);
  // Adds the morph targets, each times its weight. Those without a weight are left out.
  [[nodiscard]] bool Morph(const std::vector<double>& weights);
  // Brings the vertices to where the joints do that they follow.
  [[nodiscard]] bool FollowJoints(std::span<const Transform> joints);
  [[nodiscard]] bool HasJoints() const { return attributes_.Has("JOINTS_0"); }
  [[nodiscard]] TriangleMesh Finish();

 private:
  struct Target {
    double weight;
    const GltfAccessor* positions;  // null: does not move
    const GltfAccessor* normals;
  };
  struct JointSet {
    std::string name;  // JOINTS_0
    const GltfAccessor* joints;
    const GltfAccessor* weights;
  };
  struct Influence {
    double weight;
    std::size_t joint;
  };

  // `accessor` is left as it is where there is no such attribute.
  [[nodiscard]] bool Open(const JsonObject& attributes, const std::string& name, GltfUse use,
                          const GltfAccessor*& accessor);
  [[nodiscard]] bool ReadColors();
  [[nodiscard]] bool CheckPosition(std::size_t i);
  [[nodiscard]] bool OpenJointSets(std::vector<JointSet>& sets);
  // What moves vertex `i`; the sum of the weights is above 0.
  [[nodiscard]] bool FindInfluences(const std::vector<JointSet>& sets, std::size_t joint_count,
                                    std::size_t i, std::vector<Influence>& influences);

  const GltfDocument& document_;
  GltfBuffers& buffers_;
  GltfBudget& budget_;
  const JsonObject& primitive_;
  const JsonObject attributes_ = primitive_.Child("attributes");
  const GltfAccessor* positions_ = nullptr;
  std::size_t vertex_count_ = 0;  // of the accessors
  std::size_t triangle_count_ = 0;
  VertexChoice chosen_;
  bool is_turned_over_ = false;
  TriangleMesh mesh_;
};

bool PrimitiveReader::ReadTriangles() {
  const std::uint64_t mode = primitive_.Whole("mode").value_or(kTriangles);
  if (mode <= kLastOfPointsAndLines) {
    document_.diagnostics().Note(document_.whole(), "points and lines are left out");
    return false;
  }
  if (mode > kTriangleFan) {
    primitive_.Error("mode must be from 0 to 6");
    return false;
  }
  const std::optional<std::size_t> position_index = attributes_.Index("POSITION", "accessors");
  if (!position_index.has_value()) {
    if (!attributes_.Has("POSITION")) {
      document_.diagnostics().Note(document_.whole(), "a primitive without POSITION is left out");
    }
    return false;
  }
  positions_ = buffers_.Open(*position_index, GltfUse::kVec3);
  if (positions_ == nullptr) return false;
  const GltfAccessor* corners = nullptr;
  if (primitive_.Has("indices")) {
    const std::optional<std::size_t> index = primitive_.Index("indices", "accessors");
    if (index.has_value()) corners = buffers_.Open(*index, GltfUse::kIndices);
    if (corners == nullptr) return false;
  }
  vertex_count_ = positions_->count();
  if (vertex_count_ > UINT32_MAX) {
    primitive_.Error("has more vertices than 32 bits can number");
    return false;
  }
  triangle_count_ = TriangleCount(mode, corners != nullptr ? corners->count() : vertex_count_);
  // Of a vertex a triangle has up to three: position, normal, texture coordinates and colour.
  const std::size_t vertices = std::min(vertex_count_, 6 * triangle_count_);
  if (!budget_.Take(triangle_count_,
                    triangle_count_ * 3 * sizeof(std::uint32_t) +
                        vertices * (2 * sizeof(Vec3) + sizeof(Vec2) + sizeof(Rgb)))) {
    return false;
  }
  mesh_.indices.reserve(3 * triangle_count_);
  for (std::size_t i = 0; i < triangle_count_; ++i) {
    for (const std::size_t corner : CornersOf(mode, i)) {
      const std::uint32_t vertex =
          corners != nullptr ? corners->WholeAt(corner) : static_cast<std::uint32_t>(corner);
      if (vertex >= vertex_count_) {
        primitive_.Error(Concat("its indices refer to vertex ", vertex, " of ", vertex_count_));
        return false;
      }
      mesh_.indices.push_back(vertex);
    }
  }
  chosen_ = VertexChoice(vertex_count_, mesh_.indices);
  return true;
}

bool PrimitiveReader::Open(const JsonObject& attributes, const std::string& name, GltfUse use,
                           const GltfAccessor*& accessor) {
  if (!attributes.Has(name.c_str())) return true;
  const std::optional<std::size_t> index = attributes.Index(name.c_str(), "accessors");
  const GltfAccessor* opened = index.has_value() ? buffers_.Open(*index, use) : nullptr;
  if (opened == nullptr) return false;
  if (opened->count() != vertex_count_) {
    attributes.Error(Concat(name, " must have as many elements as POSITION (", vertex_count_,
                            "), not ", opened->count()));
    return false;
  }
  accessor = opened;
  return true;
}

bool PrimitiveReader::CheckPosition(std::size_t i) {
  if (IsFinite(mesh_.positions[i])) return true;
  primitive_.Error(Concat("the position of vertex ", chosen_.Of(i), " is not finite"));
  return false;
}

bool PrimitiveReader::ReadVertices(const GltfSurface& surface) {
  mesh_.traits = surface.traits;
  mesh_.positions.reserve(chosen_.count());
  for (std::size_t i = 0; i < chosen_.count(); ++i) {
    mesh_.positions.push_back(ToVec3(positions_->At(chosen_.Of(i))));
    if (!CheckPosition(i)) return false;
  }
  const GltfAccessor* normals = nullptr;
  if (!Open(attributes_, "NORMAL", GltfUse::kVec3, normals)) return false;
  for (std::size_t i = 0; normals != nullptr && i < chosen_.count(); ++i)
    mesh_.normals.push_back(UnitOrZero(ToVec3(normals->At(chosen_.Of(i)))));
  if (!ReadColors()) return false;
  if (!surface.has_textures) return true;
  const std::string name = Concat("TEXCOORD_", surface.tex_coord);
  const GltfAccessor* tex_coords = nullptr;
  if (!Open(attributes_, name, GltfUse::kVec2, tex_coords)) return false;
  for (std::size_t i = 0; tex_coords != nullptr && i < chosen_.count(); ++i) {
    const std::array<double, 4> uv = tex_coords->At(chosen_.Of(i));
    // The file's v points down the image.
    mesh_.uvs.push_back({static_cast<float>(uv[0]), static_cast<float>(1 - uv[1])});
    if (!std::isfinite(mesh_.uvs.back().x) || !std::isfinite(mesh_.uvs.back().y)) {
      primitive_.Error(Concat(name, " of vertex ", chosen_.Of(i), " is not finite"));
      return false;
    }
  }
  return true;
}

bool PrimitiveReader::ReadColors() {
  const GltfAccessor* colors = nullptr;
  // With an opacity, which is not used, or without.
  const std::optional<std::size_t> index = attributes_.Index("COLOR_0", "accessors");
  const bool has_opacity =
      index.has_value() && document_.At("accessors", *index).String("type", "") == "VEC4";
  if (!Open(attributes_, "COLOR_0", has_opacity ? GltfUse::kVec4 : GltfUse::kVec3, colors))
    return false;
  for (std::size_t i = 0; colors != nullptr && i < chosen_.count(); ++i) {
    const std::array<double, 4> color = colors->At(chosen_.Of(i));
    const auto held = [](double channel) {
      return channel > 0 ? static_cast<float>(std::min(channel, 1.0)) : 0.0F;
    };
    mesh_.colors.push_back({held(color[0]), held(color[1]), held(color[2])});
  }
  return true;
}

bool PrimitiveReader::Morph(const std::vector<double>& weights) {
  if (weights.empty()) return true;
  const std::vector<JsonObject> objects = primitive_.Children("targets");
  std::vector<Target> targets;
  for (std::size_t i = 0; i < std::min(objects.size(), weights.size()); ++i) {
    if (weights[i] == 0) continue;
    Target target = {weights[i], nullptr, nullptr};
    if (!Open(objects[i], "POSITION", GltfUse::kVec3, target.positions)) return false;
    if (!mesh_.normals.empty() && !Open(objects[i], "NORMAL", GltfUse::kVec3, target.normals))
      return false;
    targets.push_back(target);
  }
  // They take no memory, but time.
  if (!budget_.Take(0, objects.size() * sizeof(JsonObject) +
                           targets.size() * chosen_.count() * 2 * sizeof(Vec3))) {
    return false;
  }
  const auto moved = [&](Vec3 from, const GltfAccessor* Target::*part, std::size_t i) {
    std::array<double, 3> sum = {static_cast<double>(from.x), static_cast<double>(from.y),
                                 static_cast<double>(from.z)};
    for (const Target& target : targets) {
      if (target.*part == nullptr) continue;
      const std::array<double, 4> step = (target.*part)->At(chosen_.Of(i));
      for (std::size_t axis = 0; axis < 3; ++axis)
        sum[axis] += target.weight * step[axis];
    }
    return ToVec3({sum[0], sum[1], sum[2], 0});
  };
  for (std::size_t i = 0; !targets.empty() && i < chosen_.count(); ++i) {
    mesh_.positions[i] = moved(mesh_.positions[i], &Target::positions, i);
    if (!CheckPosition(i)) return false;
    if (!mesh_.normals.empty())
      mesh_.normals[i] = UnitOrZero(moved(mesh_.normals[i], &Target::normals, i));
  }
  return true;
}

bool PrimitiveReader::OpenJointSets(std::vector<JointSet>& sets) {
  for (std::size_t n = 0; attributes_.Has(Concat("JOINTS_", n).c_str()); ++n) {
    JointSet set = {Concat("JOINTS_", n), nullptr, nullptr};
    const std::string weights = Concat("WEIGHTS_", n);
    if (!Open(attributes_, set.name, GltfUse::kVec4, set.joints) ||
        !Open(attributes_, weights, GltfUse::kVec4, set.weights)) {
      return false;
    }
    if (set.weights == nullptr) {
      attributes_.Error(Concat("has ", set.name, " and no ", weights));
      return false;
    }
    sets.push_back(std::move(set));
  }
  return true;
}

bool PrimitiveReader::FindInfluences(const std::vector<JointSet>& sets, std::size_t joint_count,
                                     std::size_t i, std::vector<Influence>& influences) {
  influences.clear();
  const std::size_t vertex = chosen_.Of(i);
  const auto add = [&](const JointSet& set, std::size_t part, double weight) {
    const double joint = set.joints->At(vertex)[part];
    if (!(joint >= 0 && joint < static_cast<double>(joint_count) && joint == std::floor(joint))) {
      attributes_.Error(Concat(set.name, " of vertex ", vertex, " is ", joint, ", none of the ",
                               joint_count, " joints of the skin"));
      return false;
    }
    influences.push_back({weight, static_cast<std::size_t>(joint)});
    return true;
  };
  for (const JointSet& set : sets) {
    const std::array<double, 4> weights = set.weights->At(vertex);
    for (std::size_t part = 0; part < 4; ++part) {
      // Where a weight is 0 some writers leave any number as the joint.
      if (weights[part] <= 0) continue;
      if (!std::isfinite(weights[part])) {
        attributes_.Error(Concat("a weight of vertex ", vertex, " is not finite"));
        return false;
      }
      if (!add(set, part, weights[part])) return false;
    }
  }
  // A vertex without weights has to be somewhere.
  return !influences.empty() || add(sets[0], 0, 1);
}

bool PrimitiveReader::FollowJoints(std::span<const Transform> joints) {
  std::vector<JointSet> sets;
  if (!OpenJointSets(sets)) return false;
  // They take no memory, but time.
  if (!budget_.Take(0, sets.size() * chosen_.count() * 2 * sizeof(Vec3))) return false;
  std::vector<Influence> influences;
  for (std::size_t i = 0; i < chosen_.count(); ++i) {
    if (!FindInfluences(sets, joints.size(), i, influences)) return false;
    double sum = 0;
    for (const Influence& influence : influences)
      sum += influence.weight;
    std::array<std::array<double, 4>, 4> rows{};
    for (const Influence& influence : influences) {
      for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 4; ++column) {
          rows[row][column] += influence.weight / sum * joints[influence.joint].rows()[row][column];
        }
      }
    }
    rows[3] = {0, 0, 0, 1};
    const Transform to_world(rows);
    mesh_.positions[i] = to_world.Point(mesh_.positions[i]);
    if (!CheckPosition(i)) return false;
    if (!mesh_.normals.empty() && mesh_.normals[i] != Vec3())
      mesh_.normals[i] = UnitOrZero(to_world.Normal(mesh_.normals[i]));
    // Joints do not mirror one part of a mesh and not another.
    if (i == 0) is_turned_over_ = to_world.SwapsHandedness();
  }
  return true;
}

TriangleMesh PrimitiveReader::Finish() {
  const std::size_t dropped = DropTriangles(mesh_, kLeastArea);
  if (dropped > 0) {
    document_.diagnostics().Note(document_.whole(),
                                 Concat(primitive_.place(), ": ", dropped, " of ", triangle_count_,
                                        " triangles have no area and are dropped"));
  }
  WindByNormals(mesh_, is_turned_over_);
  return std::move(mesh_);
}

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

std::vector<GltfPrimitive> GltfMeshes::Read(const GltfShape& shape,
                                            std::span<const Transform> joints) {
  const JsonObject object = document_.At("meshes", shape.mesh);
  const std::vector<double> weights =
      shape.weights.empty() ? object.NumberList("weights", kJsonAnyNumber) : shape.weights;
  std::vector<GltfPrimitive> read;
  const std::vector<JsonObject> primitives = object.Children("primitives");
  // Nodes may give one mesh many shapes.
  if (!budget_.Take(0, primitives.size() * sizeof(GltfPrimitive))) return read;
  for (const JsonObject& primitive : primitives) {
    if (budget_.is_spent()) break;
    std::optional<std::size_t> material;
    if (primitive.Has("material")) {
      material = primitive.Index("material", "materials");
      if (!material.has_value()) continue;
    }
    const bool has_colors = primitive.Child("attributes").Has("COLOR_0");
    const GltfSurface& surface = materials_.Get(material, has_colors);
    // No ray meets what is transparent everywhere.
    if (surface.traits.alpha <= 0) continue;
    PrimitiveReader reader(document_, buffers_, budget_, primitive);
    if (!reader.ReadTriangles() || !reader.ReadVertices(surface) || !reader.Morph(weights))
      continue;
    const bool follows_joints = shape.skin.has_value() && reader.HasJoints();
    if (follows_joints && !reader.FollowJoints(joints)) continue;
    if (shape.skin.has_value() && !follows_joints) {
      primitive.Warning("has no JOINTS_0: it stands where the node stands that gives it a skin");
    }
    GltfPrimitive finished = {reader.Finish(), primitive.place(), follows_joints};
    if (!finished.mesh.indices.empty()) read.push_back(std::move(finished));
  }
  return read;
}

}  // namespace lucerna
