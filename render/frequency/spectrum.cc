#include "render/frequency/spectrum.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lucerna {
namespace {

// Squared magnification of a beam at an exact focus of a point. A focus a millionth of the beam
// is finer than any radius.
constexpr double kSmallestMagnification = 1e-12;
constexpr double kSmallestFocus = 1e-9;  // of |u|, where it divides
constexpr double kSmallestCosine = 0.02;
constexpr double kTiny = 1e-300;

// Normalised angular curvature of the irradiance across the ray: cos³ under a point, cos⁴ under
// a Lambertian patch.
constexpr double kPointFalloff = 3;
constexpr double kLambertianFalloff = 4;
// A uniform patch as wide as the next leg: s' = 3/d² after the leg.
constexpr double kFiniteWall = 12;

double ClampCosine(double cosine) {
  return std::clamp(cosine, kSmallestCosine, 1.0);
}
double ClampIorRatio(double ior_ratio) {
  return std::clamp(ior_ratio, 0.01, 100.0);
}
double ClampDistance(double distance_m, const SpectrumLimits& limits) {
  return std::clamp(distance_m, 0.0, limits.distance_m);
}
double Square(double x) {
  return x * x;
}

SurfaceBend ClampBend(const SurfaceBend& bend, const SpectrumLimits& limits) {
  return {std::clamp(bend.tangential, -limits.curvature, limits.curvature),
          std::clamp(bend.sagittal, -limits.curvature, limits.curvature),
          std::clamp(std::abs(bend.gradient), 0.0, limits.g),
          std::clamp(std::abs(bend.second_gradient), 0.0, limits.h)};
}

// Both sides of a refraction.
struct Bending {
  double ratio;  // n1/n2
  double sin1, cos1, cos2;

  Bending(double ior_ratio, double cosine)
      : ratio(ClampIorRatio(ior_ratio)),
        sin1(std::sqrt(1 - Square(ClampCosine(cosine)))),
        cos1(ClampCosine(cosine)),
        cos2(CosineAfter(sin1)) {}
  [[nodiscard]] double CosineAfter(double sine) const {
    return std::sqrt(std::max(1 - Square(ratio * sine), Square(kSmallestCosine)));
  }
  // J / n2
  [[nodiscard]] double Power() const { return cos2 - ratio * cos1; }
};

// v' of the tangential axis for an incidence of this sine and cosine: f(θ) of 2.9.
double RefractedVergence(const Bending& bending, double sine, double cosine, double v,
                         double curvature) {
  const double cos2 = bending.CosineAfter(sine);
  return (bending.ratio * cosine * cosine * v - (cos2 - bending.ratio * cosine) * curvature) /
         (cos2 * cos2);
}

// A mirror's share of h on one axis: the vergence that it adds, differentiated twice.
double MirrorSecondGradient(double v, double sine, double cosine, double curvature,
                            double second_gradient) {
  const double size = std::abs(curvature);
  const double rate = curvature + v * cosine;
  return 2 * size * (1 + sine * sine) / (cosine * cosine * cosine) * rate * rate +
         16 * size * size * size + 2 * second_gradient / cosine;
}

// How the vergence that leaves a refraction changes along the surface, on one axis, but for the
// surface's own changes of curvature: by differences over a small turn of the incidence. The sine
// and cosine of that turn are constants, so no trigonometric function enters.
struct VergenceGradients {
  double first;   // by the turning of the incidence, signed
  double second;  // bound, changes of curvature included
};
VergenceGradients RefractGradients(const Bending& bending, double sine, double cosine, double cos2,
                                   double v, double curvature, const SurfaceBend& bend) {
  constexpr double kTurn = 0.02;                       // [rad]
  constexpr double kTurnSine = 0.019998666693333079;   // sin 0.02
  constexpr double kTurnCosine = 0.99980000666657778;  // cos 0.02
  const double here = RefractedVergence(bending, sine, cosine, v, curvature);
  const double more = RefractedVergence(bending, sine * kTurnCosine + cosine * kTurnSine,
                                        cosine * kTurnCosine - sine * kTurnSine, v, curvature);
  const double less = RefractedVergence(bending, sine * kTurnCosine - cosine * kTurnSine,
                                        cosine * kTurnCosine + sine * kTurnSine, v, curvature);
  const double rate = curvature + v * cosine;
  const double power = std::abs(cos2 - bending.ratio * cosine) / (cos2 * cos2);
  const double size = std::abs(curvature);
  return {(more - less) / (2 * kTurn) * rate,
          std::abs((more - here) - (here - less)) / (kTurn * kTurn) * rate * rate +
              std::abs(1 - bending.ratio) * size * size * size + power * bend.second_gradient};
}

// The steps below take a spectrum within the limits, so that they can be chained unclamped.

// At a slant, neighbouring rays meet the surface before or after the plane across the central ray,
// by x tan θ, and the surface bends away from its own tangent. Both tilt the beam's density along x
// and add to g; where signs are known the terms are summed before their size is taken, because they
// cancel at flat surfaces: a plane mirror changes nothing, a plane window little.

Spectrum MirrorStep(Spectrum in, double cosine, const SurfaceBend& bend) {
  const double sine = std::sqrt(1 - cosine * cosine);
  const double tangent = sine / cosine;
  const double kappa = bend.tangential;
  const double inverse = 1 / (cosine * cosine);
  return {in.s + Square(2 * tangent * kappa / cosine), in.v + 2 * kappa / cosine, in.p,
          in.g + 2 * bend.gradient * inverse +
              std::abs(6 * kappa * tangent * (kappa + in.v * cosine)) * inverse,
          in.h + MirrorSecondGradient(in.v, sine, cosine, kappa, bend.second_gradient) * inverse};
}

Spectrum RefractStep(Spectrum in, const Bending& bending, const SurfaceBend& bend) {
  const double kappa = bend.tangential;
  const double c1 = bending.cos1;
  const double c2 = bending.cos2;
  const double sin2 = bending.ratio * bending.sin1;
  const double v = RefractedVergence(bending, bending.sin1, c1, in.v, kappa);
  const VergenceGradients gradients =
      RefractGradients(bending, bending.sin1, c1, c2, in.v, kappa, bend);
  const double m = c2 / c1;
  const double q = bending.ratio * c1 * c1 / (c2 * c2);
  const double tangent1 = bending.sin1 / c1;
  const double tangent2 = sin2 / c2;
  const double tilt = 2 * (tangent2 * v - tangent1 * in.v / m) + kappa * (tangent2 - tangent1) / c2;
  const double power = std::abs(c2 - bending.ratio * c1) / (c2 * c2);
  return {in.s / (m * m) + tilt * tilt, v, in.p * Square(bending.ratio / m),
          in.g * q / m + power * bend.gradient / c2 +
              std::abs(gradients.first + sin2 * v * v - q * bending.sin1 * in.v * in.v) / c2,
          in.h * q / (m * m) + gradients.second / (c2 * c2)};
}

Spectrum MirrorSagittalStep(Spectrum in, double cosine, const SurfaceBend& bend) {
  // By symmetry about the plane of incidence v has no first gradient along this axis; its second
  // is that of normal incidence.
  return {in.s, in.v + 2 * bend.sagittal * cosine, in.p, 0,
          in.h + MirrorSecondGradient(in.v, 0, 1, bend.sagittal, bend.second_gradient)};
}

Spectrum RefractSagittalStep(Spectrum in, const Bending& bending, const SurfaceBend& bend) {
  const double ratio = bending.ratio;
  const VergenceGradients gradients = RefractGradients(bending, 0, 1, 1, in.v, bend.sagittal, bend);
  return {in.s, ratio * in.v - bending.Power() * bend.sagittal, in.p * ratio * ratio, 0,
          in.h * ratio + gradients.second};
}

// The mean of s, v and p of two axes, the maximum of g and h.
Spectrum BothAxes(const Spectrum& tangential, const Spectrum& sagittal) {
  return {(tangential.s + sagittal.s) / 2, (tangential.v + sagittal.v) / 2,
          (tangential.p + sagittal.p) / 2, std::max(tangential.g, sagittal.g),
          std::max(tangential.h, sagittal.h)};
}

}  // namespace

SpectrumLimits SpectrumLimits::ForDiagonal(double diagonal_m) {
  const double size = std::clamp(diagonal_m, 1e-38, 1e38);
  const double inverse = 1 / size;
  const double inverse2 = inverse * inverse;
  return {.source_s = 1e12 * inverse2,
          .s = 1e24 * inverse2,
          .v = 1e9 * inverse,
          .g = 1e18 * inverse2,
          .h = 1e27 * inverse2 * inverse,
          .curvature = 1e6 * inverse,
          .distance_m = 1e6 * size,
          .edge_distance_m = 1e-6 * size};
}

Spectrum SpectrumLimits::Clamp(const Spectrum& spectrum) const {
  return {std::clamp(spectrum.s, 0.0, s), std::clamp(spectrum.v, -v, v),
          std::clamp(spectrum.p, kSmallestAngularVariance, kLargestAngularVariance),
          std::clamp(spectrum.g, 0.0, g), std::clamp(spectrum.h, 0.0, h)};
}

Spectrum PointSource(const SpectrumLimits& limits) {
  return limits.Clamp({.s = limits.source_s, .p = 1 / kPointFalloff});
}

Spectrum SpotSource(double relative_intensity, double relative_curvature,
                    const SpectrumLimits& limits) {
  const double falloff =
      kPointFalloff + std::abs(relative_curvature) / std::clamp(relative_intensity, 0.05, 1.0);
  return limits.Clamp({.s = limits.source_s, .p = 1 / falloff});
}

double SmoothFalloffCurvature(double width_rad) {
  return 6 / std::max(width_rad * width_rad, kTiny);
}

EmitterMoments TriangleMoments(Vec3 a, Vec3 b, Vec3 c) {
  const auto x = [](Vec3 p) {
    return std::array{static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)};
  };
  const std::array corners = {x(a), x(b), x(c)};
  std::array<double, 3> center{};
  std::array<double, 3> u{};
  std::array<double, 3> w{};
  for (std::size_t i = 0; i < 3; ++i) {
    center[i] = (corners[0][i] + corners[1][i] + corners[2][i]) / 3;
    u[i] = corners[1][i] - corners[0][i];
    w[i] = corners[2][i] - corners[0][i];
  }
  const double area =
      0.5 * std::sqrt(Square(u[1] * w[2] - u[2] * w[1]) + Square(u[2] * w[0] - u[0] * w[2]) +
                      Square(u[0] * w[1] - u[1] * w[0]));
  // The covariance of a triangle's points is a quarter of that of its three corners.
  const auto covariance = [&](std::size_t i, std::size_t j) {
    double sum = 0;
    for (const auto& corner : corners)
      sum += (corner[i] - center[i]) * (corner[j] - center[j]);
    return sum / 12;
  };
  return {area,
          center[0],
          center[1],
          center[2],
          covariance(0, 0),
          covariance(0, 1),
          covariance(0, 2),
          covariance(1, 1),
          covariance(1, 2),
          covariance(2, 2)};
}

EmitterMoments DiscMoments(Vec3 center, Vec3 normal, double radius_m) {
  const double variance = radius_m * radius_m / 4;
  const double x = normal.x;
  const double y = normal.y;
  const double z = normal.z;
  return {4 * variance * 3.14159265358979323846,
          center.x,
          center.y,
          center.z,
          variance * (1 - x * x),
          -variance * x * y,
          -variance * x * z,
          variance * (1 - y * y),
          -variance * y * z,
          variance * (1 - z * z)};
}

EmitterMoments Merge(const EmitterMoments& a, const EmitterMoments& b) {
  const double area = a.area + b.area;
  if (!(area > 0)) return a;
  const double wa = a.area / area;
  const double wb = b.area / area;
  const double dx = b.x - a.x;
  const double dy = b.y - a.y;
  const double dz = b.z - a.z;
  const double between = wa * wb;
  return {area,
          a.x + wb * dx,
          a.y + wb * dy,
          a.z + wb * dz,
          wa * a.xx + wb * b.xx + between * dx * dx,
          wa * a.xy + wb * b.xy + between * dx * dy,
          wa * a.xz + wb * b.xz + between * dx * dz,
          wa * a.yy + wb * b.yy + between * dy * dy,
          wa * a.yz + wb * b.yz + between * dy * dz,
          wa * a.zz + wb * b.zz + between * dz * dz};
}

Spectrum AreaSource(const EmitterMoments& emitter, Vec3 direction, const SpectrumLimits& limits) {
  // The covariance seen along the ray is the emitter's, projected onto the plane across the ray:
  // a 2 × 2 matrix of trace tr C - d·Cd and determinant d·adj(C)d. The mean of its two inverse
  // eigenvalues is trace / (2 determinant). In units of tr C, so that nothing overflows.
  const double unit = std::clamp(emitter.xx + emitter.yy + emitter.zz, kTiny, 1 / kTiny);
  const auto in_units = [unit](double x) { return std::clamp(x / unit, -1.0, 1.0); };
  const double xx = in_units(emitter.xx);
  const double xy = in_units(emitter.xy);
  const double xz = in_units(emitter.xz);
  const double yy = in_units(emitter.yy);
  const double yz = in_units(emitter.yz);
  const double zz = in_units(emitter.zz);
  const double x = std::clamp(static_cast<double>(direction.x), -1.0, 1.0);
  const double y = std::clamp(static_cast<double>(direction.y), -1.0, 1.0);
  const double z = std::clamp(static_cast<double>(direction.z), -1.0, 1.0);
  const double trace = xx + yy + zz - (x * x * xx + y * y * yy + z * z * zz) -
                       2 * (x * y * xy + x * z * xz + y * z * yz);
  const double determinant =
      x * x * (yy * zz - yz * yz) + y * y * (xx * zz - xz * xz) + z * z * (xx * yy - xy * xy) +
      2 * (x * y * (xz * yz - xy * zz) + x * z * (xy * yz - xz * yy) + y * z * (xy * xz - xx * yz));
  const double precision = std::max(trace, 0.0) / (2 * std::max(determinant, 1e-30)) / unit;
  // Without extent (a point, a line, an edge-on sheet) it is as small as a source may be.
  const bool has_extent = !(determinant <= 1e-30) && !(emitter.xx + emitter.yy + emitter.zz <= 0);
  return limits.Clamp(
      {.s = has_extent ? std::clamp(precision, 0.0, limits.source_s) : limits.source_s,
       .p = 1 / kLambertianFalloff});
}

Spectrum SphereSource(double radius_m, const SpectrumLimits& limits) {
  const double s = 4 / std::max(radius_m * radius_m, kTiny);
  return limits.Clamp({.s = std::clamp(s, 0.0, limits.source_s), .p = 1 / kPointFalloff});
}

Spectrum DirectionalSource(const SpectrumLimits& limits) {
  return limits.Clamp({.p = kSmallestAngularVariance});
}

Spectrum EnvironmentSource(double laplacian, double luminance, double mean_luminance,
                           double texel_rad, const SpectrumLimits& limits) {
  // Dark texels carry little flux: what they do to it counts against a twentieth of the mean.
  const double level = std::max({luminance, 0.05 * mean_luminance, kTiny});
  const double detail =
      std::min(std::abs(laplacian) / level, 12 / std::max(texel_rad * texel_rad, kTiny));
  return limits.Clamp({.p = 1 / std::max(detail, kTiny)});
}

Spectrum Travel(const Spectrum& spectrum, double distance_m, const SpectrumLimits& limits) {
  const Spectrum in = limits.Clamp(spectrum);
  const double d = ClampDistance(distance_m, limits);
  const double u = 1 + in.v * d;
  const double size = std::max(std::abs(u), kSmallestFocus);
  // The beam's density is 1/u, and u varies across it.
  const double s = in.s + in.h * d / size + 3 * Square(in.g * d / size);
  // In this order p s d does not overflow before d² would make it large.
  const double blur = in.p * s * d * d;
  // The beam's squared magnification: the vergence and the spread of directions. Neither term is
  // negative, so nothing cancels.
  const double magnification = std::max(u * u + blur, kSmallestMagnification);
  const double k = std::sqrt(magnification);
  const double k3 = magnification * k;
  return limits.Clamp({s / magnification, (in.v * u + in.p * s * d) / magnification,
                       in.p / magnification, in.g / k3,
                       in.h / (k3 * k) + 3 * in.g * in.g * d / (k3 * magnification)});
}

Spectrum Narrow(const Spectrum& spectrum, double precision, const SpectrumLimits& limits) {
  Spectrum out = limits.Clamp(spectrum);
  out.s += std::clamp(precision, 0.0, limits.s);
  return limits.Clamp(out);
}

double EdgeStrength(double relative_bias, double mu2) {
  return std::clamp(relative_bias / mu2, 0.0, 1.0);
}

Spectrum PassEdge(const Spectrum& spectrum, double offset_m, double rest_m, double strength,
                  const SpectrumLimits& limits) {
  const Spectrum in = limits.Clamp(spectrum);
  const double offset = std::clamp(offset_m, limits.edge_distance_m, limits.distance_m);
  const double rest = ClampDistance(rest_m, limits);
  double precision = std::clamp(strength, 0.0, 1.0) / (offset * offset);
  const double u = 1 + in.v * rest;
  const double blur = in.p * rest * rest;
  // Within two standard deviations of the penumbra the photon's own distance to the edge says
  // nothing: the penumbra's width does (to 1 %).
  if (Square(u * offset) < 4 * blur) precision = std::max(precision, 100 * u * u / blur);
  return Narrow(in, precision, limits);
}

Spectrum TravelPastEdges(const Spectrum& spectrum, double distance_m,
                         std::span<const PassedEdge> edges, double strength,
                         const SpectrumLimits& limits) {
  const double distance = ClampDistance(distance_m, limits);
  const auto along = [&](const PassedEdge& edge) {
    return std::clamp(edge.along_m, 0.0, distance);
  };
  // The two that matter most, by the detail that each alone leaves at the end. A NaN matters.
  const PassedEdge* first = nullptr;
  const PassedEdge* second = nullptr;
  double first_s = 0;
  double second_s = 0;
  if (edges.size() <= 2) {
    if (!edges.empty()) first = &edges.front();
    if (edges.size() == 2) second = &edges.back();
  } else {
    for (const PassedEdge& edge : edges) {
      const double t = along(edge);
      const Spectrum at_edge = Travel(spectrum, t, limits);
      const double rest = distance - t;
      const double s =
          Travel(PassEdge(at_edge, edge.offset_m, rest, strength, limits), rest, limits).s;
      if (first == nullptr || !(s <= first_s)) {
        second = first;
        second_s = first_s;
        first = &edge;
        first_s = s;
      } else if (second == nullptr || !(s <= second_s)) {
        second = &edge;
        second_s = s;
      }
    }
    if (second < first) std::swap(first, second);
  }
  Spectrum now = spectrum;
  double gone = 0;
  for (const PassedEdge* edge : {first, second}) {
    if (edge == nullptr) continue;
    const double t = along(*edge);
    now = Travel(now, t - gone, limits);
    now = PassEdge(now, edge->offset_m, distance - t, strength, limits);
    gone = t;
  }
  return Travel(now, distance - gone, limits);
}

double ReceivedTrace(const Spectrum& spectrum, double cosine, double curvature1, double curvature2,
                     const SpectrumLimits& limits) {
  const Spectrum in = limits.Clamp(spectrum);
  const double c2 = Square(ClampCosine(cosine));
  const double k1 = std::clamp(curvature1, -limits.curvature, limits.curvature);
  const double k2 = std::clamp(curvature2, -limits.curvature, limits.curvature);
  // Along the plane of incidence the irradiance falls off as a power of the cosine, which no
  // Gaussian follows: 12 bounds the curvature of that for points and for patches.
  return in.s * (1 + c2) + 12 * (1 - c2) * in.v * in.v + k1 * k1 + k2 * k2;
}

Spectrum ScatterDiffusely(double received_trace, double texture_detail,
                          const SpectrumLimits& limits) {
  return limits.Clamp({.s = received_trace / 2 + texture_detail, .p = 1 / kLambertianFalloff});
}

Spectrum LeaveDiffuse(const Spectrum& spectrum, double next_distance_m,
                      const SpectrumLimits& limits) {
  Spectrum out = limits.Clamp(spectrum);
  const double d = ClampDistance(next_distance_m, limits);
  // Not std::max(s, wall): a NaN of either must come out.
  const double wall = d * d > 0 ? kFiniteWall / (d * d) : HUGE_VAL;
  if (!(out.s >= wall)) out.s = std::isnan(out.s) ? out.s : wall;
  return limits.Clamp(out);
}

double TexelDetail(double laplacian, double albedo, double mean_albedo, double texel) {
  const double level = std::max({albedo, 0.1 * mean_albedo, 1e-6});
  return std::min(std::abs(laplacian) / level, 4 / std::max(texel * texel, 1e-100)) / 2;
}

double ReflectedLobe(double alpha) {
  return 1.2 * Square(std::clamp(alpha, 0.0, 1.0));
}

double RefractedLobe(double alpha, double ior_ratio, double cosine) {
  // A normal turned by δ turns a mirrored ray by 2δ, a refracted one by J/(n2 cos2) δ.
  const Bending bending(ior_ratio, cosine);
  return ReflectedLobe(alpha) * Square(bending.Power() / (2 * bending.cos2));
}

double ObliqueLobe(double lobe, double cosine) {
  return lobe * (1 + Square(ClampCosine(cosine))) / 2;
}

Spectrum Blur(const Spectrum& spectrum, double lobe, const SpectrumLimits& limits) {
  Spectrum out = limits.Clamp(spectrum);
  out.p += std::clamp(lobe, 0.0, kLargestAngularVariance);
  return limits.Clamp(out);
}

Spectrum SeeGlossily(const Spectrum& spectrum, double cosine, const SurfaceBend& bend, double lobe,
                     const SpectrumLimits& limits) {
  Spectrum out = limits.Clamp(spectrum);
  const SurfaceBend held = ClampBend(bend, limits);
  const double c = ClampCosine(cosine);
  const double q = 1 / std::clamp(lobe, kSmallestAngularVariance, kLargestAngularVariance);
  const double tangential = out.v + 2 * held.tangential / c;
  const double sagittal = out.v + 2 * held.sagittal * c;
  out.s += (tangential * tangential + sagittal * sagittal) / 2 * (q / (1 + out.p * q));
  return limits.Clamp(out);
}

Spectrum Mirror(const Spectrum& spectrum, double cosine, const SurfaceBend& bend,
                const SpectrumLimits& limits) {
  const Spectrum in = limits.Clamp(spectrum);
  const SurfaceBend held = ClampBend(bend, limits);
  const double c = ClampCosine(cosine);
  return limits.Clamp(BothAxes(MirrorStep(in, c, held), MirrorSagittalStep(in, c, held)));
}

Spectrum Refract(const Spectrum& spectrum, double ior_ratio, double cosine, const SurfaceBend& bend,
                 const SpectrumLimits& limits) {
  const Bending bending(ior_ratio, cosine);
  if (bending.ratio * bending.sin1 >= 1) return Mirror(spectrum, cosine, bend, limits);
  const Spectrum in = limits.Clamp(spectrum);
  const SurfaceBend held = ClampBend(bend, limits);
  return limits.Clamp(
      BothAxes(RefractStep(in, bending, held), RefractSagittalStep(in, bending, held)));
}

}  // namespace lucerna
