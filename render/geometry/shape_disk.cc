// Disks and rings.
#include <algorithm>
#include <cmath>

#include "render/geometry/shape_geometry.h"
#include "render/geometry/silhouette.h"
#include "render/math/warp.h"

namespace lucerna {
namespace {

constexpr int kFeatureSides = 256;

}  // namespace

Bounds BoxOf(const Disk& shape) {
  const float slack = ClearanceOf(shape);
  const auto reach = [&](float n) {
    return shape.radius * std::sqrt(std::max(0.0F, 1 - n * n)) + slack;
  };
  const Vec3 r = {reach(shape.normal.x), reach(shape.normal.y), reach(shape.normal.z)};
  return {shape.center - r, shape.center + r};
}

bool IntersectShape(const Disk& shape, Vec3 origin, Vec3 direction, float t_near, float t_far,
                    float& t) {
  const float slope = Dot(direction, shape.normal);
  if (slope == 0) return false;
  t = Dot(shape.center - origin, shape.normal) / slope;
  if (!(t > t_near && t < t_far)) return false;
  const float squared = LengthSquared(origin + direction * t - shape.center);
  return squared <= shape.radius * shape.radius &&
         squared >= shape.inner_radius * shape.inner_radius;
}

ShapeFace FaceAt(const Disk& shape, const Ray& ray, float t) {
  const Vec3 p = ray.origin + ray.direction * t;
  return {p - shape.normal * Dot(p - shape.center, shape.normal), shape.normal};
}

ShapeFace SampleFace(const Disk& shape, float u1, float u2) {
  const Frame frame(shape.normal);
  Vec3 on_unit = SquareToDisk(u1, u2);
  if (shape.inner_radius > 0) {
    // Squared radii are uniform on a disc; squeeze them into the ring.
    const float squared = LengthSquared(on_unit);
    const float inner2 = shape.inner_radius * shape.inner_radius / (shape.radius * shape.radius);
    if (squared > 0) on_unit = on_unit * std::sqrt((inner2 + squared * (1 - inner2)) / squared);
  }
  return {
      shape.center + frame.s * (on_unit.x * shape.radius) + frame.t * (on_unit.y * shape.radius),
      shape.normal};
}

Vec2 FaceNumbers(const Disk& shape, Vec3 position) {
  const Frame frame(shape.normal);
  const Vec3 offset = (position - shape.center) / shape.radius;
  float x = Dot(offset, frame.s);
  float y = Dot(offset, frame.t);
  if (const float squared = x * x + y * y; shape.inner_radius > 0 && squared > 0) {
    const float inner2 = shape.inner_radius * shape.inner_radius / (shape.radius * shape.radius);
    const float scale = std::sqrt(std::max(0.0F, squared - inner2) / ((1 - inner2) * squared));
    x *= scale;
    y *= scale;
  }
  return DiskToSquare(x, y);
}

bool SampleSeen(const Disk& /*shape*/, Vec3 /*from*/, float /*u1*/, float /*u2*/,
                SeenPlace& /*seen*/) {
  return false;
}

float SeenInversePdf(const Disk& /*shape*/, Vec3 /*from*/) {
  return 0;
}

// u runs around the normal from x to y, v from the rim to the centre.
Vec2 UvOf(const Disk& shape, Vec3 position) {
  const Vec3 local = position - shape.center;
  const float x = Dot(local, shape.axes.x);
  const float y = Dot(local, shape.axes.y);
  return {TurnOf(x, y),
          (shape.radius - std::sqrt(x * x + y * y)) / (shape.radius - shape.inner_radius)};
}

UvSlopes UvSlopesOf(const Disk& shape, Vec3 position) {
  const double from_center = static_cast<double>(Length(position - shape.center));
  const double width = static_cast<double>(shape.radius) - static_cast<double>(shape.inner_radius);
  // The centre, where the gradient has no end, is a point.
  return {TurnSlope(std::max(from_center, 1e-3 * static_cast<double>(shape.radius))),
          1 / (width * width)};
}

SurfaceTangents TangentsOf(const Disk& shape, Vec3 position) {
  const Vec3 local = position - shape.center;
  const float x = Dot(local, shape.axes.x);
  const float y = Dot(local, shape.axes.y);
  const float from_center = std::sqrt(x * x + y * y);
  if (!(from_center > 0)) return {};
  const Vec3 outward = (shape.axes.x * x + shape.axes.y * y) / from_center;
  SurfaceTangents tangents;
  tangents.dpdu = (shape.axes.y * x - shape.axes.x * y) * (2 * kPi);
  tangents.dpdv = outward * (shape.inner_radius - shape.radius);
  return tangents;
}

Spectrum SpectrumOf(const Disk& shape, Vec3 direction, const SpectrumLimits& limits) {
  return AreaSource(DiscMoments(shape.center, shape.normal, static_cast<double>(shape.radius)),
                    direction, limits);
}

bool ClipToShape(const Disk& shape, Double3 from, Double3 along, double& begin, double& end) {
  const Double3 offset = from - Double3(shape.center);
  const double squared = Dot(along, along);
  if (!(squared > 0)) return false;
  const double middle = -Dot(offset, along) / squared;
  const Double3 nearest = offset + along * middle;
  const auto radius = static_cast<double>(shape.radius);
  const double left = radius * radius - Dot(nearest, nearest);
  if (!(left > 0)) return false;
  const double half = std::sqrt(left / squared);
  begin = std::max(begin, middle - half);
  end = std::min(end, middle + half);
  return begin < end;
}

// Polygons with their corners on the outer rim, and around the inner one.
void AddRim(const Disk& shape, std::vector<FeatureSegment>& segments) {
  const Frame frame(shape.normal);
  for (const bool is_inner : {false, true}) {
    float radius = is_inner ? shape.inner_radius : shape.radius;
    if (!(radius > 0)) continue;
    if (is_inner) radius /= static_cast<float>(std::cos(kPi64 / kFeatureSides));
    const auto corner = [&](int i) {
      const double angle = 2 * kPi64 * (i % kFeatureSides) / kFeatureSides;
      return shape.center + (frame.s * static_cast<float>(std::cos(angle)) +
                             frame.t * static_cast<float>(std::sin(angle))) *
                                radius;
    };
    for (int i = 0; i < kFeatureSides; ++i)
      segments.push_back({{corner(i), corner(i + 1)}});
  }
}

void AddRimSilhouettes(const Disk& shape, std::vector<SilhouetteEdge>& edges) {
  const Frame frame(shape.normal);
  for (const float radius : {shape.radius, shape.inner_radius}) {
    if (!(radius > 0)) continue;
    // The face lies inside the outer rim and outside the inner one.
    const double inwards = radius == shape.radius ? -1 : 1;
    // Corners outside the circle by as much as the middles of the sides are inside.
    const double half_side = kPi64 / kRimSides;
    const double corner_radius = static_cast<double>(radius) * 2 / (1 + std::cos(half_side));
    const auto ray = [&](double angle) {
      return Double3(frame.s) * std::cos(angle) + Double3(frame.t) * std::sin(angle);
    };
    const auto corner = [&](int i) {
      return ToFloat(Double3(shape.center) + ray(2 * half_side * (i % kRimSides)) * corner_radius);
    };
    for (int i = 0; i < kRimSides; ++i) {
      const Vec3 wing = ToFloat(ray(half_side * (2 * i + 1)) * inwards);
      const SilhouetteEdge edge = {{corner(i), corner(i + 1)}, {wing, wing}};
      // A rim below the spacing of floats has no sides.
      if (!(edge.ends[0] == edge.ends[1])) edges.push_back(edge);
    }
  }
}

}  // namespace lucerna
