#include "render/formats/gltf/skins.h"

#include <cmath>

#include "render/base/text.h"

namespace lucerna {

std::optional<Transform> AffineOf(const std::array<double, 16>& columns) {
  constexpr double kRounding = 1e-4;
  std::array<std::array<double, 4>, 4> rows{};
  for (std::size_t i = 0; i < 16; ++i)
    rows[i % 4][i / 4] = columns[i];
  constexpr std::array<double, 4> kFourthRow = {0, 0, 0, 1};
  for (std::size_t i = 0; i < 4; ++i) {
    if (!(std::abs(rows[3][i] - kFourthRow[i]) <= kRounding)) return std::nullopt;
  }
  rows[3] = kFourthRow;
  return Transform(rows);
}

std::optional<std::vector<Transform>> ReadGltfSkin(
    const GltfDocument& document, std::size_t skin, GltfBuffers& buffers, GltfBudget& budget,
    const std::vector<std::optional<Transform>>& node_to_world) {
  const JsonObject object = document.At("skins", skin);
  const Diagnostics& diagnostics = document.diagnostics();
  const std::size_t errors = diagnostics.CountOf(Diagnostic::Severity::kError);
  const std::vector<std::size_t> nodes = object.Indices("joints", "nodes");
  if (nodes.empty()) {
    const bool is_reported = diagnostics.CountOf(Diagnostic::Severity::kError) > errors;
    if (!is_reported) object.Error("needs joints, the numbers of nodes");
    return std::nullopt;
  }
  if (!budget.Take(0, nodes.size() * sizeof(Transform))) return std::nullopt;
  const GltfAccessor* inverse_binds = nullptr;
  if (object.Has("inverseBindMatrices")) {
    const std::optional<std::size_t> index = object.Index("inverseBindMatrices", "accessors");
    if (index.has_value()) inverse_binds = buffers.Open(*index, GltfUse::kMat4);
    if (inverse_binds == nullptr) return std::nullopt;
    if (inverse_binds->count() < nodes.size()) {
      object.Error(Concat("has ", nodes.size(), " joints and ", inverse_binds->count(),
                          " inverseBindMatrices"));
      return std::nullopt;
    }
  }
  std::vector<Transform> joints;
  joints.reserve(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!node_to_world[nodes[i]].has_value()) {
      object.Error(Concat("joints[", i, "] is nodes[", nodes[i], "], which is not in the scene"));
      return std::nullopt;
    }
    const std::optional<Transform> inverse_bind =
        inverse_binds != nullptr ? AffineOf(inverse_binds->MatrixAt(i)) : Transform();
    if (!inverse_bind.has_value()) {
      object.Error(Concat("inverseBindMatrices[", i,
                          "] must be affine: its fourth row, numbers 4, 8, 12 and 16, must be "
                          "0 0 0 1"));
      return std::nullopt;
    }
    joints.push_back(*node_to_world[nodes[i]] * *inverse_bind);
    if (!joints.back().IsFinite()) {
      object.Error(Concat("the transform of joints[", i, "] is not finite"));
      return std::nullopt;
    }
  }
  return joints;
}

}  // namespace lucerna
