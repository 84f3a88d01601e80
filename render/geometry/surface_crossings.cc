#include "render/geometry/surface_crossings.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>

#include "render/math/double3.h"
#include "render/scene/mesh_edges.h"
#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

constexpr std::size_t kMostSegments = std::size_t{1} << 22;
// Pairs of shapes whose boxes overlap, and per shape so many of boxes of the tree.
constexpr std::uint64_t kPairsPerShape = 256;
constexpr std::size_t kShapesPerLeaf = 4;
// With fewer on average a tree of the surfaces is no help.
constexpr std::size_t kShapesPerSurface = 8;
constexpr std::uint32_t kMixed = std::numeric_limits<std::uint32_t>::max();

struct Shape {
  Bounds bounds;
  std::uint32_t surface = 0;
  std::uint32_t index = 0;        // of the triangle among all, or the shape among its kind
  std::optional<ShapeKind> kind;  // absent: a triangle
};

struct Node {
  Bounds bounds;
  std::uint32_t surface = 0;  // of all shapes below, or kMixed
  std::uint32_t begin = 0, end = 0;
  std::uint32_t left = 0, right = 0;  // 0 and 0: a leaf
};

bool Overlap(const Bounds& a, const Bounds& b) {
  return a.low.x <= b.high.x && b.low.x <= a.high.x && a.low.y <= b.high.y && b.low.y <= a.high.y &&
         a.low.z <= b.high.z && b.low.z <= a.high.z;
}

void AddAll(Bounds& to, const Bounds& from) {
  to.Add(from.low);
  to.Add(from.high);
}

struct Triangle {
  std::array<Double3, 3> corners;
  Double3 normal;  // unit
};

struct Span {
  std::array<Double3, 2> ends;
};

// Where a triangle meets the plane through `origin`; absent where it lies on one side. A corner in
// the plane counts as above it.
std::optional<Span> CutByPlane(const Triangle& triangle, Double3 origin, Double3 normal) {
  std::array<double, 3> height;
  for (std::size_t i = 0; i < 3; ++i)
    height[i] = Dot(triangle.corners[i] - origin, normal);
  Span span;
  std::size_t count = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    if ((height[i] >= 0) == (height[j] >= 0)) continue;
    const double t = height[i] / (height[i] - height[j]);
    const Double3 along = triangle.corners[j] - triangle.corners[i];
    span.ends[count++] = triangle.corners[i] + along * t;
  }
  if (count < 2) return std::nullopt;
  return span;
}

// Shapes in a binary tree of boxes, which sorts them.
class ShapeTree {
 public:
  // Of at least one shape.
  explicit ShapeTree(std::vector<Shape> shapes) : shapes_(std::move(shapes)) {
    nodes_.reserve(2 * shapes_.size());
    Build(0, static_cast<std::uint32_t>(shapes_.size()));
  }

  [[nodiscard]] const std::vector<Shape>& shapes() const { return shapes_; }
  // The first is that of all shapes.
  [[nodiscard]] const std::vector<Node>& nodes() const { return nodes_; }

  // Whether the box of a shape of another surface overlaps that of `shape`.
  [[nodiscard]] bool IsNearOther(const Shape& shape, std::uint32_t number = 0) const {
    const Node& node = nodes_[number];
    if (node.surface == shape.surface || !Overlap(node.bounds, shape.bounds)) return false;
    if (node.left != 0) return IsNearOther(shape, node.left) || IsNearOther(shape, node.right);
    return std::any_of(
        shapes_.begin() + node.begin, shapes_.begin() + node.end, [&](const Shape& other) {
          return other.surface != shape.surface && Overlap(other.bounds, shape.bounds);
        });
  }

 private:
  // Halves at the middle shape along the widest axis of their centres.
  std::uint32_t Build(std::uint32_t begin, std::uint32_t end) {
    const auto number = static_cast<std::uint32_t>(nodes_.size());
    nodes_.emplace_back();
    Node node;
    node.begin = begin;
    node.end = end;
    node.surface = shapes_[begin].surface;
    Bounds centers;
    for (std::uint32_t i = begin; i < end; ++i) {
      AddAll(node.bounds, shapes_[i].bounds);
      centers.Add(shapes_[i].bounds.Center());
      if (shapes_[i].surface != node.surface) node.surface = kMixed;
    }
    if (end - begin > kShapesPerLeaf) {
      const Vec3 extent = centers.high - centers.low;
      const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0
                       : extent.y >= extent.z                       ? 1
                                                                    : 2;
      const std::uint32_t middle = begin + (end - begin) / 2;
      const auto at = [&](std::uint32_t i) { return shapes_.begin() + i; };
      std::nth_element(at(begin), at(middle), at(end), [axis](const Shape& a, const Shape& b) {
        return a.bounds.Center()[axis] < b.bounds.Center()[axis];
      });
      node.left = Build(begin, middle);
      node.right = Build(middle, end);
    }
    nodes_[number] = node;
    return number;
  }

  std::vector<Shape> shapes_;
  std::vector<Node> nodes_;
};

class Crossings {
 public:
  Crossings(const Scene& scene, const WeldedTriangles& triangles)
      : scene_(scene), positions_(triangles.positions), corners_(triangles.corners) {}

  std::vector<FeatureSegment> Find() {
    std::vector<Shape> shapes = Shapes();
    if (shapes.size() < 2) return {};
    most_pairs_ = kPairsPerShape * shapes.size() + (std::uint64_t{1} << 20);
    DropThoseAlone(shapes);
    if (shapes.empty()) return {};
    const ShapeTree tree(std::move(shapes));
    tree_ = &tree;
    Within(0);
    if (most_pairs_ == 0) return {};
    return std::move(segments_);
  }

 private:
  // Of all shapes, none where there are too many to number.
  [[nodiscard]] std::vector<Shape> Shapes() {
    const std::size_t analytic_count = ShapeCount(scene_) - scene_.meshes.size();
    if (std::max(positions_.size(), corners_.size()) + analytic_count >= kMixed) return {};
    const std::vector<std::uint32_t> surface_of = ConnectedSurfaces(corners_, positions_.size());
    std::vector<Shape> shapes;
    shapes.reserve(surface_of.size() + analytic_count);
    for (std::uint32_t i = 0; i < surface_of.size(); ++i) {
      Shape& shape = shapes.emplace_back();
      shape.surface = surface_of[i];
      shape.index = i;
      for (std::size_t k = 0; k < 3; ++k)
        shape.bounds.Add(positions_[corners_[3 * std::size_t{i} + k]]);
      surfaces_ = std::max(surfaces_, surface_of[i] + 1);
    }
    std::uint8_t kind = 0;
    ForEachAnalyticList(scene_, [&](const auto& list) {
      using Kind = typename std::decay_t<decltype(list)>::value_type;
      // What is thin ends no disc.
      for (std::uint32_t i = 0; i < list.size() && !Kind::kIsThin; ++i) {
        const Vec3 reach = {list[i].Reach(), list[i].Reach(), list[i].Reach()};
        shapes.push_back({{list[i].center - reach, list[i].center + reach},
                          surfaces_++,
                          i,
                          static_cast<ShapeKind>(kind)});
      }
      ++kind;
    });
    return shapes;
  }

  // Shapes that no other surface comes near, such as most of a ground on which objects stand: a
  // tree of the surfaces is much smaller than one of all shapes.
  void DropThoseAlone(std::vector<Shape>& shapes) const {
    if (shapes.size() / kShapesPerSurface < surfaces_) return;
    std::vector<Shape> surfaces(surfaces_);
    for (std::uint32_t i = 0; i < surfaces_; ++i)
      surfaces[i].surface = i;
    for (const Shape& shape : shapes)
      AddAll(surfaces[shape.surface].bounds, shape.bounds);
    const ShapeTree tree(std::move(surfaces));
    std::erase_if(shapes, [&](const Shape& shape) { return !tree.IsNearOther(shape); });
  }

  [[nodiscard]] bool IsOver() const { return most_pairs_ == 0; }

  void Within(std::uint32_t number) {
    const Node& node = tree_->nodes()[number];
    if (node.surface != kMixed || IsOver()) return;
    if (node.left == 0) {
      for (std::uint32_t i = node.begin; i < node.end; ++i) {
        for (std::uint32_t j = i + 1; j < node.end; ++j)
          Cross(tree_->shapes()[i], tree_->shapes()[j]);
      }
      return;
    }
    Within(node.left);
    Within(node.right);
    Between(node.left, node.right);
  }

  void Between(std::uint32_t one, std::uint32_t other) {
    const Node& a = tree_->nodes()[one];
    const Node& b = tree_->nodes()[other];
    if (IsOver() || (a.surface != kMixed && a.surface == b.surface) ||
        !Overlap(a.bounds, b.bounds)) {
      return;
    }
    --most_pairs_;
    if (a.left == 0 && b.left == 0) {
      for (std::uint32_t i = a.begin; i < a.end; ++i) {
        for (std::uint32_t j = b.begin; j < b.end; ++j)
          Cross(tree_->shapes()[i], tree_->shapes()[j]);
      }
    } else if (b.left == 0 || (a.left != 0 && a.end - a.begin >= b.end - b.begin)) {
      Between(a.left, other);
      Between(a.right, other);
    } else {
      Between(one, b.left);
      Between(one, b.right);
    }
  }

  // False for a triangle without area.
  bool TriangleOf(const Shape& shape, Triangle& out) const {
    for (std::size_t k = 0; k < 3; ++k)
      out.corners[k] = Double3(positions_[corners_[3 * std::size_t{shape.index} + k]]);
    const Double3 normal =
        ::lucerna::Cross(out.corners[1] - out.corners[0], out.corners[2] - out.corners[0]);
    const double length = Length(normal);
    if (!(length > 0)) return false;
    out.normal = normal * (1 / length);
    return true;
  }

  void Add(Double3 a, Double3 b) {
    if (segments_.size() == kMostSegments) most_pairs_ = 0;
    const FeatureSegment segment = {{ToFloat(a), ToFloat(b)}};
    if (!IsOver() && !(segment.ends[0] == segment.ends[1])) segments_.push_back(segment);
  }

  // The order of the two must not be seen.
  void Cross(const Shape& one, const Shape& other) {
    if (one.surface == other.surface || !Overlap(one.bounds, other.bounds)) return;
    const auto order = [](const Shape& s) { return std::pair(s.kind, s.index); };
    const Shape& a = order(one) < order(other) ? one : other;
    const Shape& b = &a == &one ? other : one;
    if (!b.kind.has_value()) {
      Triangle first;
      Triangle second;
      if (TriangleOf(a, first) && TriangleOf(b, second)) CrossTriangles(first, second);
    } else if (!a.kind.has_value()) {
      Triangle triangle;
      if (!TriangleOf(a, triangle)) return;
      VisitShape(scene_, *b.kind, b.index,
                 [&](const auto& shape) { CrossTriangle(triangle, shape); });
    } else {
      VisitShape(scene_, *a.kind, a.index, [&](const auto& first) {
        VisitShape(scene_, *b.kind, b.index,
                   [&](const auto& second) { CrossShapes(first, second); });
      });
    }
  }

  // Both meet the line in which their planes cross in a span; what the spans have in common.
  void CrossTriangles(const Triangle& a, const Triangle& b) {
    const Double3 line = ::lucerna::Cross(a.normal, b.normal);
    if (!(Length(line) > 1e-4)) return;
    const std::optional<Span> of_a = CutByPlane(a, b.corners[0], b.normal);
    if (!of_a) return;
    const std::optional<Span> of_b = CutByPlane(b, a.corners[0], a.normal);
    if (!of_b) return;
    const auto ordered = [&](const Span& span) {
      return Dot(span.ends[0], line) <= Dot(span.ends[1], line)
                 ? span
                 : Span{{span.ends[1], span.ends[0]}};
    };
    const Span p = ordered(*of_a);
    const Span q = ordered(*of_b);
    const Double3 begin = Dot(p.ends[0], line) >= Dot(q.ends[0], line) ? p.ends[0] : q.ends[0];
    const Double3 end = Dot(p.ends[1], line) <= Dot(q.ends[1], line) ? p.ends[1] : q.ends[1];
    if (Dot(end, line) > Dot(begin, line)) Add(begin, end);
  }

  template <typename AnalyticShape>
  void CrossTriangle(const Triangle& triangle, const AnalyticShape& shape) {
    if constexpr (AnalyticShape::kIsThin) {
      return;
    } else if constexpr (AnalyticShape::kIsFlat) {
      const std::optional<Span> span =
          CutByPlane(triangle, Double3(shape.center), Double3(shape.normal));
      if (!span) return;
      const Double3 along = span->ends[1] - span->ends[0];
      double begin = 0;
      double end = 1;
      if (ClipToShape(shape, span->ends[0], along, begin, end))
        Add(span->ends[0] + along * begin, span->ends[0] + along * end);
    } else {
      for (const LinePiece& piece :
           ::lucerna::CutByPlane(shape, triangle.corners[0], triangle.normal)) {
        AddWithin(triangle, piece);
        if (IsOver()) return;
      }
    }
  }

  // A curved and a flat shape; two of either are not crossed.
  template <typename One, typename Other>
  void CrossShapes(const One& one, const Other& other) {
    if constexpr (One::kIsThin || Other::kIsThin) {
      return;
    } else if constexpr (One::kIsFlat && !Other::kIsFlat) {
      CrossShapes(other, one);
    } else if constexpr (!One::kIsFlat && Other::kIsFlat) {
      for (const LinePiece& piece :
           ::lucerna::CutByPlane(one, Double3(other.center), Double3(other.normal))) {
        // A short piece is taken whole when its middle is within the shape.
        double begin = 0;
        double end = 1;
        if (ClipToShape(other, piece.from, piece.along, begin, end) && begin <= 0.5 && end >= 0.5)
          Add(piece.from, piece.from + piece.along);
        if (IsOver()) return;
      }
    }
  }

  // What of the piece, which lies in the triangle's plane, is within the triangle.
  void AddWithin(const Triangle& triangle, const LinePiece& piece) {
    double begin = 0;
    double end = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      const Double3 side = triangle.corners[(k + 1) % 3] - triangle.corners[k];
      const Double3 inward = ::lucerna::Cross(triangle.normal, side);
      const double at = Dot(piece.from - triangle.corners[k], inward);
      const double rise = Dot(piece.along, inward);
      if (rise > 0) {
        begin = std::max(begin, -at / rise);
      } else if (rise < 0) {
        end = std::min(end, -at / rise);
      } else if (at < 0) {
        end = 0;
      }
    }
    if (begin < end) Add(piece.from + piece.along * begin, piece.from + piece.along * end);
  }

  const Scene& scene_;
  const std::vector<Vec3>& positions_;
  const std::vector<std::uint32_t>& corners_;
  std::uint32_t surfaces_ = 0;
  const ShapeTree* tree_ = nullptr;
  std::uint64_t most_pairs_ = 0;
  std::vector<FeatureSegment> segments_;
};

}  // namespace

std::vector<FeatureSegment> SurfaceCrossings(const Scene& scene, const WeldedTriangles& triangles) {
  return Crossings(scene, triangles).Find();
}

}  // namespace lucerna
