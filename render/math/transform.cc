#include "render/math/transform.h"

#include <cmath>
#include <numbers>

namespace lucerna {
namespace {

using Row3 = std::array<double, 3>;

double DotRow(const Row3& a, const Row3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Row3 CrossRow(const Row3& a, const Row3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
bool NormalizeRow(Row3& a) {
  const double length = std::sqrt(DotRow(a, a));
  if (!(length > 0) || !std::isfinite(length)) return false;
  for (double& component : a)
    component /= length;
  return true;
}

}  // namespace

Transform::Transform() : m_{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}} {}

Transform Transform::Translate(double x, double y, double z) {
  return Transform({{{1, 0, 0, x}, {0, 1, 0, y}, {0, 0, 1, z}, {0, 0, 0, 1}}});
}

Transform Transform::Scale(double x, double y, double z) {
  return Transform({{{x, 0, 0, 0}, {0, y, 0, 0}, {0, 0, z, 0}, {0, 0, 0, 1}}});
}

StatusOr<Transform> Transform::Rotate(double angle_deg, double x, double y, double z) {
  Row3 a = {x, y, z};
  if (!NormalizeRow(a)) return absl::InvalidArgumentError("the axis of a rotation is zero");
  const double angle = angle_deg * std::numbers::pi / 180;
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  // Rodrigues' formula.
  return Transform({{{a[0] * a[0] * (1 - c) + c, a[0] * a[1] * (1 - c) - a[2] * s,
                      a[0] * a[2] * (1 - c) + a[1] * s, 0},
                     {a[0] * a[1] * (1 - c) + a[2] * s, a[1] * a[1] * (1 - c) + c,
                      a[1] * a[2] * (1 - c) - a[0] * s, 0},
                     {a[0] * a[2] * (1 - c) - a[1] * s, a[1] * a[2] * (1 - c) + a[0] * s,
                      a[2] * a[2] * (1 - c) + c, 0},
                     {0, 0, 0, 1}}});
}

StatusOr<Transform> Transform::LookAt(const Row3& eye, const Row3& look, const Row3& up) {
  Row3 forward = {look[0] - eye[0], look[1] - eye[1], look[2] - eye[2]};
  if (!NormalizeRow(forward)) {
    return absl::InvalidArgumentError("LookAt: the eye and the point looked at are the same");
  }
  Row3 unit_up = up;
  if (!NormalizeRow(unit_up)) return absl::InvalidArgumentError("LookAt: the up vector is zero");
  Row3 right = CrossRow(unit_up, forward);
  if (DotRow(right, right) < 1e-20 || !NormalizeRow(right)) {
    return absl::InvalidArgumentError("LookAt: the up vector is parallel to the view");
  }
  const Row3 true_up = CrossRow(forward, right);
  return Transform({{{right[0], right[1], right[2], -DotRow(right, eye)},
                     {true_up[0], true_up[1], true_up[2], -DotRow(true_up, eye)},
                     {forward[0], forward[1], forward[2], -DotRow(forward, eye)},
                     {0, 0, 0, 1}}});
}

Transform Transform::operator*(const Transform& other) const {
  Transform product;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      double sum = 0;
      for (std::size_t k = 0; k < 4; ++k)
        sum += m_[i][k] * other.m_[k][j];
      product.m_[i][j] = sum;
    }
  }
  return product;
}

StatusOr<Transform> Transform::Inverse() const {
  // Gauss-Jordan with partial pivoting.
  auto left = m_;
  auto right = Transform().m_;
  for (std::size_t column = 0; column < 4; ++column) {
    std::size_t pivot = column;
    for (std::size_t row = column + 1; row < 4; ++row) {
      if (std::abs(left[row][column]) > std::abs(left[pivot][column])) pivot = row;
    }
    const double value = left[pivot][column];
    if (value == 0 || !std::isfinite(value)) {
      return absl::InvalidArgumentError("the transformation cannot be inverted");
    }
    std::swap(left[pivot], left[column]);
    std::swap(right[pivot], right[column]);
    for (std::size_t j = 0; j < 4; ++j) {
      left[column][j] /= value;
      right[column][j] /= value;
    }
    for (std::size_t row = 0; row < 4; ++row) {
      const double factor = left[row][column];
      if (row == column || factor == 0) continue;
      for (std::size_t j = 0; j < 4; ++j) {
        left[row][j] -= factor * left[column][j];
        right[row][j] -= factor * right[column][j];
      }
    }
  }
  return Transform(right);
}

Vec3 Transform::Point(Vec3 p) const {
  std::array<double, 4> out{};
  for (std::size_t i = 0; i < 4; ++i) {
    out[i] = m_[i][0] * static_cast<double>(p.x) + m_[i][1] * static_cast<double>(p.y) +
             m_[i][2] * static_cast<double>(p.z) + m_[i][3];
  }
  if (out[3] != 1) {
    for (std::size_t i = 0; i < 3; ++i)
      out[i] /= out[3];
  }
  return {static_cast<float>(out[0]), static_cast<float>(out[1]), static_cast<float>(out[2])};
}

Vec3 Transform::Vector(Vec3 v) const {
  std::array<float, 3> out{};
  for (std::size_t i = 0; i < 3; ++i) {
    out[i] = static_cast<float>(m_[i][0] * static_cast<double>(v.x) +
                                m_[i][1] * static_cast<double>(v.y) +
                                m_[i][2] * static_cast<double>(v.z));
  }
  return {out[0], out[1], out[2]};
}

Vec3 Transform::Normal(Vec3 n) const {
  // The cofactor matrix is the inverse transpose times the determinant; it needs no division and
  // exists for singular maps too. The determinant's sign is taken out again.
  const Row3 a = {m_[0][0], m_[0][1], m_[0][2]};
  const Row3 b = {m_[1][0], m_[1][1], m_[1][2]};
  const Row3 c = {m_[2][0], m_[2][1], m_[2][2]};
  const Row3 x = CrossRow(b, c);
  const Row3 y = CrossRow(c, a);
  const Row3 z = CrossRow(a, b);
  const double sign = DotRow(a, x) < 0 ? -1 : 1;
  const Row3 in = {static_cast<double>(n.x), static_cast<double>(n.y), static_cast<double>(n.z)};
  // Scaled to about unit length while still in double, so that float does not underflow.
  Row3 out = {sign * DotRow(x, in), sign * DotRow(y, in), sign * DotRow(z, in)};
  NormalizeRow(out);
  return {static_cast<float>(out[0]), static_cast<float>(out[1]), static_cast<float>(out[2])};
}

bool Transform::SwapsHandedness() const {
  const Row3 a = {m_[0][0], m_[0][1], m_[0][2]};
  const Row3 b = {m_[1][0], m_[1][1], m_[1][2]};
  const Row3 c = {m_[2][0], m_[2][1], m_[2][2]};
  return DotRow(a, CrossRow(b, c)) < 0;
}

StatusOr<double> Transform::UniformScale() const {
  double squared = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j)
      squared += m_[i][j] * m_[i][j] / 3;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      double dot = 0;
      for (std::size_t k = 0; k < 3; ++k)
        dot += m_[k][i] * m_[k][j];
      const double expected = i == j ? squared : 0;
      if (!(std::abs(dot - expected) <= 2e-5 * squared)) {
        return absl::InvalidArgumentError("the transformation does not scale all axes alike");
      }
    }
  }
  return std::sqrt(squared);
}

bool Transform::IsFinite() const {
  for (const auto& row : m_) {
    for (const double value : row) {
      if (!std::isfinite(value)) return false;
    }
  }
  return true;
}

}  // namespace lucerna
