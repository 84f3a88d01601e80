#include "render/math/animated_transform.h"

#include <algorithm>
#include <cmath>

namespace lucerna {
namespace {

using Matrix3 = std::array<std::array<double, 3>, 3>;
using Quaternion = std::array<double, 4>;  // vector part, then scalar

Matrix3 LinearPart(const Transform& transform) {
  Matrix3 m{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j)
      m[i][j] = transform.rows()[i][j];
  }
  return m;
}

Transform FromParts(const Matrix3& m, const std::array<double, 3>& translation) {
  std::array<std::array<double, 4>, 4> rows{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j)
      rows[i][j] = m[i][j];
    rows[i][3] = translation[i];
  }
  rows[3][3] = 1;
  return Transform(rows);
}

double LargestDifference(const Matrix3& a, const Matrix3& b) {
  double largest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j)
      largest = std::max(largest, std::abs(a[i][j] - b[i][j]));
  }
  return largest;
}

// The nearest matrix that keeps lengths. Source: Higham 1986, "Computing the Polar Decomposition".
StatusOr<Matrix3> NearestOrthogonal(Matrix3 m) {
  double squares = 0;
  for (const auto& row : m) {
    for (const double value : row)
      squares += value * value;
  }
  // Near its goal from the start: each step only halves a factor that is common to all axes.
  const double scale = std::sqrt(3 / squares);
  for (auto& row : m) {
    for (double& value : row)
      value *= scale;
  }
  // Each step halves what is too long and doubles what is too short; near the goal the error
  // squares itself. A map that flattens space by 2^80 is not told from a singular one.
  constexpr int kMostSteps = 100;
  constexpr double kEnough = 1e-14;
  for (int step = 0; step < kMostSteps; ++step) {
    LUCERNA_ASSIGN_OR_RETURN(const Transform inverse, FromParts(m, {}).Inverse());
    Matrix3 next{};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j)
        next[i][j] = 0.5 * (m[i][j] + inverse.rows()[j][i]);
    }
    const bool is_near = LargestDifference(m, next) <= kEnough;
    m = next;
    if (is_near) return m;
  }
  return absl::InvalidArgumentError("the transformation cannot be inverted");
}

// Of a rotation. Source: Shepperd 1978, "Quaternion from Rotation Matrix": divides by the largest
// of four numbers.
Quaternion QuaternionOf(const Matrix3& r) {
  const double trace = r[0][0] + r[1][1] + r[2][2];
  std::size_t largest = 3;
  double value = trace;
  for (std::size_t i = 0; i < 3; ++i) {
    if (r[i][i] > value) {
      largest = i;
      value = r[i][i];
    }
  }
  Quaternion q{};
  if (largest == 3) {
    q[3] = std::sqrt(1 + trace) / 2;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3;
      const std::size_t k = (i + 2) % 3;
      q[i] = (r[k][j] - r[j][k]) / (4 * q[3]);
    }
    return q;
  }
  const std::size_t i = largest;
  const std::size_t j = (i + 1) % 3;
  const std::size_t k = (i + 2) % 3;
  q[i] = std::sqrt(std::max(0.0, 1 + r[i][i] - r[j][j] - r[k][k])) / 2;
  q[j] = (r[i][j] + r[j][i]) / (4 * q[i]);
  q[k] = (r[i][k] + r[k][i]) / (4 * q[i]);
  q[3] = (r[k][j] - r[j][k]) / (4 * q[i]);
  return q;
}

Matrix3 RotationOf(const Quaternion& q) {
  const auto [x, y, z, w] = q;
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
           {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
           {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
}

// On the shorter great arc between two unit quaternions (Shoemake 1985, "Animating Rotation with
// Quaternion Curves").
Quaternion Between(const Quaternion& from, Quaternion to, double share) {
  double cosine = 0;
  for (std::size_t i = 0; i < 4; ++i)
    cosine += from[i] * to[i];
  if (cosine < 0) {
    for (double& value : to)
      value = -value;
  }
  // By the chords of their sum and difference, which tell small angles.
  double sum = 0;
  double difference = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    sum += (from[i] + to[i]) * (from[i] + to[i]);
    difference += (from[i] - to[i]) * (from[i] - to[i]);
  }
  const double angle = 2 * std::atan2(std::sqrt(difference), std::sqrt(sum));
  const double sine = std::sin(angle);
  const double of_from = sine > 1e-9 ? std::sin((1 - share) * angle) / sine : 1 - share;
  const double of_to = sine > 1e-9 ? std::sin(share * angle) / sine : share;
  Quaternion q{};
  double squares = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    q[i] = of_from * from[i] + of_to * to[i];
    squares += q[i] * q[i];
  }
  for (double& value : q)
    value /= std::sqrt(squares);
  return q;
}

Matrix3 Product(const Matrix3& a, const Matrix3& b) {
  Matrix3 product{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k)
        product[i][j] += a[i][k] * b[k][j];
    }
  }
  return product;
}

}  // namespace

StatusOr<AnimatedTransform::Parts> AnimatedTransform::PartsOf(const Transform& transform) {
  Parts parts;
  for (std::size_t i = 0; i < 3; ++i)
    parts.translation[i] = transform.rows()[i][3];
  const Matrix3 linear = LinearPart(transform);
  LUCERNA_ASSIGN_OR_RETURN(Matrix3 rotation, NearestOrthogonal(linear));
  // What mirrors is a rotation of a stretch that turns everything inside out.
  if (transform.SwapsHandedness()) {
    for (auto& row : rotation) {
      for (double& value : row)
        value = -value;
    }
  }
  parts.rotation = QuaternionOf(rotation);
  Matrix3 back{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j)
      back[i][j] = rotation[j][i];
  }
  parts.stretch = Product(back, linear);
  return parts;
}

StatusOr<AnimatedTransform> AnimatedTransform::Create(const Transform& start, double start_time,
                                                      const Transform& end, double end_time) {
  AnimatedTransform animated(start);
  animated.start_time_ = start_time;
  animated.end_time_ = end_time;
  if (start == end) return animated;
  LUCERNA_ASSIGN_OR_RETURN(animated.from_, PartsOf(start));
  LUCERNA_ASSIGN_OR_RETURN(animated.to_, PartsOf(end));
  if (start.SwapsHandedness() != end.SwapsHandedness()) {
    return absl::InvalidArgumentError(
        "of the transforms at the start and at the end of a motion one mirrors and the other does "
        "not: let both mirror or neither");
  }
  animated.end_ = end;
  animated.moves_ = true;
  return animated;
}

Transform AnimatedTransform::At(double time) const {
  if (!moves_ || time <= start_time_) return start_;
  if (time >= end_time_) return end_;
  const double share = (time - start_time_) / (end_time_ - start_time_);
  const auto between = [&](double a, double b) { return (1 - share) * a + share * b; };
  std::array<double, 3> translation{};
  Matrix3 stretch{};
  for (std::size_t i = 0; i < 3; ++i) {
    translation[i] = between(from_.translation[i], to_.translation[i]);
    for (std::size_t j = 0; j < 3; ++j)
      stretch[i][j] = between(from_.stretch[i][j], to_.stretch[i][j]);
  }
  const Matrix3 rotation = RotationOf(Between(from_.rotation, to_.rotation, share));
  return FromParts(Product(rotation, stretch), translation);
}

AnimatedTransform AnimatedTransform::ScaledBy(double factor) const {
  AnimatedTransform scaled = *this;
  const auto scale = [&](const Transform& transform) {
    auto rows = transform.rows();
    for (std::size_t i = 0; i < 3; ++i)
      rows[i][3] *= factor;
    return Transform(rows);
  };
  scaled.start_ = scale(start_);
  scaled.end_ = scale(end_);
  for (Parts* parts : {&scaled.from_, &scaled.to_}) {
    for (double& value : parts->translation)
      value *= factor;
  }
  return scaled;
}

}  // namespace lucerna
