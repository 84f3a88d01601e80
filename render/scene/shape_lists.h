// Shapes of a scene, for code that treats all kinds alike.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "render/scene/scene.h"

namespace lucerna {

// The kinds of analytic shape (scene/analytic_shapes.h), in the order of their rows.
#define LUCERNA_KIND(Name, list, name) k##Name,
enum class ShapeKind : std::uint8_t { LUCERNA_ANALYTIC_SHAPES(LUCERNA_KIND) };
#undef LUCERNA_KIND

#define LUCERNA_COUNT(Name, list, name) +1
inline constexpr std::uint32_t kShapeKinds = 0 LUCERNA_ANALYTIC_SHAPES(LUCERNA_COUNT);
#undef LUCERNA_COUNT

// "sphere".
[[nodiscard]] constexpr std::string_view NameOf(ShapeKind kind) {
  switch (kind) {
#define LUCERNA_CASE(Name, list, name) \
  case ShapeKind::k##Name:             \
    return name;
    LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  return {};
}

// Calls `visit` for the list of each kind of analytic shape, in their order. `Shapes`: a Scene, or
// anything with the same members.
template <typename Shapes, typename Visit>
void ForEachAnalyticList(Shapes& shapes, const Visit& visit) {
#define LUCERNA_VISIT(Name, list, name) visit(shapes.list);
  LUCERNA_ANALYTIC_SHAPES(LUCERNA_VISIT)
#undef LUCERNA_VISIT
}

// Calls `visit` for each analytic shape.
template <typename Shapes, typename Visit>
void ForEachAnalyticShape(Shapes& shapes, const Visit& visit) {
  ForEachAnalyticList(shapes, [&](auto& list) {
    for (auto& shape : list)
      visit(shape);
  });
}

// Returns visit(shape) of one analytic shape. Requires one that exists.
template <typename Visit>
decltype(auto) VisitShape(const Scene& scene, ShapeKind kind, std::uint32_t index,
                          const Visit& visit) {
  switch (kind) {
#define LUCERNA_CASE(Name, list, name) \
  case ShapeKind::k##Name:             \
    return visit(scene.list[index]);
    LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  __builtin_unreachable();
}

// Calls `visit` for the list of each kind of shape, in their order.
template <typename Shapes, typename Visit>
void ForEachShapeList(Shapes& shapes, const Visit& visit) {
  visit(shapes.meshes);
  ForEachAnalyticList(shapes, visit);
}

// Calls `visit` for the traits of each shape, and for those of the meshes that instances repeat.
template <typename Shapes, typename Visit>
void ForEachShapeTraits(Shapes& shapes, const Visit& visit) {
  if constexpr (requires { shapes.object_meshes; }) {
    for (auto& mesh : shapes.object_meshes)
      visit(mesh.traits);
  }
  ForEachShapeList(shapes, [&](auto& list) {
    for (auto& shape : list)
      visit(shape.traits);
  });
}

// Without instances.
[[nodiscard]] inline std::size_t ShapeCount(const Scene& scene) {
  std::size_t count = 0;
  ForEachShapeList(scene, [&](const auto& list) { count += list.size(); });
  return count;
}

}  // namespace lucerna
