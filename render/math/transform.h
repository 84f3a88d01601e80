// An affine or projective map of space, in double so that a chain of scene transforms does not
// lose the digits that float positions keep.
#pragma once

#include <array>

#include "render/base/status.h"
#include "render/math/vector.h"

namespace lucerna {

class Transform {
 public:
  // The identity.
  Transform();
  // Row-major: m[row][column]; points are columns, p' = M p.
  explicit Transform(const std::array<std::array<double, 4>, 4>& m) : m_(m) {}

  [[nodiscard]] static Transform Translate(double x, double y, double z);
  [[nodiscard]] static Transform Scale(double x, double y, double z);
  // Counter-clockwise seen from the tip of `axis`. Errors: INVALID_ARGUMENT for a zero axis.
  [[nodiscard]] static StatusOr<Transform> Rotate(double angle_deg, double x, double y, double z);
  // World to camera; the camera looks along +z with y up, as pbrt has it (left-handed).
  // Errors: INVALID_ARGUMENT when eye and look coincide, or up is parallel to the view.
  [[nodiscard]] static StatusOr<Transform> LookAt(const std::array<double, 3>& eye,
                                                  const std::array<double, 3>& look,
                                                  const std::array<double, 3>& up);

  // (a * b) applies b first.
  [[nodiscard]] Transform operator*(const Transform& other) const;
  // Errors: INVALID_ARGUMENT for a singular matrix.
  [[nodiscard]] StatusOr<Transform> Inverse() const;

  [[nodiscard]] Vec3 Point(Vec3 p) const;
  [[nodiscard]] Vec3 Vector(Vec3 v) const;
  // The image of a normal, not normalised: the inverse transpose, up to a positive factor.
  [[nodiscard]] Vec3 Normal(Vec3 n) const;

  // True when the map turns a right-handed frame into a left-handed one.
  [[nodiscard]] bool SwapsHandedness() const;
  // The one factor by which all lengths grow. Errors: INVALID_ARGUMENT when there is no such one
  // (to about 1 part in 1e5).
  [[nodiscard]] StatusOr<double> UniformScale() const;
  [[nodiscard]] bool IsFinite() const;

  [[nodiscard]] const std::array<std::array<double, 4>, 4>& rows() const { return m_; }
  bool operator==(const Transform&) const = default;

 private:
  std::array<std::array<double, 4>, 4> m_;
};

}  // namespace lucerna
