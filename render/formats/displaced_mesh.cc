#include "render/formats/displaced_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "render/base/text.h"
#include "render/formats/mesh_placement.h"
#include "render/math/double3.h"

namespace lucerna {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

Vec3 Normalized(Double3 normal) {
  const double length = Length(normal);
  return length > 0 ? ToFloat(normal * (1 / length)) : Vec3{};
}

std::vector<Vec3> MeanNormals(const TriangleMesh& mesh) {
  std::vector<Double3> sums(mesh.positions.size());
  for (std::size_t triangle = 0; triangle < mesh.indices.size() / 3; ++triangle) {
    const Double3 face(Normalized(EdgeCross(mesh, triangle)));
    for (std::size_t corner = 0; corner < 3; ++corner) {
      Double3& sum = sums[mesh.indices[3 * triangle + corner]];
      sum = sum + face;
    }
  }
  std::vector<Vec3> normals(sums.size());
  std::ranges::transform(sums, normals.begin(), Normalized);
  return normals;
}

// Splits the triangles of a mesh, whose new vertices it appends.
class EdgeSplitter {
 public:
  EdgeSplitter(double edge_length, const Transform& to_world, TriangleMesh& mesh)
      : edge_length_(edge_length), to_world_(to_world), mesh_(mesh) {}

  // False with more than `most_triangles`.
  bool Split(std::size_t most_triangles) {
    if (!(LeastTriangles() <= static_cast<double>(most_triangles))) return false;
    std::vector<Triangle> open;
    const std::vector<std::uint32_t> indices = std::exchange(mesh_.indices, {});
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
      open.push_back({indices[i], indices[i + 1], indices[i + 2]});
      while (!open.empty()) {
        const Triangle triangle = open.back();
        open.pop_back();
        const auto [a, b, c] = LongestFirst(triangle);
        if (LengthOf(a, b) <= edge_length_) {
          mesh_.indices.insert(mesh_.indices.end(), triangle.begin(), triangle.end());
          continue;
        }
        if (mesh_.indices.size() / 3 + open.size() + 2 > most_triangles) return false;
        const std::uint32_t middle = MiddleOf(a, b);
        open.push_back({middle, b, c});
        open.push_back({a, middle, c});
      }
    }
    return true;
  }

 private:
  // At least so many there will be: the largest triangle without a longer edge is equilateral, and
  // none has more of an edge than the length. What cannot end well shall not take its time.
  [[nodiscard]] double LeastTriangles() const {
    const double largest_area = std::sqrt(3.0) / 4 * edge_length_ * edge_length_;
    double least = 0;
    for (std::size_t i = 0; i + 2 < mesh_.indices.size(); i += 3) {
      const auto [a, b, c] =
          LongestFirst({mesh_.indices[i], mesh_.indices[i + 1], mesh_.indices[i + 2]});
      const Double3 corner(to_world_.Point(mesh_.positions[a]));
      const Double3 along = Double3(to_world_.Point(mesh_.positions[b])) - corner;
      const Double3 to_third = Double3(to_world_.Point(mesh_.positions[c])) - corner;
      const double area = Length(Cross(along, to_third)) / 2;
      least += std::max({1.0, Length(along) / edge_length_, area / largest_area});
    }
    return least;
  }
  [[nodiscard]] double LengthOf(std::uint32_t a, std::uint32_t b) const {
    return Length(Double3(to_world_.Point(mesh_.positions[a])) -
                  Double3(to_world_.Point(mesh_.positions[b])));
  }
  // Turned so that the edge between the first two is the longest.
  [[nodiscard]] Triangle LongestFirst(Triangle triangle) const {
    const auto [a, b, c] = triangle;
    const double ab = LengthOf(a, b);
    const double bc = LengthOf(b, c);
    const double ca = LengthOf(c, a);
    if (ab >= bc && ab >= ca) return triangle;
    return bc >= ca ? Triangle{b, c, a} : Triangle{c, a, b};
  }
  std::uint32_t MiddleOf(std::uint32_t a, std::uint32_t b) {
    const auto [low, high] = std::minmax(a, b);
    const auto [middle, is_new] = middles_.try_emplace(
        std::uint64_t{low} << 32 | high, static_cast<std::uint32_t>(mesh_.positions.size()));
    if (!is_new) return middle->second;
    mesh_.positions.push_back((mesh_.positions[low] + mesh_.positions[high]) * 0.5F);
    const Vec2 uv_low = mesh_.uvs[low];
    const Vec2 uv_high = mesh_.uvs[high];
    mesh_.uvs.push_back({(uv_low.x + uv_high.x) * 0.5F, (uv_low.y + uv_high.y) * 0.5F});
    mesh_.normals.push_back(Normalized(Double3(mesh_.normals[low]) + Double3(mesh_.normals[high])));
    return middle->second;
  }

  const double edge_length_;
  const Transform& to_world_;
  TriangleMesh& mesh_;
  std::unordered_map<std::uint64_t, std::uint32_t> middles_;  // of edges
};

}  // namespace

Status Displace(double edge_length, const Transform& to_world, std::size_t most_triangles,
                const HeightOf& height, TriangleMesh& mesh) {
  if (mesh.normals.empty()) mesh.normals = MeanNormals(mesh);
  if (!EdgeSplitter(edge_length, to_world, mesh).Split(most_triangles)) {
    return absl::ResourceExhaustedError(
        Concat("splits it into more than ", most_triangles,
               " triangles, which are more than the memory for shapes holds"));
  }
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    Vec3& position = mesh.positions[i];
    const Double3 moved = Double3(position) +
                          Double3(mesh.normals[i]) * height(position, mesh.uvs[i], mesh.normals[i]);
    position = ToFloat(moved);
    if (!IsFinite(position)) {
      return absl::InvalidArgumentError("moves a vertex out of the finite numbers");
    }
  }
  mesh.normals = MeanNormals(mesh);
  return absl::OkStatus();
}

}  // namespace lucerna
