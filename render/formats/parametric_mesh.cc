#include "render/formats/parametric_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "render/math/warp.h"

namespace lucerna {
namespace {

constexpr int kPatchSides = 16;

struct GridPoint {
  Double3 position;
  Double3 normal;  // of any length
  Vec2 uv;
};

// Appends columns × rows cells, whose corners are at(column, row). Triangles that a pole makes
// points are left out.
template <typename At>
void AddGrid(int columns, int rows, const At& at, TriangleMesh& mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (int row = 0; row <= rows; ++row) {
    for (int column = 0; column <= columns; ++column) {
      const GridPoint point = at(column, row);
      const double length = Length(point.normal);
      mesh.positions.push_back(ToFloat(point.position));
      mesh.normals.push_back(length > 0 ? ToFloat(point.normal * (1 / length)) : Vec3());
      mesh.uvs.push_back(point.uv);
    }
  }
  const auto number = [&](int column, int row) {
    return first + static_cast<std::uint32_t>(row * (columns + 1) + column);
  };
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const Vec3 p = mesh.positions[a];
    const Vec3 q = mesh.positions[b];
    const Vec3 r = mesh.positions[c];
    if (p == q || q == r || r == p) return;
    mesh.indices.insert(mesh.indices.end(), {a, b, c});
  };
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      add(number(column, row), number(column + 1, row), number(column + 1, row + 1));
      add(number(column, row), number(column + 1, row + 1), number(column, row + 1));
    }
  }
}

// A part of a turn: directions at its corners. The ends of a full turn are the same to the bit, so
// that the surface is closed there.
class Turn {
 public:
  explicit Turn(double phi_max_rad) : phi_max_rad_(phi_max_rad) {}

  [[nodiscard]] int sides() const {
    return std::max(1, static_cast<int>(std::ceil(kTurnSides * phi_max_rad_ / (2 * kPi64) - 1e-9)));
  }
  [[nodiscard]] Double3 At(int column) const {
    const bool is_closed = phi_max_rad_ >= 2 * kPi64 * (1 - 1e-9);
    const double phi = is_closed && column == sides() ? 0 : phi_max_rad_ * Share(column);
    return {std::cos(phi), std::sin(phi), 0};
  }
  [[nodiscard]] double Share(int column) const { return static_cast<double>(column) / sides(); }

 private:
  double phi_max_rad_;
};

double Mix(double a, double b, double t) {
  return a + (b - a) * t;
}

Double3 Mix(const std::array<Double3, 4>& corners, double u, double v) {
  return corners[0] * ((1 - u) * (1 - v)) + corners[1] * (u * (1 - v)) +
         corners[2] * ((1 - u) * v) + corners[3] * (u * v);
}

std::array<Double3, 4> CornersOf(const BilinearPatch& patch) {
  std::array<Double3, 4> corners;
  for (std::size_t i = 0; i < 4; ++i)
    corners[i] = Double3(patch.corners[i]);
  return corners;
}

// What a parallelogram does not have.
Double3 TwistOf(const std::array<Double3, 4>& p) {
  return p[0] - p[1] - p[2] + p[3];
}

}  // namespace

TriangleMesh SphereMesh(double radius, double z_min, double z_max, double phi_max_rad) {
  const Turn turn(phi_max_rad);
  const double low = std::acos(std::clamp(z_min / radius, -1.0, 1.0));
  const double high = std::acos(std::clamp(z_max / radius, -1.0, 1.0));
  const int rows =
      std::max(1, static_cast<int>(std::ceil(kTurnSides * (low - high) / (2 * kPi64))));
  TriangleMesh mesh;
  AddGrid(
      turn.sides(), rows,
      [&](int column, int row) {
        const double v = static_cast<double>(row) / rows;
        const double theta = Mix(low, high, v);
        // Poles are points, whatever the sine of pi is.
        const bool is_pole = theta < 1e-9 || theta > kPi64 - 1e-9;
        const Double3 outward =
            turn.At(column) * (is_pole ? 0 : std::sin(theta)) + Double3{0, 0, 1} * std::cos(theta);
        return GridPoint{outward * radius,
                         outward,
                         {static_cast<float>(turn.Share(column)), static_cast<float>(v)}};
      },
      mesh);
  return mesh;
}

TriangleMesh DiskMesh(double radius, double inner_radius, double height, double phi_max_rad) {
  const Turn turn(phi_max_rad);
  TriangleMesh mesh;
  AddGrid(
      turn.sides(), 1,
      [&](int column, int row) {
        const double from_axis = row == 0 ? radius : inner_radius;
        return GridPoint{turn.At(column) * from_axis + Double3{0, 0, height},
                         {0, 0, 1},
                         {static_cast<float>(turn.Share(column)), static_cast<float>(row)}};
      },
      mesh);
  return mesh;
}

TriangleMesh CylinderMesh(double radius, double z_min, double z_max, double phi_max_rad) {
  const Turn turn(phi_max_rad);
  TriangleMesh mesh;
  AddGrid(
      turn.sides(), 1,
      [&](int column, int row) {
        const Double3 outward = turn.At(column);
        return GridPoint{outward * radius + Double3{0, 0, row == 0 ? z_min : z_max},
                         outward,
                         {static_cast<float>(turn.Share(column)), static_cast<float>(row)}};
      },
      mesh);
  return mesh;
}

void AddBilinearPatch(const BilinearPatch& patch, const std::array<Vec3, 4>* normals,
                      TriangleMesh& mesh) {
  const std::array<Double3, 4> p = CornersOf(patch);
  const double size = Length(p[3] - p[0]) + Length(p[2] - p[1]);
  const bool is_flat = Length(TwistOf(p)) <= 1e-6 * size;
  AddBilinearPatch(patch, normals, is_flat ? 1 : kPatchSides, mesh);
}

void AddBilinearPatch(const BilinearPatch& patch, const std::array<Vec3, 4>* normals, int sides,
                      TriangleMesh& mesh) {
  const std::array<Double3, 4> p = CornersOf(patch);
  std::array<Double3, 4> n;
  if (normals != nullptr) {
    for (std::size_t i = 0; i < 4; ++i)
      n[i] = Double3((*normals)[i]);
  }
  AddGrid(
      sides, sides,
      [&](int column, int row) {
        const double u = static_cast<double>(column) / sides;
        const double v = static_cast<double>(row) / sides;
        const Double3 along_u = (p[1] - p[0]) * (1 - v) + (p[3] - p[2]) * v;
        const Double3 along_v = (p[2] - p[0]) * (1 - u) + (p[3] - p[1]) * u;
        const auto uv = [&](float Vec2::*axis) {
          return static_cast<float>(Mix(Mix(static_cast<double>(patch.uvs[0].*axis),
                                            static_cast<double>(patch.uvs[1].*axis), u),
                                        Mix(static_cast<double>(patch.uvs[2].*axis),
                                            static_cast<double>(patch.uvs[3].*axis), u),
                                        v));
        };
        return GridPoint{Mix(p, u, v),
                         normals != nullptr ? Mix(n, u, v) : Cross(along_u, along_v),
                         {uv(&Vec2::x), uv(&Vec2::y)}};
      },
      mesh);
}

int FewestPatchSides(const BilinearPatch& patch) {
  constexpr double kLargestError = 0.005;
  const std::array<Double3, 4> p = CornersOf(patch);
  const Double3 one = p[3] - p[0];
  const Double3 other = p[2] - p[1];
  const Double3 across = Cross(one, other);
  const double diagonal = (Length(one) + Length(other)) / 2;
  if (!(Length(across) > 0) || !(diagonal > 0)) return 1;
  // A cell of a grid leaves its triangles by a quarter of its twist, a share of that of the patch.
  const double twist = std::abs(Dot(TwistOf(p), across)) / Length(across);
  const double sides = std::ceil(std::sqrt(twist / (4 * kLargestError * diagonal)));
  return static_cast<int>(std::clamp(sides, 1.0, static_cast<double>(kPatchSides)));
}

}  // namespace lucerna
