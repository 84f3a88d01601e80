// Spheres, solved in double.
#include <algorithm>
#include <cmath>
#include <utility>

#include "render/geometry/shape_geometry.h"
#include "render/math/warp.h"

namespace lucerna {
namespace {

constexpr int kCircleSides = 256;

// 1 - cosine of the cone in which the sphere appears from `from`, without cancellation; 0 from
// inside, from very near by, and for a sphere that is turned inside out.
float OneMinusCosine(const Sphere& sphere, float distance2) {
  const float sin2_max = sphere.radius * sphere.radius / distance2;
  if (sphere.inward || !(sin2_max < 0.9999F)) return 0;
  return sin2_max / (1 + std::sqrt(std::max(0.0F, 1 - sin2_max)));
}

}  // namespace

Bounds BoxOf(const Sphere& shape) {
  // A little outwards, for the rounding of centre ± radius.
  const float r = shape.radius + ClearanceOf(shape);
  return {shape.center - Vec3{r, r, r}, shape.center + Vec3{r, r, r}};
}

// The nearer root in (t_near, t_far), else the farther one. The roots are found from the larger
// one, so that neither suffers cancellation.
bool IntersectShape(const Sphere& shape, Vec3 origin, Vec3 direction, float t_near, float t_far,
                    float& t) {
  const Double3 o(origin);
  const Double3 c(shape.center);
  const Double3 d(direction);
  const Double3 oc = o - c;
  const auto radius = static_cast<double>(shape.radius);
  const double dd = Dot(d, d);
  const double b = -Dot(oc, d);
  // The discriminant by the distance of the centre from the line: exact for far spheres too.
  const double along = b / dd;
  const Double3 nearest = oc + d * along;
  const double discriminant = radius * radius - Dot(nearest, nearest);
  if (!(discriminant >= 0)) return false;
  const double root = std::sqrt(dd * discriminant);
  const double q = b + std::copysign(root, b);
  const double other = (Dot(oc, oc) - radius * radius);
  double t0 = q == 0 ? 0 : other / q;
  double t1 = q / dd;
  if (t0 > t1) std::swap(t0, t1);
  const auto near_f = static_cast<float>(t0);
  if (near_f > t_near && near_f < t_far) {
    t = near_f;
    return true;
  }
  const auto far_f = static_cast<float>(t1);
  if (far_f > t_near && far_f < t_far) {
    t = far_f;
    return true;
  }
  return false;
}

ShapeFace FaceAt(const Sphere& shape, const Ray& ray, float t) {
  const Vec3 from_center = ray.origin - shape.center + ray.direction * t;
  const Vec3 outward = Normalize(from_center);
  // Put back onto the sphere: whatever t lost, the point is on the surface.
  return {shape.center + outward * shape.radius, shape.inward ? -outward : outward};
}

ShapeFace SampleFace(const Sphere& shape, float u1, float u2) {
  const Vec3 outward = SquareToSphere(u1, u2);
  return {shape.center + outward * shape.radius, shape.inward ? -outward : outward};
}

Vec2 FaceNumbers(const Sphere& shape, Vec3 position) {
  return SphereToSquare(Normalize(position - shape.center));
}

// Uniform in the cone in which the sphere appears.
bool SampleSeen(const Sphere& shape, Vec3 from, float u1, float u2, SeenPlace& seen) {
  const Vec3 to_center = shape.center - from;
  const float distance2 = LengthSquared(to_center);
  const float one_minus_cos = OneMinusCosine(shape, distance2);
  if (!(one_minus_cos > 0)) return false;
  const float distance = std::sqrt(distance2);
  const Vec3 local = SquareToCone(u1, u2, one_minus_cos);
  seen.wi = Frame(to_center / distance).ToWorld(local);
  // Where the direction meets the sphere. The sine is taken from the sides: near the rim of a small
  // sphere, the cosine alone would not tell hit from miss.
  const float sin2 = local.x * local.x + local.y * local.y;
  const float along = distance * local.z -
                      std::sqrt(std::max(0.0F, shape.radius * shape.radius - distance2 * sin2));
  const Vec3 outward = Normalize(seen.wi * along - to_center);
  seen.target = shape.center + outward * (shape.radius + ClearanceOf(shape));
  seen.inverse_pdf = 2 * kPi * one_minus_cos;
  return true;
}

float SeenInversePdf(const Sphere& shape, Vec3 from) {
  return 2 * kPi * OneMinusCosine(shape, LengthSquared(shape.center - from));
}

// u runs around z from x to y, v from -z to z.
Vec2 UvOf(const Sphere& shape, Vec3 position) {
  const Vec3 local = (position - shape.center) / shape.radius;
  const float height = std::min(std::max(Dot(local, shape.axes.z), -1.0F), 1.0F);
  return {TurnOf(Dot(local, shape.axes.x), Dot(local, shape.axes.y)),
          1 - std::acos(height) * kInversePi};
}

UvSlopes UvSlopesOf(const Sphere& shape, Vec3 position) {
  const auto radius = static_cast<double>(shape.radius);
  const Vec3 local = position - shape.center;
  const auto height = static_cast<double>(Dot(local, shape.axes.z));
  const double from_axis = std::sqrt(std::max(radius * radius - height * height, 0.0));
  // The pole, where the gradient has no end, is a point.
  return {TurnSlope(std::max(from_axis, 1e-3 * radius)), 1 / (kPi64 * radius * kPi64 * radius)};
}

SurfaceTangents TangentsOf(const Sphere& shape, Vec3 position) {
  const Vec3 local = position - shape.center;
  const float x = Dot(local, shape.axes.x);
  const float y = Dot(local, shape.axes.y);
  const float z = Dot(local, shape.axes.z);
  const float from_axis = std::sqrt(x * x + y * y);
  if (!(from_axis > 0)) return {};
  const Vec3 outward = (shape.axes.x * x + shape.axes.y * y) / from_axis;
  SurfaceTangents tangents;
  tangents.dpdu = (shape.axes.y * x - shape.axes.x * y) * (2 * kPi);
  tangents.dpdv = (shape.axes.z * from_axis - outward * z) * kPi;
  tangents.dndu = tangents.dpdu / shape.radius;
  tangents.dndv = tangents.dpdv / shape.radius;
  return tangents;
}

Spectrum SpectrumOf(const Sphere& shape, Vec3 /*direction*/, const SpectrumLimits& limits) {
  return SphereSource(static_cast<double>(shape.radius), limits);
}

PrincipalCurvatures CurvatureOf(const Sphere& shape, Vec3 /*position*/) {
  const float curvature = shape.inward ? -1 / shape.radius : 1 / shape.radius;
  return {.direction = shape.axes.x, .first = curvature, .second = curvature};
}

// The circle around the centre that is perpendicular to the line: it is nearest beside the centre.
OutlinePlace NearestOutline(const Sphere& shape, Double3 origin, Double3 direction) {
  const Double3 to_center = Double3(shape.center) - origin;
  const double along = Dot(to_center, direction) / Dot(direction, direction);
  return {along, Length(to_center - direction * along) - static_cast<double>(shape.radius)};
}

// A circle, as the polygon around it.
std::vector<LinePiece> CutByPlane(const Sphere& shape, Double3 origin, Double3 normal) {
  const Double3 center(shape.center);
  const auto radius = static_cast<double>(shape.radius);
  const double height = Dot(center - origin, normal);
  const double squared = radius * radius - height * height;
  // Hardly more than a point of contact.
  if (!(squared > 1e-8 * radius * radius)) return {};
  const double around = std::sqrt(squared) / std::cos(kPi64 / kCircleSides);
  const Double3 middle = center - normal * height;
  const Frame frame(ToFloat(normal));
  const Double3 s(frame.s);
  const Double3 t = Cross(normal, s);
  const auto corner = [&](int i) {
    const double angle = 2 * kPi64 * (i % kCircleSides) / kCircleSides;
    return middle + s * (around * std::cos(angle)) + t * (around * std::sin(angle));
  };
  std::vector<LinePiece> pieces;
  pieces.reserve(kCircleSides);
  for (int i = 0; i < kCircleSides; ++i) {
    const Double3 from = corner(i);
    pieces.push_back({from, corner(i + 1) - from});
  }
  return pieces;
}

}  // namespace lucerna
