#include "render/geometry/curvature.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <type_traits>
#include <utility>

#include "render/geometry/curvature_change.h"
#include "render/math/double3.h"
#include "render/scene/mesh_edges.h"
#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

// What the rounding of a unit normal to float, and of the transform before it, may add to the
// difference of two.
constexpr double kNormalRounding = 0x1p-22;

// Keeps products of a few results within float.
constexpr double kLargest = 1e30;

// A curvature above this is not one of the surface: its radius would be less than ten times what
// rounding makes of positions.
double LargestCurvature(double clearance) {
  return std::min(0.1 / clearance, kLargest);
}

// Between the places where the change of curvature is fitted it may be larger, on a mesh with 16
// sides to a wave by so much.
constexpr double kSlack = 1.15;

// A triangle's plane and the curvature fitted in it.
struct Fit {
  Double3 normal;
  Double3 center;
  // The symmetric tensor by its entries, in world space.
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
  double rounding = 0;  // how much of the curvature may be rounding
  double largest = 0;   // bound of what counts as a curvature here
  bool is_curved = false;

  [[nodiscard]] double Along(Double3 a, Double3 b) const {
    return a.x * (xx * b.x + xy * b.y + xz * b.z) + a.y * (xy * b.x + yy * b.y + yz * b.z) +
           a.z * (xz * b.x + yz * b.y + zz * b.z);
  }
};

// The eigenvalue of [[a, b], [b, c]] that is largest in magnitude, without its sign.
double SpectralNorm(double a, double b, double c) {
  return 0.5 * (std::abs(a + c) + std::sqrt((a - c) * (a - c) + 4 * b * b));
}

// The second fundamental form [[a, b], [b, c]] in the frame of the longest side, by least squares
// over the three sides: form · side = difference of the normals at its ends.
Fit FitTriangle(const std::array<Vec3, 3>& corners, std::array<Vec3, 3> corner_normals) {
  Fit fit;
  std::array<Double3, 3> p;
  std::array<Double3, 3> n;
  for (std::size_t i = 0; i < 3; ++i) {
    p[i] = Double3(corners[i]);
    n[i] = Double3(corner_normals[i]);
    if (!(Dot(n[i], n[i]) > 0.5)) return fit;
  }
  fit.center = (p[0] + p[1] + p[2]) * (1.0 / 3);
  const Double3 cross = Cross(p[1] - p[0], p[2] - p[0]);
  const double twice_area = Length(cross);
  std::array<Double3, 3> side;
  double longest = 0;
  Double3 along;
  for (std::size_t i = 0; i < 3; ++i) {
    side[i] = p[(i + 1) % 3] - p[i];
    const double length = Length(side[i]);
    if (length > longest) {
      longest = length;
      along = side[i] * (1 / length);
    }
  }
  // Thinner than the grid that its corners lie on.
  if (!(twice_area > 1e-6 * longest * longest)) return fit;
  const double height = twice_area / longest;
  fit.normal = cross * (1 / twice_area);
  const Double3 across = Cross(fit.normal, along);
  // Rays see the shading normal on the side of the triangle's own (Intersector::SurfaceAt).
  const double sign = Dot(n[0] + n[1] + n[2], fit.normal) < 0 ? -1 : 1;

  double s_xx = 0, s_xy = 0, s_yy = 0, r_a = 0, r_b = 0, r_c = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Double3 turn = (n[(i + 1) % 3] - n[i]) * sign;
    const double x = Dot(side[i], along), y = Dot(side[i], across);
    const double u = Dot(turn, along), v = Dot(turn, across);
    s_xx += x * x;
    s_xy += x * y;
    s_yy += y * y;
    r_a += x * u;
    r_b += y * u + x * v;
    r_c += y * v;
  }
  // A weak pull towards 0 decides what a needle of a triangle leaves open.
  const double ridge = 1e-8 * longest * longest;
  s_xx += ridge;
  s_yy += ridge;
  double b = (r_b - s_xy * r_a / s_xx - s_xy * r_c / s_yy) /
             (s_xx + s_yy - s_xy * s_xy / s_xx - s_xy * s_xy / s_yy);
  double a = (r_a - s_xy * b) / s_xx;
  double c = (r_c - s_xy * b) / s_yy;

  const double clearance =
      static_cast<double>(kClearance * (MaxAbs(corners[0]) + MaxAbs(corners[1] - corners[0]) +
                                        MaxAbs(corners[2] - corners[0])));
  fit.largest = LargestCurvature(clearance);
  const double norm = SpectralNorm(a, b, c);
  if (norm > fit.largest) {
    a *= fit.largest / norm;
    b *= fit.largest / norm;
    c *= fit.largest / norm;
  }
  fit.rounding = (kNormalRounding + std::min(norm, fit.largest) * clearance) / height;
  const auto entry = [&](double i, double j, double k, double l) {
    return a * i * j + b * (i * l + k * j) + c * k * l;
  };
  fit.xx = entry(along.x, along.x, across.x, across.x);
  fit.yy = entry(along.y, along.y, across.y, across.y);
  fit.zz = entry(along.z, along.z, across.z, across.z);
  fit.xy = entry(along.x, along.y, across.x, across.y);
  fit.xz = entry(along.x, along.z, across.x, across.z);
  fit.yz = entry(along.y, along.z, across.y, across.z);
  fit.is_curved = true;
  return fit;
}

// Of the curvature per length.
struct Change {
  double largest = 0;
  double certain = 0;  // what rounding alone does not explain

  void Include(Change other) {
    largest = std::max(largest, other.largest);
    certain = std::max(certain, other.certain);
  }
};

// How fast the curvature changes from one triangle to the next across the edge `along` (unit).
// The tensors are compared in frames that share the edge, as if the two were unfolded into one
// plane: so a sphere's do not differ.
Change ChangeAcross(const Fit& one, const Fit& other, Double3 along) {
  const Double3 across_one = Cross(one.normal, along);
  const Double3 across_other = Cross(other.normal, along);
  const double change =
      SpectralNorm(one.Along(along, along) - other.Along(along, along),
                   one.Along(along, across_one) - other.Along(along, across_other),
                   one.Along(across_one, across_one) - other.Along(across_other, across_other));
  const double distance = Length(one.center - other.center);
  if (!(distance > 0)) return {};
  return {change / distance, std::max(0.0, change - one.rounding - other.rounding) / distance};
}

// The sides around a vertex.
struct Ring {
  Change change;
  double length_sum = 0;
  double length_count = 0;
};

}  // namespace

SurfaceCurvature::SurfaceCurvature(const Scene& scene, const Choice& is_wanted,
                                   const Choice& is_change_wanted)
    : scene_(scene) {
  first_.reserve(scene.meshes.size());
  for (const TriangleMesh& mesh : scene.meshes) {
    const Material& material = scene.materials[static_cast<std::size_t>(mesh.traits.material)];
    if (mesh.normals.empty() || !is_wanted(material)) {
      first_.push_back(-1);
      continue;
    }
    first_.push_back(static_cast<std::int64_t>(bendings_.size()));
    AddMesh(mesh, is_change_wanted(material));
  }
}

void SurfaceCurvature::AddMesh(const TriangleMesh& mesh, bool with_change) {
  const std::size_t count = mesh.indices.size() / 3;
  std::vector<Fit> fits;
  fits.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t* corner = &mesh.indices[3 * i];
    fits.push_back(FitTriangle(
        {mesh.positions[corner[0]], mesh.positions[corner[1]], mesh.positions[corner[2]]},
        {mesh.normals[corner[0]], mesh.normals[corner[1]], mesh.normals[corner[2]]}));
  }

  for (const Fit& fit : fits) {
    Bending& bending = bendings_.emplace_back();
    if (!fit.is_curved) continue;
    bending.xx = static_cast<float>(fit.xx);
    bending.yy = static_cast<float>(fit.yy);
    bending.zz = static_cast<float>(fit.zz);
    bending.xy = static_cast<float>(fit.xy);
    bending.xz = static_cast<float>(fit.xz);
    bending.yz = static_cast<float>(fit.yz);
  }
  if (!with_change) return;

  // Triangles that share an edge, with the same normals at its ends: across a crease there is no
  // derivative.
  std::vector<std::uint32_t> corners = WeldVertices(mesh.positions, mesh.normals);
  {
    const std::vector<std::uint32_t> first = std::move(corners);
    corners.resize(mesh.indices.size());
    for (std::size_t i = 0; i < corners.size(); ++i)
      corners[i] = first[mesh.indices[i]];
  }
  std::vector<Ring> rings(mesh.positions.size());
  const std::vector<TriangleSide> all_sides = SidesByEdge(corners, mesh.positions.size());
  ForEachEdge(all_sides, [&](std::span<const TriangleSide> sides) {
    const std::uint32_t low = sides[0].low;
    const std::uint32_t high = sides[0].high;
    const Double3 edge = Double3(mesh.positions[high]) - Double3(mesh.positions[low]);
    const double length = Length(edge);
    if (!(length > 0)) return;
    Change change;
    if (sides.size() == 2) {
      const Fit& one = fits[sides[0].triangle()];
      const Fit& other = fits[sides[1].triangle()];
      if (one.is_curved && other.is_curved) {
        change = ChangeAcross(one, other, edge * (1 / length));
      }
    }
    for (const std::uint32_t vertex : {low, high}) {
      Ring& ring = rings[vertex];
      ring.change.Include(change);
      ring.length_sum += length;
      ring.length_count += 1;
    }
  });

  const std::vector<CurvatureChange> changes =
      CurvatureChanges(mesh.positions, mesh.normals, corners, all_sides);
  for (std::size_t i = 0; i < fits.size(); ++i) {
    const Fit& fit = fits[i];
    if (!fit.is_curved) continue;
    Bending& bending = bendings_[bendings_.size() - fits.size() + i];
    Change change;
    double length_sum = 0;
    double length_count = 0;
    CurvatureChange fitted;
    for (std::size_t k = 0; k < 3; ++k) {
      const Ring& ring = rings[corners[3 * i + k]];
      change.Include(ring.change);
      length_sum += ring.length_sum;
      length_count += ring.length_count;
      const CurvatureChange& at_corner = changes[corners[3 * i + k]];
      fitted.first = std::max(fitted.first, at_corner.first);
      fitted.second = std::max(fitted.second, at_corner.second);
      fitted.first_is_clear |= at_corner.first_is_clear;
      fitted.second_is_clear |= at_corner.second_is_clear;
    }
    // On a fine mesh rounding may explain any difference between neighbours: then only a change
    // that is clear from farther away is one. Neighbours lie in three directions, on a grid cut
    // along its diagonals at most 72 degrees apart: the steepest way is up to 36 degrees from all
    // of them.
    const double turned = 1 / std::cos(36 * std::numbers::pi / 180);
    const double first = turned * (fitted.first_is_clear ? change.largest : change.certain);
    bending.gradient = static_cast<float>(
        std::min({first, kSlack * fitted.first, fit.largest * fit.largest, kLargest}));
    // At a crest of the curvature its derivative goes from one end of the bound to the other, and a
    // ring sees that over about the length of a side.
    const double second = 2 * turned * (fitted.second_is_clear ? change.largest : change.certain) *
                          length_count / length_sum;
    bending.second_gradient = static_cast<float>(std::min(
        {second, kSlack * fitted.second, fit.largest * fit.largest * fit.largest, kLargest}));
  }
}

const SurfaceCurvature::Bending* SurfaceCurvature::BendingAt(const SurfacePoint& point) const {
  if (point.geometry >= first_.size() || first_[point.geometry] < 0) return nullptr;
  return &bendings_[static_cast<std::size_t>(first_[point.geometry]) + point.primitive];
}

PrincipalCurvatures SurfaceCurvature::AnalyticAt(const SurfacePoint& point) const {
  return VisitShape(scene_, KindOf(scene_, point.geometry), point.primitive,
                    [&](const auto& shape) -> PrincipalCurvatures {
                      if constexpr (std::decay_t<decltype(shape)>::kIsFlat) {
                        return {};
                      } else {
                        const auto limit = static_cast<float>(
                            LargestCurvature(static_cast<double>(ClearanceOf(shape))));
                        PrincipalCurvatures k = CurvatureOf(shape, point.position);
                        k.first = std::clamp(k.first, -limit, limit);
                        k.second = std::clamp(k.second, -limit, limit);
                        return k;
                      }
                    });
}

NormalCurvature SurfaceCurvature::Along(const SurfacePoint& point, Vec3 tangent) const {
  if (MeshOf(scene_, point.geometry) == nullptr) {
    const PrincipalCurvatures k = AnalyticAt(point);
    if (k.first == k.second) return {k.first, k.gradient, k.second_gradient};
    const Vec3 t = tangent - point.geometric_normal * Dot(tangent, point.geometric_normal);
    const float squared = LengthSquared(t);
    const float cosine = Dot(t, k.direction);
    // Euler's formula; without a direction the mean.
    const float share = squared > 1e-8F ? cosine * cosine / squared : 0.5F;
    return {k.second + (k.first - k.second) * share, k.gradient, k.second_gradient};
  }
  const Bending* bending = BendingAt(point);
  if (bending == nullptr) return {};
  const Bending& k = *bending;
  const Vec3 t = tangent - point.geometric_normal * Dot(tangent, point.geometric_normal);
  const float squared = LengthSquared(t);
  if (!(squared > 1e-8F)) return {0.5F * (k.xx + k.yy + k.zz), k.gradient, k.second_gradient};
  const float bent = t.x * (k.xx * t.x + k.xy * t.y + k.xz * t.z) +
                     t.y * (k.xy * t.x + k.yy * t.y + k.yz * t.z) +
                     t.z * (k.xz * t.x + k.yz * t.y + k.zz * t.z);
  return {bent / squared, k.gradient, k.second_gradient};
}

float SurfaceCurvature::SquaredPrincipals(const SurfacePoint& point) const {
  if (MeshOf(scene_, point.geometry) == nullptr) {
    const PrincipalCurvatures k = AnalyticAt(point);
    return std::min(k.first * k.first + k.second * k.second, static_cast<float>(kLargest));
  }
  const Bending* k = BendingAt(point);
  if (k == nullptr) return 0;
  const float sum = k->xx * k->xx + k->yy * k->yy + k->zz * k->zz +
                    2 * (k->xy * k->xy + k->xz * k->xz + k->yz * k->yz);
  return std::min(sum, static_cast<float>(kLargest));
}

}  // namespace lucerna
