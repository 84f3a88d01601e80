// Pieces of curves: cones with round ends, solved in double.
#include <algorithm>
#include <cmath>

#include "render/geometry/shape_geometry.h"
#include "render/math/warp.h"

namespace lucerna {
namespace {

using Axis = CurvePiece::Axis;

// Where a line enters a ball; false when it misses.
bool EnterBall(Double3 offset, Double3 direction, double radius, double& t) {
  const double dd = Dot(direction, direction);
  const double along = -Dot(offset, direction) / dd;
  const Double3 nearest = offset + direction * along;
  const double left = radius * radius - Dot(nearest, nearest);
  if (!(left >= 0)) return false;
  t = along - std::sqrt(left / dd);
  return true;
}

// Where a line comes into the cone that touches all balls, between the circles at which it touches
// the two ends. The balls that hold point q satisfy |q - s·a|² = (r + g·s)²; at the cone the two
// solutions for s fall together.
bool EnterCone(const Axis& axis, Double3 offset, Double3 direction, double& t) {
  const double tangent2 = Dot(axis.along, axis.along) - axis.growth * axis.growth;
  if (!(tangent2 > 0)) return false;
  // From the point of the line that is nearest to the end, so that far rays lose no digits.
  const double dd = Dot(direction, direction);
  const double shift = -Dot(offset, direction) / dd;
  const Double3 m = offset + direction * shift;
  const double ad = Dot(axis.along, direction);
  const double am = Dot(axis.along, m) + axis.growth * axis.radius;
  const double a = dd - ad * ad / tangent2;
  const double b = Dot(m, direction) - ad * am / tangent2;
  const double c = Dot(m, m) - axis.radius * axis.radius - am * am / tangent2;
  const double discriminant = b * b - a * c;
  if (!(discriminant >= 0) || a == 0) return false;
  const double at = (-b - std::sqrt(discriminant)) / a;
  const double s = (am + ad * at) / tangent2;
  if (!(s >= 0 && s <= 1)) return false;
  t = at + shift;
  return true;
}

}  // namespace

Bounds BoxOf(const CurvePiece& shape) {
  const float slack = ClearanceOf(shape);
  Bounds box;
  for (const auto& [end, radius] :
       {std::pair(shape.from, shape.from_radius), std::pair(shape.to, shape.to_radius)}) {
    const Vec3 reach = Vec3{1, 1, 1} * (radius + slack);
    box.Add(end - reach);
    box.Add(end + reach);
  }
  return box;
}

// The body is convex, so a line enters it once: where it first enters any ball. A ray that begins
// later begins inside or beyond.
bool IntersectShape(const CurvePiece& shape, Vec3 origin, Vec3 direction, float t_near, float t_far,
                    float& t) {
  const Axis axis(shape);
  const Double3 offset = Double3(origin) - axis.from;
  const Double3 d(direction);
  double first = HUGE_VAL;
  double entry = 0;
  if (EnterBall(offset, d, axis.radius, entry)) first = entry;
  if (EnterBall(offset - axis.along, d, axis.radius + axis.growth, entry))
    first = std::min(first, entry);
  if (EnterCone(axis, offset, d, entry)) first = std::min(first, entry);
  const auto at = static_cast<float>(first);
  if (!(at > t_near && at < t_far)) return false;
  t = at;
  return true;
}

ShapeFace FaceAt(const CurvePiece& shape, const Ray& ray, float t) {
  const Axis axis(shape);
  const Double3 p = Double3(ray.origin) + Double3(ray.direction) * static_cast<double>(t);
  const double s = axis.Nearest(p);
  const Double3 middle = axis.from + axis.along * s;
  Double3 outward = p - middle;
  // At a tip without width any direction will do.
  const double length = Length(outward);
  outward = length > 0 ? outward * (1 / length) : Double3(-ray.direction);
  return {ToFloat(middle + outward * (axis.radius + axis.growth * s)), ToFloat(outward)};
}

// What lies deeper in the other piece than rounding can move it is no surface of the tube.
bool IsWithinNextPiece(const std::vector<CurvePiece>& pieces, std::size_t index, const Ray& ray,
                       float t) {
  const auto follows = [](const CurvePiece& one, const CurvePiece& next) {
    return one.to == next.from && one.to_radius == next.from_radius;
  };
  const bool has_before = index > 0 && follows(pieces[index - 1], pieces[index]);
  const bool has_after = index + 1 < pieces.size() && follows(pieces[index], pieces[index + 1]);
  if (!has_before && !has_after) return false;
  const Double3 place(FaceAt(pieces[index], ray, t).position);
  const auto is_within = [&](const CurvePiece& other) {
    return other.SignedDistance(place) < -static_cast<double>(ClearanceOf(other));
  };
  return (has_before && is_within(pieces[index - 1])) ||
         (has_after && is_within(pieces[index + 1]));
}

// On the side of the cone (CurvePiece::Area).
ShapeFace SampleFace(const CurvePiece& shape, float u1, float u2) {
  const Axis axis(shape);
  const double end = axis.radius + axis.growth;
  // Circles have lengths in proportion to their radii: squared radii are uniform.
  const double radius =
      std::sqrt(axis.radius * axis.radius +
                static_cast<double>(u1) * (end * end - axis.radius * axis.radius));
  const double s = axis.growth == 0 ? static_cast<double>(u1)
                                    : std::clamp((radius - axis.radius) / axis.growth, 0.0, 1.0);
  const double length = Length(axis.along);
  const double slope = length > 0 ? std::clamp(axis.growth / length, -1.0, 1.0) : 0;
  const Vec3 along = length > 0 ? ToFloat(axis.along * (1 / length)) : Vec3{0, 0, 1};
  const Frame frame(along);
  const double angle = 2 * kPi64 * static_cast<double>(u2);
  const Double3 across = Double3(frame.s) * std::cos(angle) + Double3(frame.t) * std::sin(angle);
  const Double3 outward = across * std::sqrt(1 - slope * slope) + Double3(along) * -slope;
  return {ToFloat(axis.from + axis.along * s + outward * (axis.radius + axis.growth * s)),
          ToFloat(outward)};
}

Vec2 FaceNumbers(const CurvePiece& shape, Vec3 position) {
  const Axis axis(shape);
  const double end = axis.radius + axis.growth;
  const double length = Length(axis.along);
  const double slope = length > 0 ? std::clamp(axis.growth / length, -1.0, 1.0) : 0;
  const Vec3 along = length > 0 ? ToFloat(axis.along * (1 / length)) : Vec3{0, 0, 1};
  const Double3 offset = Double3(position) - axis.from;
  // The place is the axis' at s, and the radius there in a direction that leans back by the slope.
  const double per_s = length - slope * axis.growth;
  const double s =
      per_s > 0 ? std::clamp((Dot(offset, Double3(along)) + slope * axis.radius) / per_s, 0.0, 1.0)
                : 0.5;
  const double radius = axis.radius + axis.growth * s;
  const double u1 = axis.growth == 0 ? s
                                     : (radius * radius - axis.radius * axis.radius) /
                                           (end * end - axis.radius * axis.radius);
  const Frame frame(along);
  return {static_cast<float>(std::clamp(u1, 0.0, 1.0)),
          TurnOf(static_cast<float>(Dot(offset, Double3(frame.s))),
                 static_cast<float>(Dot(offset, Double3(frame.t))))};
}

bool SampleSeen(const CurvePiece& /*shape*/, Vec3 /*from*/, float /*u1*/, float /*u2*/,
                SeenPlace& /*seen*/) {
  return false;
}

float SeenInversePdf(const CurvePiece& /*shape*/, Vec3 /*from*/) {
  return 0;
}

// u runs along the curve. v, which in pbrt-v4 runs across it as the ray sees it, is the middle.
Vec2 UvOf(const CurvePiece& shape, Vec3 position) {
  const auto s = static_cast<float>(Axis(shape).Nearest(Double3(position)));
  return {shape.from_u + (shape.to_u - shape.from_u) * s, 0.5F};
}

UvSlopes UvSlopesOf(const CurvePiece& shape, Vec3 /*position*/) {
  const double length2 = static_cast<double>(LengthSquared(shape.to - shape.from));
  if (!(length2 > 0)) return {};
  const double change = static_cast<double>(shape.to_u) - static_cast<double>(shape.from_u);
  return {change * change / length2, 0};
}

// u along the curve, and v around it.
SurfaceTangents TangentsOf(const CurvePiece& shape, Vec3 position) {
  const float change = shape.to_u - shape.from_u;
  if (!(change != 0)) return {};
  const Axis axis(shape);
  const double s = axis.Nearest(Double3(position));
  SurfaceTangents tangents;
  tangents.dpdu = (shape.to - shape.from) / change;
  const Vec3 across =
      Cross(ToFloat(Double3(position) - (axis.from + axis.along * s)), tangents.dpdu);
  if (!(LengthSquared(across) > 0)) return {};
  tangents.dpdv = Normalize(across) * static_cast<float>(2 * (axis.radius + axis.growth * s));
  return tangents;
}

// As fine as its thickness.
Spectrum SpectrumOf(const CurvePiece& shape, Vec3 /*direction*/, const SpectrumLimits& limits) {
  return SphereSource(static_cast<double>(std::max(shape.from_radius, shape.to_radius)), limits);
}

PrincipalCurvatures CurvatureOf(const CurvePiece& shape, Vec3 position) {
  const Axis axis(shape);
  const double s = axis.Nearest(Double3(position));
  const double radius = std::max(axis.radius + axis.growth * s, 1e-6 * axis.radius);
  const double length = Length(axis.along);
  const auto across = static_cast<float>(1 / radius);
  if (!(length > 0) || s == 0 || s == 1) {
    // Round ends.
    return {.direction = {1, 0, 0}, .first = across, .second = across};
  }
  return {.direction = ToFloat(axis.along * (1 / length)), .first = 0, .second = across};
}

// Where the line comes nearest to the axis.
OutlinePlace NearestOutline(const CurvePiece& shape, Double3 origin, Double3 direction) {
  const Axis axis(shape);
  const Double3 between = axis.from - origin;
  const double dd = Dot(direction, direction);
  const double da = Dot(direction, axis.along);
  const double aa = Dot(axis.along, axis.along);
  const double determinant = dd * aa - da * da;
  double s = 0;
  if (determinant > 1e-12 * dd * aa) {
    s = std::clamp((da * Dot(between, direction) - dd * Dot(between, axis.along)) / determinant,
                   0.0, 1.0);
  }
  const Double3 to = between + axis.along * s;
  const double along = Dot(to, direction) / dd;
  return {along, Length(to - direction * along) - (axis.radius + axis.growth * s)};
}

}  // namespace lucerna
