#include "worker/cut_disc.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/estimate/evidence.h"
#include "render/math/double3.h"
#include "render/math/kernel.h"

namespace lucerna {
namespace {

// With less of its kernel left than this a disc is gathered whole.
constexpr double kLeastShare = 0.02;

}  // namespace

// In double: segments may be a million radii long.
bool CutDisc::AddSegment(const FeatureSegment& segment, const Frame& frame, double reach) {
  const auto on_plane = [&](Vec3 end) {
    const DiscPlace place = PlaceOf(end - position_);
    return Point2{place.x, place.y};
  };
  // Of most segments that crowd a disc this is all that must be known.
  if (region_.Hides(on_plane(segment.ends[0]), on_plane(segment.ends[1]))) return true;
  const auto scale = static_cast<double>(inverse_radius_);
  const Double3 a = (Double3(segment.ends[0]) - Double3(position_)) * scale;
  const Double3 along = (Double3(segment.ends[1]) - Double3(position_)) * scale + a * -1;
  double t0 = 0;
  double t1 = 1;
  // The part within the slab around the tangent plane.
  const Double3 n(normal_);
  const double height = Dot(a, n);
  const double rise = Dot(along, n);
  const auto tolerance = static_cast<double>(kPlaneTolerance);
  if (rise == 0) {
    if (!(std::abs(height) < tolerance)) return true;
  } else {
    const double enters = (-tolerance - height) / rise;
    const double leaves = (tolerance - height) / rise;
    t0 = std::max(t0, std::min(enters, leaves));
    t1 = std::min(t1, std::max(enters, leaves));
  }
  // The part within the disc: |p + t d|² < reach².
  const auto flat = [&](Double3 v) {
    return Point2{Dot(v, Double3(frame.s)), Dot(v, Double3(frame.t))};
  };
  const Point2 p = flat(a);
  const Point2 d = flat(along);
  const double dd = d.x * d.x + d.y * d.y;
  if (!(dd > 0)) return true;
  const double middle = -(p.x * d.x + p.y * d.y) / dd;
  const Point2 nearest = {p.x + d.x * middle, p.y + d.y * middle};
  const double left = reach * reach - (nearest.x * nearest.x + nearest.y * nearest.y);
  if (!(left > 0)) return true;
  const double half = std::sqrt(left / dd);
  t0 = std::max(t0, middle - half);
  t1 = std::min(t1, middle + half);
  if (!(t0 < t1)) return true;
  return region_.Add({p.x + d.x * t0, p.y + d.y * t0}, {p.x + d.x * t1, p.y + d.y * t1});
}

CutDisc::Outcome CutDisc::Cut(const FeatureEdges& features, Vec3 position, Vec3 normal,
                              float radius, float reach, KernelKind kernel,
                              absl::FunctionRef<bool()> has_photons) {
  position_ = position;
  normal_ = normal;
  inverse_radius_ = 1 / radius;
  const Frame frame(normal);
  s_ = frame.s * inverse_radius_;
  t_ = frame.t * inverse_radius_;
  region_.Clear();
  bool has_room = true;
  bool is_known = false;
  bool is_empty = false;
  features.ForEachNear({position, normal, radius * reach, radius * kPlaneTolerance},
                       [&](const FeatureSegment& segment) {
                         if (!is_known) is_empty = !has_photons();
                         is_known = true;
                         if (is_empty) return false;
                         return has_room = AddSegment(segment, frame, static_cast<double>(reach));
                       });
  if (is_empty) return Outcome::kEmpty;
  if (!has_room || region_.segments() == 0) return Outcome::kWhole;
  region_.Finish();

  const double whole = 1 / Kernel{kernel}.Norm();
  const RegionMoments moments = region_.MomentsOf(kernel, 1);
  if (!(moments.zeroth > kLeastShare * whole)) return Outcome::kWhole;
  // As much of a kernel is left in a smaller disc, or more.
  whole_ = WeightFor(moments, whole);
  constexpr auto kInner = static_cast<double>(kInnerShare);
  inner_ = WeightFor(region_.MomentsOf(kernel, kInner), whole);
  inner_.slope_x /= kInnerShare;
  inner_.slope_y /= kInnerShare;
  if (reach > 1) FitLaplacian(static_cast<double>(reach));
  return Outcome::kCut;
}

// The part of 2u - 1 over the region that is at right angles to 1, x and y, by Gram and Schmidt.
void CutDisc::FitLaplacian(double reach) {
  const StarRegion::PowerMoments m = region_.PowerMomentsOf(reach);
  // Centred places, and their spread.
  const double area = m.zeroth[0];
  const double x = m.x[0] / area;
  const double y = m.y[0] / area;
  const double xx = m.xx - x * m.x[0];
  const double xy = m.xy - x * m.y[0];
  const double yy = m.yy - y * m.y[0];
  const double mean = (2 * m.zeroth[1] - area) / area;
  const double qx = 2 * m.x[1] - m.x[0] - mean * m.x[0];
  const double qy = 2 * m.y[1] - m.y[0] - mean * m.y[0];
  const double determinant = xx * yy - xy * xy;
  double bx = 0;
  double by = 0;
  if (determinant > 1e-9 * xx * yy) {
    bx = (yy * qx - xy * qy) / determinant;
    by = (xx * qy - xy * qx) / determinant;
  }
  const double left =
      4 * m.zeroth[2] - 4 * m.zeroth[1] + area - mean * mean * area - bx * qx - by * qy;
  const double of_whole = std::numbers::pi / 3;
  laplacian_scale_ = left > 1e-4 * of_whole ? static_cast<float>(std::sqrt(of_whole / left)) : 0.0F;
  laplacian_.constant = static_cast<float>(1 + mean - bx * x - by * y);
  laplacian_.slope_x = static_cast<float>(bx / reach);
  laplacian_.slope_y = static_cast<float>(by / reach);
  inverse_share_ = static_cast<float>(std::numbers::pi / area);
}

}  // namespace lucerna
