#include "client/bake/baked_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "render/math/double3.h"

namespace lucerna {
namespace {

constexpr std::size_t kFewTriangles = 4;
// Normals of faces and of the surface that they stand for may differ by 60 degrees.
constexpr double kSameWay = 0.5;
// A triangle's middle lies so many of its edges below a curved surface, at most; of another
// material no more than rounding does.
constexpr double kReach = 0.25;
constexpr double kReachOfAny = 1e-3;

// The shares of the corners a, b and c at the point of the triangle that is nearest to p. After
// Ericson 2005, "Real-Time Collision Detection", section 5.1.5.
std::array<double, 3> NearestShares(Double3 p, Double3 a, Double3 b, Double3 c) {
  const Double3 ab = b - a;
  const Double3 ac = c - a;
  const double d1 = Dot(ab, p - a);
  const double d2 = Dot(ac, p - a);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const double d3 = Dot(ab, p - b);
  const double d4 = Dot(ac, p - b);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double of_c = d1 * d4 - d3 * d2;
  if (of_c <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  const double d5 = Dot(ab, p - c);
  const double d6 = Dot(ac, p - c);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double of_b = d5 * d2 - d1 * d6;
  if (of_b <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  const double of_a = d3 * d6 - d5 * d4;
  if (of_a <= 0 && d4 >= d3 && d5 >= d6) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - t, t};
  }
  const double sum = of_a + of_b + of_c;
  return {of_a / sum, of_b / sum, of_c / sum};
}

double SquaredDistance(const Bounds& box, Vec3 p) {
  const auto off = [](float low, float high, float at) {
    return static_cast<double>(std::max({low - at, at - high, 0.0F}));
  };
  const double x = off(box.low.x, box.high.x, p.x);
  const double y = off(box.low.y, box.high.y, p.y);
  const double z = off(box.low.z, box.high.z, p.z);
  return x * x + y * y + z * z;
}

}  // namespace

BakedLight::BakedLight(const BakedMesh& mesh) : mesh_(mesh) {
  for (std::uint32_t surface = 0; surface < mesh.surfaces.size(); ++surface) {
    Tree& tree = of_material_[mesh.surfaces[surface].material];
    for (std::uint32_t face = 0; face < mesh.surfaces[surface].faces.size(); ++face) {
      tree.triangles.push_back({surface, face});
      all_.triangles.push_back({surface, face});
    }
  }
  for (auto& [material, tree] : of_material_)
    Build(tree, 0, tree.triangles.size());
  Build(all_, 0, all_.triangles.size());
}

void BakedLight::Build(Tree& tree, std::size_t first, std::size_t count) const {
  const std::size_t number = tree.nodes.size();
  Node node;
  Bounds middles;
  const auto middle_of = [&](const Triangle& triangle) {
    return (CornerOf(triangle, 0) + CornerOf(triangle, 1) + CornerOf(triangle, 2)) * (1.0F / 3);
  };
  for (std::size_t i = first; i < first + count; ++i) {
    for (const std::size_t corner : {0U, 1U, 2U})
      node.box.Add(CornerOf(tree.triangles[i], corner));
    middles.Add(middle_of(tree.triangles[i]));
  }
  node.first = static_cast<std::uint32_t>(first);
  if (count <= kFewTriangles) {
    node.count = static_cast<std::uint32_t>(count);
    tree.nodes.push_back(node);
    return;
  }
  tree.nodes.push_back(node);
  const Vec3 size = middles.high - middles.low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const auto along = [&](const Triangle& triangle) {
    const Vec3 at = middle_of(triangle);
    return std::tuple(axis == 0 ? at.x : axis == 1 ? at.y : at.z, triangle.surface, triangle.face);
  };
  const std::size_t half = count / 2;
  const auto begin = tree.triangles.begin() + static_cast<std::ptrdiff_t>(first);
  std::nth_element(begin, begin + static_cast<std::ptrdiff_t>(half),
                   begin + static_cast<std::ptrdiff_t>(count),
                   [&](const Triangle& a, const Triangle& b) { return along(a) < along(b); });
  Build(tree, first, half);
  tree.nodes[number].second_half = static_cast<std::uint32_t>(tree.nodes.size());
  Build(tree, first + half, count - half);
}

std::optional<BakedLight::Nearest> BakedLight::Find(const Tree& tree, Vec3 position, Vec3 normal,
                                                    double reach) const {
  std::optional<Nearest> nearest;
  const Double3 p(position);
  const auto look_at = [&](const Triangle& triangle) {
    const std::array<Double3, 3> corners = {Double3(CornerOf(triangle, 0)),
                                            Double3(CornerOf(triangle, 1)),
                                            Double3(CornerOf(triangle, 2))};
    const Double3 cross = Cross(corners[1] - corners[0], corners[2] - corners[0]);
    if (!(Dot(cross, Double3(normal)) > kSameWay * Length(cross))) return;
    const std::array<double, 3> shares = NearestShares(p, corners[0], corners[1], corners[2]);
    const Double3 off =
        corners[0] * shares[0] + corners[1] * shares[1] + corners[2] * shares[2] - p;
    const double squared = Dot(off, off);
    if (nearest && !(squared < nearest->squared_distance)) return;
    double longest = 0;
    for (std::size_t i = 0; i < 3; ++i)
      longest = std::max(longest, Length(corners[(i + 1) % 3] - corners[i]));
    if (!(squared <= reach * reach * longest * longest)) return;
    nearest = Nearest{triangle, squared, {shares[0], shares[1], shares[2]}};
  };
  std::vector<std::uint32_t> open = {0};
  while (!open.empty()) {
    const std::uint32_t number = open.back();
    open.pop_back();
    const Node& node = tree.nodes[number];
    // No triangle reaches farther than the box that holds it is wide.
    const double box = SquaredDistance(node.box, position);
    const auto width = static_cast<double>(node.box.Diagonal());
    if (box > (nearest ? nearest->squared_distance : reach * reach * width * width)) continue;
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
      look_at(tree.triangles[i]);
    if (node.count > 0) continue;
    if (node.second_half == 0) continue;  // of no triangles
    const std::uint32_t first_half = number + 1;
    const bool is_first_nearer = SquaredDistance(tree.nodes[first_half].box, position) <=
                                 SquaredDistance(tree.nodes[node.second_half].box, position);
    open.push_back(is_first_nearer ? node.second_half : first_half);
    open.push_back(is_first_nearer ? first_half : node.second_half);
  }
  return nearest;
}

Rgb BakedLight::IrradianceAt(const Nearest& nearest) const {
  const BakedMesh::Surface& surface = mesh_.surfaces[nearest.triangle.surface];
  const auto face_at = [&](std::uint32_t face) { return surface.faces[face]; };
  const auto& shares = nearest.shares;
  const auto weighed = [&](std::uint32_t vertex, double weight) {
    return surface.irradiance[vertex] * static_cast<float>(weight);
  };
  const auto& face = face_at(nearest.triangle.face);
  if (!mesh_.is_quadratic) {
    return weighed(face[0], shares[0]) + weighed(face[1], shares[1]) + weighed(face[2], shares[2]);
  }
  // Of the element's corners.
  std::array<double, 3> l{};
  constexpr std::array<std::array<std::array<double, 3>, 3>, 4> kParts = {{
      {{{1, 0, 0}, {.5, .5, 0}, {.5, 0, .5}}},
      {{{.5, .5, 0}, {0, 1, 0}, {0, .5, .5}}},
      {{{.5, 0, .5}, {0, .5, .5}, {0, 0, 1}}},
      {{{.5, .5, 0}, {0, .5, .5}, {.5, 0, .5}}},
  }};
  const std::uint32_t first = nearest.triangle.face / 4 * 4;
  for (std::size_t corner = 0; corner < 3; ++corner) {
    for (std::size_t i = 0; i < 3; ++i)
      l[i] += shares[corner] * kParts[nearest.triangle.face % 4][corner][i];
  }
  const auto& middle = face_at(first + 3);  // ab, bc, ca
  Rgb sum;
  for (std::size_t i = 0; i < 3; ++i) {
    sum += weighed(face_at(first + static_cast<std::uint32_t>(i))[i], l[i] * (2 * l[i] - 1));
    sum += weighed(middle[i], 4 * l[i] * l[(i + 1) % 3]);
  }
  // Quadratic functions swing below 0 beside sharp borders.
  return {std::max(sum.r, 0.0F), std::max(sum.g, 0.0F), std::max(sum.b, 0.0F)};
}

std::optional<Rgb> BakedLight::At(const std::string& material, Vec3 position, Vec3 normal) const {
  std::optional<Nearest> nearest;
  if (const auto tree = of_material_.find(material); tree != of_material_.end()) {
    nearest = Find(tree->second, position, normal, kReach);
  }
  // Of a mix, a path has met one of its materials, and the mesh names the mix.
  if (!nearest) nearest = Find(all_, position, normal, kReachOfAny);
  if (!nearest) return std::nullopt;
  return IrradianceAt(*nearest);
}

}  // namespace lucerna
