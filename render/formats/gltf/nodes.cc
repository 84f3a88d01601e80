#include "render/formats/gltf/nodes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "render/base/text.h"
#include "render/formats/gltf/skins.h"
#include "render/formats/mesh_placement.h"

namespace lucerna {
namespace {

// A turn by a quaternion (x, y, z, w) of any length but 0.
std::optional<Transform> TurnBy(const std::array<double, 4>& q) {
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(length > 0) || !std::isfinite(length)) return std::nullopt;
  const double x = q[0] / length;
  const double y = q[1] / length;
  const double z = q[2] / length;
  const double w = q[3] / length;
  return Transform({{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), 0},
                     {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), 0},
                     {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), 0},
                     {0, 0, 0, 1}}});
}

// The node's own transform; nullopt after an error.
std::optional<Transform> LocalTransform(const JsonObject& node) {
  if (node.Has("matrix")) {
    const std::vector<double> columns =
        node.Numbers("matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, kJsonAnyNumber);
    std::array<double, 16> numbers{};
    std::ranges::copy(columns, numbers.begin());
    if (const std::optional<Transform> affine = AffineOf(numbers)) return affine;
    node.Error("matrix must be affine: its fourth row, numbers 4, 8, 12 and 16, must be 0 0 0 1");
    return std::nullopt;
  }
  const std::vector<double> t = node.Numbers("translation", {0, 0, 0}, kJsonAnyNumber);
  const std::vector<double> r = node.Numbers("rotation", {0, 0, 0, 1}, kJsonAnyNumber);
  const std::vector<double> s = node.Numbers("scale", {1, 1, 1}, kJsonAnyNumber);
  const std::optional<Transform> turn = TurnBy({r[0], r[1], r[2], r[3]});
  if (!turn.has_value()) {
    node.Error("rotation is a quaternion of length 0");
    return std::nullopt;
  }
  return Transform::Translate(t[0], t[1], t[2]) * *turn * Transform::Scale(s[0], s[1], s[2]);
}

class NodeWalk {
 public:
  NodeWalk(const GltfDocument& document, GltfBuffers& buffers, GltfBudget& budget)
      : document_(document), buffers_(buffers), budget_(budget) {
    if (document.Count("skins") > 0) node_to_world_.resize(document.Count("nodes"));
  }

  GltfPlaces Walk();

 private:
  struct Open {
    std::size_t node;
    Transform parent;
    bool is_visible;
  };

  [[nodiscard]] std::vector<std::size_t> Roots() const;
  // Returns the node's transform, or nullopt when its branch is left out after an error.
  std::optional<Transform> Visit(const JsonObject& node, const Open& open);
  void PlaceMesh(const JsonObject& node, std::size_t mesh, const Transform& to_world);
  // EXT_mesh_gpu_instancing: one transform within the node for each instance.
  void PlaceInstances(const JsonObject& instancing, const Transform& to_world,
                      std::vector<Transform>& places);
  void ReadSkins();

  const GltfDocument& document_;
  GltfBuffers& buffers_;
  GltfBudget& budget_;
  GltfPlaces places_;
  std::vector<std::optional<Transform>> node_to_world_;  // for skins
};

std::vector<std::size_t> NodeWalk::Roots() const {
  if (document_.Count("scenes") > 0) {
    const std::size_t scene = document_.Root().Index("scene", "scenes").value_or(0);
    return document_.At("scenes", scene).Indices("nodes", "nodes");
  }
  // A file without scenes shows all of its nodes.
  std::vector<bool> is_child(document_.Count("nodes"));
  for (std::size_t i = 0; i < is_child.size(); ++i) {
    for (const std::size_t child : document_.At("nodes", i).Indices("children", "nodes"))
      is_child[child] = true;
  }
  std::vector<std::size_t> roots;
  for (std::size_t i = 0; i < is_child.size(); ++i) {
    if (!is_child[i]) roots.push_back(i);
  }
  return roots;
}

void NodeWalk::PlaceInstances(const JsonObject& instancing, const Transform& to_world,
                              std::vector<Transform>& places) {
  const JsonObject attributes = instancing.Child("attributes");
  constexpr std::array kNames = {"TRANSLATION", "ROTATION", "SCALE"};
  std::array<const GltfAccessor*, 3> parts{};
  std::optional<std::size_t> count;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (!attributes.Has(kNames[i])) continue;
    const std::optional<std::size_t> index = attributes.Index(kNames[i], "accessors");
    if (!index.has_value()) return;
    parts[i] = buffers_.Open(*index, i == 1 ? GltfUse::kVec4 : GltfUse::kVec3);
    if (parts[i] == nullptr) return;
    if (count.value_or(parts[i]->count()) != parts[i]->count()) {
      attributes.Error("its accessors must have the same count");
      return;
    }
    count = parts[i]->count();
  }
  if (!count.has_value()) {
    instancing.Error("needs attributes TRANSLATION, ROTATION or SCALE");
    return;
  }
  if (!budget_.Take(0, *count * kInstanceBytes)) return;
  for (std::size_t i = 0; i < *count; ++i) {
    const auto part = [&](std::size_t which, const std::array<double, 4>& otherwise) {
      return parts[which] == nullptr ? otherwise : parts[which]->At(i);
    };
    const std::array<double, 4> t = part(0, {0, 0, 0, 0});
    const std::array<double, 4> s = part(2, {1, 1, 1, 0});
    const std::optional<Transform> turn = TurnBy(part(1, {0, 0, 0, 1}));
    if (!turn.has_value()) {
      attributes.Error(Concat("ROTATION of instance ", i, " is a quaternion without a length"));
      return;
    }
    const Transform placed = to_world * Transform::Translate(t[0], t[1], t[2]) * *turn *
                             Transform::Scale(s[0], s[1], s[2]);
    if (!placed.IsFinite()) {
      attributes.Error(Concat("the transform of instance ", i, " is not finite"));
      return;
    }
    places.push_back(placed);
  }
}

void NodeWalk::PlaceMesh(const JsonObject& node, std::size_t mesh, const Transform& to_world) {
  const std::optional<std::size_t> skin = node.Index("skin", "skins");
  if (node.Has("skin") && !skin.has_value()) return;
  const GltfShape shape = {mesh, node.NumberList("weights", kJsonAnyNumber), skin};
  const JsonObject instancing = ExtensionOf(node, "EXT_mesh_gpu_instancing");
  if (instancing.exists() && skin.has_value()) {
    node.Warning("has a skin, so its instances (EXT_mesh_gpu_instancing) are left out");
  } else if (instancing.exists()) {
    PlaceInstances(instancing, to_world, places_.meshes[shape]);
    return;
  }
  if (budget_.Take(0, kInstanceBytes)) places_.meshes[shape].push_back(to_world);
}

std::optional<Transform> NodeWalk::Visit(const JsonObject& node, const Open& open) {
  const std::optional<Transform> local = LocalTransform(node);
  if (!local.has_value()) return std::nullopt;
  const Transform to_world = open.parent * *local;
  if (!to_world.IsFinite()) {
    node.Error("its transform in the scene is not finite");
    return std::nullopt;
  }
  if (!node_to_world_.empty()) node_to_world_[open.node] = to_world;
  if (const auto camera = node.Index("camera", "cameras"))
    places_.cameras.push_back({*camera, to_world});
  if (!open.is_visible) return to_world;
  if (const auto mesh = node.Index("mesh", "meshes")) PlaceMesh(node, *mesh, to_world);
  const JsonObject light = ExtensionOf(node, "KHR_lights_punctual");
  // Its array is not at the top of the document, so its range is checked by who reads the lights.
  if (const auto index = light.Whole("light")) places_.lights.push_back({*index, to_world});
  return to_world;
}

void NodeWalk::ReadSkins() {
  for (const auto& [shape, places] : places_.meshes) {
    if (!shape.skin.has_value() || places_.joints.contains(*shape.skin)) continue;
    std::optional<std::vector<Transform>> joints =
        ReadGltfSkin(document_, *shape.skin, buffers_, budget_, node_to_world_);
    if (joints.has_value()) places_.joints.emplace(*shape.skin, *std::move(joints));
  }
}

GltfPlaces NodeWalk::Walk() {
  std::vector<bool> is_visited(document_.Count("nodes"));
  std::vector<Open> open;
  const auto push = [&](const std::vector<std::size_t>& nodes, const Transform& parent,
                        bool is_visible) {
    // The first is to be popped first.
    for (auto node = nodes.rbegin(); node != nodes.rend(); ++node)
      open.push_back({*node, parent, is_visible});
  };
  push(Roots(), Transform(), true);
  while (!open.empty() && !budget_.is_spent()) {
    Open next = open.back();
    open.pop_back();
    const JsonObject node = document_.At("nodes", next.node);
    if (is_visited[next.node]) {
      node.Error("is reached twice: each node has one parent, and none is its own ancestor");
      continue;
    }
    is_visited[next.node] = true;
    next.is_visible =
        next.is_visible && ExtensionOf(node, "KHR_node_visibility").Bool("visible", true);
    if (const std::optional<Transform> to_world = Visit(node, next))
      push(node.Indices("children", "nodes"), *to_world, next.is_visible);
  }
  // Joints may come after the meshes that follow them. After an error some may be missing.
  if (!document_.diagnostics().has_error()) ReadSkins();
  return std::move(places_);
}

}  // namespace

GltfPlaces WalkNodes(const GltfDocument& document, GltfBuffers& buffers, GltfBudget& budget) {
  return NodeWalk(document, buffers, budget).Walk();
}

}  // namespace lucerna
