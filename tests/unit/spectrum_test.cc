// Every operator does to a spectrum what its equation says, and stays within the limits.
//
// The vectors were made by an independent implementation of the same equations; it, in turn, was
// checked against sampled light fields and exact ray tracing.
#include "render/frequency/spectrum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"

namespace lucerna {
namespace {

const SpectrumLimits kSpectrumLimits = SpectrumLimits::ForDiagonal(1);
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Spectrum Of(double s, double v, double p, double g = 0, double h = 0) {
  return {s, v, p, g, h};
}

void ExpectWithin(const Spectrum& spectrum, const SpectrumLimits& limits, const std::string& what) {
  EXPECT_EQ(spectrum, limits.Clamp(spectrum)) << what;
  for (const double number : {spectrum.s, spectrum.v, spectrum.p, spectrum.g, spectrum.h}) {
    EXPECT_TRUE(std::isfinite(number)) << what;
  }
}

// The tangential axis of a reflection: a sagittal curvature of 0 leaves s, v and p of the other
// axis as they were and its h below this one's, so that it can be taken out of the mean.
Spectrum TangentialMirror(const Spectrum& in, double cosine, double curvature) {
  const Spectrum both = Mirror(in, cosine, {.tangential = curvature}, kSpectrumLimits);
  return Of(2 * both.s - in.s, 2 * both.v - in.v, 2 * both.p - in.p, both.g, both.h);
}
// The same of a refraction, whose sagittal axis is that of a plane: v of n1/n2, p of its square.
Spectrum TangentialRefract(const Spectrum& in, double ior_ratio, double cosine, double curvature) {
  const Spectrum both = Refract(in, ior_ratio, cosine, {.tangential = curvature}, kSpectrumLimits);
  return Of(2 * both.s - in.s, 2 * both.v - ior_ratio * in.v,
            2 * both.p - ior_ratio * ior_ratio * in.p, both.g, both.h);
}

struct Vector {
  const char* name;
  Spectrum got;
  Spectrum expected;
  double tolerance = 1e-6;
};

TEST(SpectrumVectorsTest, AreMet) {
  const Spectrum point = Of(1e12, 0, 1.0 / 3);
  const Spectrum lamp = AreaSource(DiscMoments({}, {0, 0, 1}, 0.2), {0, 0, 1}, kSpectrumLimits);
  const std::vector<Vector> vectors = {
      {"U1", Travel(Of(4, 0, 0.25), 2, kSpectrumLimits), Of(0.8, 0.4, 0.05)},
      {"U2", Travel(point, 5, kSpectrumLimits), Of(0.12, 0.2, 4e-14)},
      {"U3", Travel(Travel(point, 2, kSpectrumLimits), 3, kSpectrumLimits), Of(0.12, 0.2, 4e-14)},
      {"U4", Travel(Of(0, 0, 5.4e-6), 100, kSpectrumLimits), Of(0, 0, 5.4e-6)},
      {"U5", Travel(Narrow(Of(0, 0, 5.4e-6), 1e8, kSpectrumLimits), 10, kSpectrumLimits),
       Of(1851.81756, 0.0999981482, 9.99981482e-11)},
      {"U6", Travel(Of(100, -2, 1e-4), 0.5, kSpectrumLimits), Of(40000, 2, 0.04)},
      {"U7", Travel(Of(100, -2, 1e-4), 1, kSpectrumLimits),
       Of(99.009901, 1.99009901, 9.9009901e-5)},
      {"U14", Blur(Of(4, 0.5, 0.04), 0.01, kSpectrumLimits), Of(4, 0.5, 0.05)},
      {"U17", Travel(Of(0, -0.5, 1e-6, 0, 2), 1, kSpectrumLimits),
       Of(15.999744, -0.999968001, 3.999936e-6, 0, 31.998976)},
      {"U19", TangentialMirror(Of(0, 0, 1e-6), std::cos(0.5), -1),
       Of(1.55006668, -2.27898785, 1e-6, 4.25606704, 25.5005777)},
      {"U20", TangentialRefract(Of(0, 0, 1e-6), 1 / 1.5, std::cos(0.4), 1),
       Of(0.131170382, -0.377087411, 4.04294802e-7, 0.200297151, 1.09974019), 1e-5},
      {"U21",
       Travel(Narrow(Travel(lamp, 2, kSpectrumLimits), 1e10, kSpectrumLimits), 1, kSpectrumLimits),
       Of(403.999964, 0.99999994, 9.9999991e-11)},
  };
  for (const Vector& vector : vectors) {
    const auto expect = [&](double got, double expected, const char* which) {
      EXPECT_NEAR(got, expected, vector.tolerance * std::abs(expected))
          << vector.name << " " << which;
    };
    expect(vector.got.s, vector.expected.s, "s");
    expect(vector.got.v, vector.expected.v, "v");
    expect(vector.got.p, vector.expected.p, "p");
    expect(vector.got.g, vector.expected.g, "g");
    expect(vector.got.h, vector.expected.h, "h");
  }
}

TEST(SpectrumVectorsTest, AnExactFocusOfAVaryingVergenceIsFinite) {  // U18
  const Spectrum focus = Travel(Of(0, -1, 1e-4, 0.5, 2), 1, kSpectrumLimits);
  EXPECT_NEAR(focus.s, 10000, 1e-2);
  EXPECT_NEAR(focus.v, 1, 1e-6);
  ExpectWithin(focus, kSpectrumLimits, "U18");
}

TEST(ReceivedTraceTest, MeetsItsVectors) {
  EXPECT_NEAR(ReceivedTrace(Of(3, 0, 0.1), 0.6, 0, 0, kSpectrumLimits), 4.08, 1e-6);   // U15
  EXPECT_NEAR(ReceivedTrace(Of(3, 1, 0.1), 0.6, 0, 0, kSpectrumLimits), 11.76, 1e-6);  // U26
  // A receiver's own curvatures: E ~ cos(kx) has exactly k².
  EXPECT_NEAR(ReceivedTrace(Of(3, 1, 0.1), 0.6, 2, -3, kSpectrumLimits), 11.76 + 13, 1e-6);
}

// Under a point and under a Lambertian patch on a parallel plane, at distance r, the normalised
// Laplacian of the irradiance is |9 sin² - 6 cos²|/r² and |16 sin² - 8 cos²|/r².
TEST(ReceivedTraceTest, BoundsTheExactFalloffOfPointsAndPatches) {
  const double r = 2;
  const Spectrum point = Travel(PointSource(kSpectrumLimits), r, kSpectrumLimits);
  const Spectrum patch = Travel(
      AreaSource(DiscMoments({}, {0, 0, 1}, 1e-4), {0, 0, 1}, kSpectrumLimits), r, kSpectrumLimits);
  for (double angle = 0; angle < 1.5; angle += 0.05) {
    const double c = std::cos(angle);
    const double s2 = 1 - c * c;
    EXPECT_GE(ReceivedTrace(point, c, 0, 0, kSpectrumLimits) * (1 + 1e-6),
              std::abs(9 * s2 - 6 * c * c) / (r * r));
    EXPECT_GE(ReceivedTrace(patch, c, 0, 0, kSpectrumLimits) * (1 + 1e-6),
              std::abs(16 * s2 - 8 * c * c) / (r * r));
  }
  EXPECT_NEAR(ReceivedTrace(point, 1, 0, 0, kSpectrumLimits), 6 / (r * r), 1e-5);
  EXPECT_NEAR(ReceivedTrace(patch, 1, 0, 0, kSpectrumLimits), 8 / (r * r), 1e-5);
}

TEST(SourceTest, HaveTheSecondMomentsOfTheirShapes) {
  const Vec3 up = {0, 0, 1};
  const double c2 = 0.36;
  // Slanted by cos 0.6 one axis is narrower.
  EXPECT_NEAR(AreaSource(DiscMoments({5, 6, 7}, up, 0.5), {0.8F, 0, 0.6F}, kSpectrumLimits).s,
              4 / 0.25 * (1 + 1 / c2) / 2, 1e-4);
  // Two triangles are a rectangle, wherever it stands: 6 (1/w² + 1/h²).
  const Vec3 a = {10, -3, 2};
  const Vec3 b = {14, -3, 2};
  const Vec3 c = {14, -1, 2};
  const Vec3 d = {10, -1, 2};
  const EmitterMoments one = TriangleMoments(a, b, c);
  const EmitterMoments both = Merge(one, TriangleMoments(a, c, d));
  EXPECT_NEAR(both.area, 8, 1e-12);
  EXPECT_NEAR(both.x, 12, 1e-12);
  EXPECT_NEAR(AreaSource(both, up, kSpectrumLimits).s, 6 * (1.0 / 16 + 1.0 / 4), 1e-9);
  // 1.5 (a² + b² + c²)/A².
  EXPECT_NEAR(AreaSource(one, up, kSpectrumLimits).s, 1.5 * (16 + 4 + 20) / 16, 1e-9);
  EXPECT_EQ(AreaSource(one, up, kSpectrumLimits).p, 0.25);
  // The moments do not depend on how the emitter is turned.
  const EmitterMoments turned = Merge(TriangleMoments({2, 10, -3}, {2, 14, -3}, {2, 14, -1}),
                                      TriangleMoments({2, 10, -3}, {2, 14, -1}, {2, 10, -1}));
  EXPECT_NEAR(AreaSource(turned, {1, 0, 0}, kSpectrumLimits).s,
              AreaSource(both, up, kSpectrumLimits).s, 1e-12);
  // Nothing is left of a point, a line or an edge-on sheet but the smallest source.
  EXPECT_EQ(AreaSource(EmitterMoments{}, up, kSpectrumLimits).s, kSpectrumLimits.source_s);
  EXPECT_EQ(AreaSource(TriangleMoments(a, b, b), up, kSpectrumLimits).s, kSpectrumLimits.source_s);
  EXPECT_EQ(AreaSource(one, {1, 0, 0}, kSpectrumLimits).s, kSpectrumLimits.source_s);
}

TEST(SourceTest, HaveTheSpectraOfTheirTable) {
  const double d = 3;
  const Spectrum point = Travel(PointSource(kSpectrumLimits), d, kSpectrumLimits);
  EXPECT_NEAR(point.s, 3 / (d * d), 1e-6);
  EXPECT_NEAR(point.v, 1 / d, 1e-6);
  EXPECT_NEAR(point.p / (1e-12 / (d * d)), 1, 1e-6);
  EXPECT_NEAR(SpotSource(1, 0, kSpectrumLimits).p, 1.0 / 3, 1e-12);
  EXPECT_NEAR(SpotSource(0.5, SmoothFalloffCurvature(0.5), kSpectrumLimits).p, 1 / (3 + 48.0),
              1e-12);
  EXPECT_EQ(SpotSource(0, 2, kSpectrumLimits).p, SpotSource(0.05, 2, kSpectrumLimits).p);
  EXPECT_NEAR(SphereSource(0.5, kSpectrumLimits).s, 16, 1e-12);
  EXPECT_NEAR(SphereSource(0.5, kSpectrumLimits).p, 1.0 / 3, 1e-12);
  EXPECT_EQ(DirectionalSource(kSpectrumLimits), Of(0, 0, kSmallestAngularVariance));
  EXPECT_NEAR(EnvironmentSource(-50, 2, 1, 0.01, kSpectrumLimits).p, 0.04, 1e-12);
  EXPECT_NEAR(EnvironmentSource(50, 0, 1, 0.01, kSpectrumLimits).p, 0.001,
              1e-12);  // 0.05 of the mean
  EXPECT_NEAR(EnvironmentSource(1e9, 1, 1, 0.01, kSpectrumLimits).p, 1e-4 / 12, 1e-15);
  EXPECT_EQ(EnvironmentSource(0, 1, 1, 0.01, kSpectrumLimits).p, kLargestAngularVariance);
}

// Peak of 1 + m cos kx: m k²/(1 + m) along one axis, half of it per axis.
TEST(SourceTest, ATexelsDetailIsItsNormalisedCurvature) {
  const double m = 0.5;
  const double k = 3;
  EXPECT_NEAR(TexelDetail(-m * k * k, 1 + m, 1, 0.01), m * k * k / (1 + m) / 2, 1e-12);
  EXPECT_NEAR(TexelDetail(1e9, 1, 1, 0.1), 200, 1e-9);  // no finer than its texels
  EXPECT_NEAR(TexelDetail(1, 0, 1, 0.1), 5, 1e-12);     // against a tenth of the mean
}

TEST(TravelTest, LegsAddUpAndKeepEtendue) {
  KeyedRng rng(11);
  int compared = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto log_uniform = [&](double low, double high) {
      return std::pow(10, low + (high - low) * static_cast<double>(rng.Uniform()));
    };
    const double sign = rng.Uniform() < 0.5F ? -1 : 1;
    const Spectrum in = Of(log_uniform(-4, 6), sign * log_uniform(-3, 2), log_uniform(-8, -1));
    const double a = log_uniform(-3, 1);
    const double b = log_uniform(-3, 1);
    const Spectrum middle = Travel(in, a, kSpectrumLimits);
    const Spectrum cut = Travel(middle, b, kSpectrumLimits);
    const Spectrum whole = Travel(in, a + b, kSpectrumLimits);
    const auto unclamped = [](const Spectrum& x) {
      return x.p > kSmallestAngularVariance && x.p < kLargestAngularVariance;
    };
    if (!unclamped(middle) || !unclamped(whole)) continue;
    ++compared;
    // A rounding of u = 1 + v d, magnified where the beam comes near a focus; `pinch` of the whole
    // leg and of its first part.
    const auto pinch = [&](double d) {
      const double u = 1 + in.v * d;
      return std::max(1.0, (1 + std::abs(in.v * d)) / std::sqrt(u * u + in.p * in.s * d * d));
    };
    const double bound = 64 * 0x1p-53 * pinch(a) * pinch(a) * pinch(a + b);
    EXPECT_NEAR(cut.s / whole.s, 1, bound);
    EXPECT_NEAR(cut.p / whole.p, 1, bound);
    EXPECT_NEAR((cut.v - whole.v) / std::sqrt(whole.v * whole.v + whole.s), 0,
                bound * (1 + std::sqrt(whole.p)));
    // Both numbers are divided by the same one.
    EXPECT_NEAR(whole.s / whole.p / (in.s / in.p), 1, 8 * 0x1p-53);
    // At normal incidence a mirror adds no detail at once.
    const Spectrum mirrored = Mirror(in, 1, {2, 2, 1, 1}, kSpectrumLimits);
    EXPECT_EQ(mirrored.s, in.s);
    EXPECT_EQ(mirrored.p, in.p);
  }
  EXPECT_GT(compared, 15000);
}

// Refraction scales etendue by (n2/n1)² on each axis. At a plane, in parallel light, s has no other
// term.
TEST(RefractTest, ScalesEtendueByTheSquaredIndexRatio) {
  const Spectrum in = Of(3, 0, 0.02);
  for (const double cosine : {1.0, 0.8, 0.3, 0.1}) {
    const Spectrum t = TangentialRefract(in, 1 / 1.5, cosine, 0);
    EXPECT_NEAR(t.s / t.p / (in.s / in.p), 2.25, 1e-11);
  }
}

// Coddington's equations, and Snell's law differentiated. Vectors U8 to U11: tangential axis, then
// sagittal.
TEST(FirstOrderTest, VergenceAndSizeFollowCoddington) {
  const Spectrum in = Of(1, 0.25, 0.01);
  const SurfaceBend bend = {.tangential = 0.5, .sagittal = 0.5};
  const double cos30 = std::cos(std::numbers::pi / 6);
  EXPECT_NEAR(TangentialMirror(in, 0.5, 0.5).v, 2.25, 1e-12);
  EXPECT_NEAR(Mirror(in, 0.5, bend, kSpectrumLimits).v, (2.25 + 0.75) / 2, 1e-12);
  EXPECT_NEAR(Mirror(in, 0.5, bend, kSpectrumLimits).p, 0.01, 1e-12);
  EXPECT_NEAR(TangentialRefract(in, 1 / 1.5, cos30, 0.5).v, -0.0649455595, 1e-9);
  EXPECT_NEAR(TangentialRefract(in, 1 / 1.5, cos30, 0.5).p, 0.00375, 1e-9);
  EXPECT_NEAR(Refract(in, 1 / 1.5, cos30, bend, kSpectrumLimits).v,
              (-0.0649455595 - 0.0160627195) / 2, 1e-9);
  EXPECT_NEAR(Refract(in, 1 / 1.5, cos30, bend, kSpectrumLimits).p, (0.00375 + 0.00444444444) / 2,
              1e-9);
}

// With h alone and collimated light a leg may still be cut; g² d² is not additive, and a cut leg
// keeps at least (a² + ab + b²)/(a + b)² >= 3/4 of it. g and h themselves compose.
TEST(TravelTest, OfSecondOrderLosesAtMostAQuarterWhenCut) {
  for (const double a : {0.1, 0.5, 1.0, 3.0}) {
    const double b = 1;
    const Spectrum bent = Of(0, 0, 0, 0, 2);
    EXPECT_NEAR(Travel(Travel(bent, a, kSpectrumLimits), b, kSpectrumLimits).s /
                    Travel(bent, a + b, kSpectrumLimits).s,
                1, 1e-9);
    const Spectrum sheared = Of(0, 0, 0, 0.5, 0);
    const Spectrum cut = Travel(Travel(sheared, a, kSpectrumLimits), b, kSpectrumLimits);
    const Spectrum whole = Travel(sheared, a + b, kSpectrumLimits);
    EXPECT_NEAR(cut.s / whole.s, (a * a + a * b + b * b) / ((a + b) * (a + b)), 1e-9);
    EXPECT_GE(cut.s / whole.s, 0.75 - 1e-9);
    EXPECT_NEAR(cut.g, whole.g, 1e-9);
    EXPECT_NEAR(cut.h, whole.h, 1e-9);
  }
}

// A pencil of rays in a plane meets a circle: what leaves, by exact reflection and refraction.
struct Pencil {
  double curvature, incidence_rad, vergence;
  double ior_ratio;  // 0: a mirror

  struct Leaving {
    double in, out, slope;  // offsets across the central ray before and after, and tangent to it
  };
  // Of the ray that meets the surface at arc length `s`.
  [[nodiscard]] Leaving At(double s) const {
    const double k = curvature;
    const double px = k == 0 ? s : std::sin(k * s) / k;
    const double py = k == 0 ? 0 : (std::cos(k * s) - 1) / k;
    const double nx = std::sin(k * s);
    const double ny = std::cos(k * s);
    const double ax = std::sin(incidence_rad);
    const double ay = -std::cos(incidence_rad);
    // All rays of the pencil pass the point 1/vergence before the surface.
    double dx = ax + vergence * px;
    double dy = ay + vergence * py;
    const double norm = std::hypot(dx, dy);
    dx /= norm;
    dy /= norm;
    const auto turned = [&](double ux, double uy, double mx, double my) {
      const double cosine = -(ux * mx + uy * my);
      if (ior_ratio == 0) return std::array{ux + 2 * cosine * mx, uy + 2 * cosine * my};
      const double root = std::sqrt(1 - ior_ratio * ior_ratio * (1 - cosine * cosine));
      const double along = ior_ratio * cosine - root;
      return std::array{ior_ratio * ux + along * mx, ior_ratio * uy + along * my};
    };
    // Where the ray through p along u crosses the line through the origin across the axis a.
    const auto offset = [&](double ux, double uy, double bx, double by) {
      const double t = -(px * bx + py * by) / (ux * bx + uy * by);
      return -(px + t * ux) * by + (py + t * uy) * bx;
    };
    const auto axis = turned(ax, ay, 0, 1);
    const auto out = turned(dx, dy, nx, ny);
    return {offset(dx, dy, ax, ay), offset(out[0], out[1], axis[0], axis[1]),
            (-out[0] * axis[1] + out[1] * axis[0]) / (out[0] * axis[0] + out[1] * axis[1])};
  }
};

TEST(SecondOrderTest, VergenceAndDensityChangeAsExactRaysSay) {
  for (const Pencil& pencil :
       {Pencil{1, 0.5, 0, 0}, Pencil{-1, 0.5, 0, 0}, Pencil{-1, 0.5, 1, 0},
        Pencil{0.5, 0.4, -0.7, 0}, Pencil{0, 0.7, 1, 0}, Pencil{1, 0.4, 0, 1 / 1.5},
        Pencil{1, 0.4, 1, 1 / 1.5}, Pencil{-1, 0.2, -1.3, 1.5}, Pencil{0, 0.5, 1, 1 / 1.33},
        Pencil{0, 0.8, 1, 1 / 1.0001}}) {
    constexpr double kStep = 1e-3;
    const Pencil::Leaving far = pencil.At(-kStep);
    const Pencil::Leaving near = pencil.At(kStep);
    // slope = v x + g x²/2 through both.
    const double g = 2 * (near.slope / near.out - far.slope / far.out) / (near.out - far.out);
    const double v = near.slope / near.out - g * near.out / 2;
    // Density is dx/dx', here from halfway to one ray and halfway to the other.
    const double before = far.in / far.out;
    const double after = near.in / near.out;
    const double tilt = (after - before) / ((near.out - far.out) / 2) / ((after + before) / 2);
    const double cosine = std::cos(pencil.incidence_rad);
    const Spectrum in = Of(0, pencil.vergence, 1e-6);
    const Spectrum out = pencil.ior_ratio == 0
                             ? TangentialMirror(in, cosine, pencil.curvature)
                             : TangentialRefract(in, pencil.ior_ratio, cosine, pencil.curvature);
    const std::string what = std::to_string(pencil.curvature) + " " +
                             std::to_string(pencil.vergence) + " " +
                             std::to_string(pencil.ior_ratio);
    EXPECT_NEAR(out.v, v, 1e-4 * (1 + std::abs(v))) << what;
    // Differences of second order over a thousandth, and the operator's own over 0.02.
    EXPECT_NEAR(out.g, std::abs(g), 2e-3 * (1 + std::abs(g))) << what;
    EXPECT_NEAR(std::sqrt(out.s), std::abs(tilt), 2e-3 * (1 + std::abs(tilt))) << what;
  }
}

// From here the isotropic functions, against their axes.

TEST(MirrorTest, CombinesBothAxes) {
  const Spectrum in = Of(2, 0.3, 0.01, 0.4, 0.6);
  const SurfaceBend bend = {
      .tangential = 0.7, .sagittal = -0.4, .gradient = 0.2, .second_gradient = 0.1};
  const double c = 0.8;
  const Spectrum both = Mirror(in, c, bend, kSpectrumLimits);
  const double tilt = 2 * 0.75 * 0.7 / c;  // 2 κ tan θ / cos θ
  EXPECT_NEAR(both.s, in.s + tilt * tilt / 2, 1e-12);
  EXPECT_NEAR(both.v, in.v + 0.7 / c - 0.4 * c, 1e-12);  // 2.8, isotropic
  EXPECT_NEAR(both.p, in.p, 1e-15);
  // Only the tangential axis has a first gradient; h is the larger of both.
  const SurfaceBend tangential = {.tangential = 0.7, .gradient = 0.2, .second_gradient = 0.1};
  const SurfaceBend sagittal = {.sagittal = -0.4, .gradient = 0.2, .second_gradient = 0.1};
  EXPECT_EQ(both.g, Mirror(in, c, tangential, kSpectrumLimits).g);
  EXPECT_EQ(both.h, std::max(Mirror(in, c, tangential, kSpectrumLimits).h,
                             Mirror(in, c, sagittal, kSpectrumLimits).h));
  // A flat mirror changes nothing, at any slant.
  const Spectrum flat = Mirror(in, c, {}, kSpectrumLimits);
  EXPECT_EQ(flat, in);
}

TEST(MirrorTest, AcrossThePlaneOfIncidenceHasTheCurvatureOfTheSagittalAxis) {
  const SurfaceBend bend = {.tangential = 0, .sagittal = 2};
  const Spectrum both = Mirror(Of(0, 0, 1e-6), 0.5, bend, kSpectrumLimits);
  EXPECT_NEAR(both.v, 2 * 2 * 0.5 / 2, 1e-12);
  EXPECT_EQ(both.g, 0);
  EXPECT_NEAR(both.h, 2 * 2 * 4 + 16 * 8, 1e-9);
}

TEST(RefractTest, CombinesBothAxesAndReflectsBeyondTheCriticalAngle) {
  const Spectrum in = Of(2, 0.3, 0.01, 0.4, 0.6);
  const SurfaceBend bend = {.tangential = -0.7, .sagittal = -0.7};
  const double ratio = 1.5;
  const Spectrum t = TangentialRefract(in, ratio, 0.9, -0.7);
  const double power = std::sqrt(1 - ratio * ratio * (1 - 0.81)) - ratio * 0.9;
  const Spectrum s = Of(in.s, ratio * in.v + power * 0.7, ratio * ratio * in.p);
  const Spectrum both = Refract(in, ratio, 0.9, bend, kSpectrumLimits);
  EXPECT_NEAR(both.s, (t.s + s.s) / 2, 1e-12);
  EXPECT_NEAR(both.v, (t.v + s.v) / 2, 1e-12);
  EXPECT_NEAR(both.p, (t.p + s.p) / 2, 1e-12);
  EXPECT_NEAR(both.g, t.g, 1e-12);
  EXPECT_EQ(Refract(in, ratio, 0.5, bend, kSpectrumLimits), Mirror(in, 0.5, bend, kSpectrumLimits));
  EXPECT_NE(Refract(in, ratio, 0.76, bend, kSpectrumLimits),
            Mirror(in, 0.76, bend, kSpectrumLimits));
}

// A boundary between equal media is not there.
TEST(RefractTest, WithoutAChangeOfMediumKeepsTheFirstOrder) {
  const Spectrum in = Of(2, 0.3, 0.01);
  const Spectrum out = Refract(in, 1, 0.7, {0.5, 0.5, 0, 0}, kSpectrumLimits);
  EXPECT_NEAR(out.s, in.s, 1e-12);
  EXPECT_NEAR(out.v, in.v, 1e-12);
  EXPECT_NEAR(out.p, in.p, 1e-12);
}

TEST(EdgeTest, IsFeltByTheInverseSquareOfItsDistance) {
  EXPECT_DOUBLE_EQ(EdgeStrength(0.02, 0.25), 0.08);
  EXPECT_EQ(EdgeStrength(0.5, 0.25), 1);
  const Spectrum sun = DirectionalSource(kSpectrumLimits);
  EXPECT_NEAR(PassEdge(sun, 0.1, 1, 0.08, kSpectrumLimits).s, 8, 1e-9);
  // What is nearer than a millionth of the scene is there.
  EXPECT_NEAR(PassEdge(sun, 0, 0, 1, kSpectrumLimits).s / 1e12, 1, 1e-12);
}

TEST(EdgeTest, InsideThePenumbraLeavesThePenumbrasWidth) {
  const double p = 0.01;
  const double rest = 2;
  // Two standard deviations: 2 √p rest = 0.4.
  const Spectrum inside = PassEdge(Of(0, 0, p), 0.399, rest, 0.08, kSpectrumLimits);
  EXPECT_NEAR(Travel(inside, rest, kSpectrumLimits).s * p * rest * rest, 1, 0.011);
  const Spectrum outside = PassEdge(Of(0, 0, p), 0.401, rest, 0.08, kSpectrumLimits);
  EXPECT_NEAR(outside.s, 0.08 / (0.401 * 0.401), 1e-12);
}

TEST(EdgeTest, OfManyOnlyTheTwoStrongestCount) {
  const Spectrum in = Of(1, 0.1, 1e-8);
  const std::array edges = {PassedEdge{0.5, 0.9}, PassedEdge{1, 0.01}, PassedEdge{1.5, 0.7},
                            PassedEdge{2.5, 0.02}, PassedEdge{2.9, 0.8}};
  const std::array strongest = {edges[1], edges[3]};
  const Spectrum all = TravelPastEdges(in, 3, edges, 0.08, kSpectrumLimits);
  EXPECT_EQ(all, TravelPastEdges(in, 3, strongest, 0.08, kSpectrumLimits));
  Spectrum by_hand = PassEdge(Travel(in, 1, kSpectrumLimits), 0.01, 2, 0.08, kSpectrumLimits);
  by_hand = PassEdge(Travel(by_hand, 1.5, kSpectrumLimits), 0.02, 0.5, 0.08, kSpectrumLimits);
  EXPECT_EQ(all, Travel(by_hand, 0.5, kSpectrumLimits));
  // Applied in the order of the path, also when the later one is the stronger.
  const std::array rising = {PassedEdge{0.5, 0.9}, PassedEdge{1, 0.05}, PassedEdge{2.5, 0.01}};
  const std::array last_two = {rising[1], rising[2]};
  EXPECT_EQ(TravelPastEdges(in, 3, rising, 0.08, kSpectrumLimits),
            TravelPastEdges(in, 3, last_two, 0.08, kSpectrumLimits));
  EXPECT_EQ(TravelPastEdges(in, 3, {}, 0.08, kSpectrumLimits), Travel(in, 3, kSpectrumLimits));
}

TEST(DiffuseTest, ForgetsDirectionsAndHopesNoFurtherThanTheNextLeg) {
  EXPECT_EQ(ScatterDiffusely(8, 1, kSpectrumLimits), Of(5, 0, 0.25));
  const double d = 2;
  const Spectrum even = LeaveDiffuse(ScatterDiffusely(0, 0, kSpectrumLimits), d, kSpectrumLimits);
  EXPECT_NEAR(even.s, 12 / (d * d), 1e-12);
  EXPECT_NEAR(Travel(even, d, kSpectrumLimits).s, 3 / (d * d), 1e-12);
  EXPECT_NEAR(Travel(even, d, kSpectrumLimits).v, 0.75 / d, 1e-12);
  EXPECT_EQ(LeaveDiffuse(Of(5, 0, 0.25), d, kSpectrumLimits).s, 5);
  EXPECT_EQ(LeaveDiffuse(Of(5, 0, 0.25), 0, kSpectrumLimits).s, kSpectrumLimits.s);
}

TEST(LobeTest, HaveTheirVariances) {
  EXPECT_NEAR(ReflectedLobe(0.1), 0.012, 1e-12);
  EXPECT_NEAR(ObliqueLobe(0.012, 0.5), 0.0075, 1e-12);
  // At normal incidence into glass a normal turned by δ turns the ray by δ/3, a sixth of a mirror.
  EXPECT_NEAR(RefractedLobe(0.1, 1 / 1.5, 1), 0.012 / 36, 1e-12);
}

TEST(LobeTest, AGlossyHitpointSeesTheVergenceOfEachAxis) {
  const Spectrum in = Of(4, 0.5, 0.04);
  // U12 and U13: s + v² q / (1 + p q) with q = 1 / 0.01.
  EXPECT_NEAR(SeeGlossily(in, 1, {}, 0.01, kSpectrumLimits).s, 9, 1e-12);
  EXPECT_NEAR(SeeGlossily(Of(4, 0.5, 0), 1, {}, 0.01, kSpectrumLimits).s, 29, 1e-9);
  const SurfaceBend bend = {.tangential = 0.3, .sagittal = -0.2};
  const double t = 0.5 + 2 * 0.3 / 0.8;
  const double s = 0.5 - 2 * 0.2 * 0.8;
  EXPECT_NEAR(SeeGlossily(in, 0.8, bend, 0.01, kSpectrumLimits).s,
              4 + (t * t + s * s) / 2 * 100 / 5, 1e-9);
}

// A scene in other units shrinks its radii alike: s by 1/L², v by 1/L, ... exactly for powers of 2.
TEST(SpectrumTest, ScalesWithTheScene) {
  constexpr double kScale = 1024;
  const SpectrumLimits large = SpectrumLimits::ForDiagonal(kScale);
  const auto scaled = [](const Spectrum& x) {
    return Of(x.s / (kScale * kScale), x.v / kScale, x.p, x.g / (kScale * kScale),
              x.h / (kScale * kScale * kScale));
  };
  const SurfaceBend bend = {0.7, -0.4, 0.2, 0.1};
  const SurfaceBend large_bend = {0.7 / kScale, -0.4 / kScale, 0.2 / (kScale * kScale),
                                  0.1 / (kScale * kScale * kScale)};
  const Spectrum start = PointSource(kSpectrumLimits);
  const auto chain = [](Spectrum x, const SurfaceBend& b, double size,
                        const SpectrumLimits& limits) {
    x = Travel(x, 2 * size, limits);
    x = PassEdge(x, 0.01 * size, 1 * size, 0.08, limits);
    x = Refract(Travel(x, 1 * size, limits), 1 / 1.5, 0.9, b, limits);
    x = Mirror(Travel(x, 0.5 * size, limits), 0.6, b, limits);
    return Travel(x, 1e3 * size, limits);
  };
  const Spectrum small = scaled(chain(start, bend, 1, kSpectrumLimits));
  const Spectrum big = chain(PointSource(large), large_bend, kScale, large);
  EXPECT_NEAR(big.s / small.s, 1, 1e-9);
  EXPECT_NEAR(big.v / small.v, 1, 1e-9);
  EXPECT_NEAR(big.p / small.p, 1, 1e-9);
  EXPECT_NEAR(big.g / small.g, 1, 1e-9);
  EXPECT_NEAR(big.h / small.h, 1, 1e-9);
}

TEST(SpectrumHazardTest, StaysFiniteWhereTheTableSaysItCouldNot) {
  const Spectrum focus = Travel(Of(1, -1, 0), 1, kSpectrumLimits);
  EXPECT_NEAR(focus.s / 1e12, 1, 1e-6);
  ExpectWithin(focus, kSpectrumLimits, "exact focus of a point");
  ExpectWithin(Travel(Of(1e24, 0, 10), 1e6, kSpectrumLimits), kSpectrumLimits,
               "p s d² near the float range");
  EXPECT_NEAR(Travel(Of(7, 2, 0.01), 1e-6, kSpectrumLimits).s / 7, 1, 1e-5);
  EXPECT_EQ(Travel(Of(0, 0, 5e-6), 1e6, kSpectrumLimits).s, 0);
  const double grazing = std::cos(89.9 * std::numbers::pi / 180);
  const SurfaceBend spike = {1e6, -1e6, 1e6, 1e6};
  ExpectWithin(Refract(Of(4, 2, 0.01), 1 / 1.5, grazing, spike, kSpectrumLimits), kSpectrumLimits,
               "grazing");
  ExpectWithin(Mirror(Of(4, 2, 0.01), 0, spike, kSpectrumLimits), kSpectrumLimits,
               "grazing mirror");
  const double critical = std::sqrt(1 - 1 / 2.25);
  ExpectWithin(Refract(Of(4, 2, 0.01), 1.5, critical * (1 + 1e-12), spike, kSpectrumLimits),
               kSpectrumLimits, "critical angle");
  Spectrum many = Of(1e4, 0, 0.25);
  for (int i = 0; i < 300; ++i)
    many = Travel(Mirror(many, 0.7, spike, kSpectrumLimits), 0.3, kSpectrumLimits);
  ExpectWithin(many, kSpectrumLimits, "300 spikes");
  for (const double diagonal : {0.0, -1.0, 1e-300, 1e-38, 1e38, 1e300}) {
    const SpectrumLimits limits = SpectrumLimits::ForDiagonal(diagonal);
    ExpectWithin(Travel(PointSource(limits), 1, limits), limits, "size of the scene");
  }
}

// Every function with every combination of the numbers that break arithmetic.
TEST(SpectrumHazardTest, IsWithinItsLimitsForAnyFiniteNumbers) {
  constexpr double kMax = std::numeric_limits<double>::max();
  const std::array odd = {0.0, 1e-308, 1e-160, 1.0,    -1.0,  -1e-12, 1e-6,
                          0.5, 1e6,    1e9,    -1e160, 1e200, kMax,   -kMax};
  KeyedRng rng(12);
  const auto pick = [&] { return odd[rng.Bits() % odd.size()]; };
  const auto pick_float = [&] { return static_cast<float>(std::clamp(pick(), -3.0e38, 3.0e38)); };
  for (int i = 0; i < 200000; ++i) {
    const SpectrumLimits limits =
        SpectrumLimits::ForDiagonal(std::array{1.0, 1e-38, 1e38, 30.0}[rng.Bits() % 4]);
    const Spectrum x = Of(pick(), pick(), pick(), pick(), pick());
    const SurfaceBend bend = {pick(), pick(), pick(), pick()};
    const std::array edges = {PassedEdge{pick(), pick()}, PassedEdge{pick(), pick()},
                              PassedEdge{pick(), pick()}};
    const EmitterMoments moments = {pick(), pick(), pick(), pick(), pick(),
                                    pick(), pick(), pick(), pick(), pick()};
    const Vec3 way = {pick_float(), pick_float(), pick_float()};
    const std::array outcomes = {
        limits.Clamp(x),
        SpotSource(pick(), pick(), limits),
        SpotSource(pick(), SmoothFalloffCurvature(pick()), limits),
        AreaSource(moments, way, limits),
        AreaSource(Merge(TriangleMoments({pick_float(), 1, pick_float()}, way, {1, 2, 3}),
                         DiscMoments(way, {0, 0, 1}, static_cast<double>(pick_float()))),
                   way, limits),
        SphereSource(pick(), limits),
        EnvironmentSource(pick(), pick(), pick(), pick(), limits),
        Travel(x, pick(), limits),
        Narrow(x, pick(), limits),
        PassEdge(x, pick(), pick(), pick(), limits),
        TravelPastEdges(x, pick(), edges, pick(), limits),
        ScatterDiffusely(pick(), pick(), limits),
        LeaveDiffuse(x, pick(), limits),
        Blur(x, pick(), limits),
        Blur(x, ObliqueLobe(RefractedLobe(pick(), pick(), pick()), pick()), limits),
        SeeGlossily(x, pick(), bend, pick(), limits),
        Mirror(x, pick(), bend, limits),
        Refract(x, pick(), pick(), bend, limits),
    };
    for (std::size_t k = 0; k < outcomes.size(); ++k) {
      ExpectWithin(outcomes[k], limits, "function " + std::to_string(k));
    }
    ASSERT_TRUE(std::isfinite(ReceivedTrace(x, pick(), pick(), pick(), limits)));
    ASSERT_TRUE(std::isfinite(TexelDetail(pick(), 0.5, 0.4, pick())));
    ASSERT_FALSE(HasFailure()) << i;
  }
}

// A bad normal must be seen where deposits are counted, not turned into a wide kernel.
TEST(SpectrumHazardTest, LetsANaNThrough) {
  const SurfaceBend bend = {0.5, 0.5, 0, 0};
  const auto seen = [](const Spectrum& x) {
    return std::isnan(ReceivedTrace(Travel(x, 1, kSpectrumLimits), 0.7, 0, 0, kSpectrumLimits));
  };
  const Spectrum fine = Of(1, 0.5, 0.1);
  for (const Spectrum& bad : {Of(kNaN, 0.5, 0.1), Of(1, kNaN, 0.1), Of(1, 0.5, kNaN),
                              Of(1, 0.5, 0.1, kNaN), Of(1, 0.5, 0.1, 0, kNaN)}) {
    EXPECT_TRUE(seen(bad));
    EXPECT_TRUE(seen(Mirror(bad, 0.7, bend, kSpectrumLimits)));
    EXPECT_TRUE(seen(Refract(bad, 1.5, 0.9, bend, kSpectrumLimits)));
    EXPECT_TRUE(seen(Blur(bad, 0.1, kSpectrumLimits)));
    EXPECT_TRUE(seen(PassEdge(bad, 0.1, 1, 1, kSpectrumLimits)));
    EXPECT_TRUE(seen(LeaveDiffuse(bad, 1, kSpectrumLimits)));
  }
  EXPECT_TRUE(seen(Mirror(fine, kNaN, bend, kSpectrumLimits)));
  EXPECT_TRUE(seen(Mirror(fine, 0.7, {kNaN, 0.5, 0, 0}, kSpectrumLimits)));
  EXPECT_TRUE(seen(Refract(fine, 1.5, kNaN, bend, kSpectrumLimits)));
  EXPECT_TRUE(std::isnan(ReceivedTrace(fine, kNaN, 0, 0, kSpectrumLimits)));
}

// Every state at its lower clamp, in the middle or at its upper clamp, through every event with
// arguments at their own: the outcome is within the limits, and so is what a second event makes of
// it.
TEST(SpectrumHazardTest, MapsEveryCombinationOfClampsIntoTheLimits) {
  for (const double diagonal : {1e-20, 1.0, 1e20}) {
    const SpectrumLimits limits = SpectrumLimits::ForDiagonal(diagonal);
    const double middle_v = 1 / diagonal;
    const std::array lengths = {0.0, limits.edge_distance_m, diagonal, limits.distance_m};
    const std::array curvatures = {-limits.curvature, -middle_v, 0.0, middle_v, limits.curvature};
    int states = 0;
    for (const double s : {0.0, middle_v * middle_v, limits.s}) {
      for (const double v : {-limits.v, -middle_v, 0.0, limits.v}) {
        for (const double p : {kSmallestAngularVariance, 0.25, kLargestAngularVariance}) {
          for (const double g : {0.0, limits.g}) {
            for (const double h : {0.0, limits.h}) {
              ++states;
              const Spectrum x = Of(s, v, p, g, h);
              std::vector<Spectrum> outcomes;
              for (const double length : lengths) {
                outcomes.push_back(Travel(x, length, limits));
                outcomes.push_back(PassEdge(x, length, limits.distance_m - length, 1, limits));
                outcomes.push_back(LeaveDiffuse(x, length, limits));
              }
              for (const double cosine : {0.0, 0.02, 0.7, 1.0}) {
                for (const double curvature : curvatures) {
                  const SurfaceBend bend = {curvature, -curvature, limits.g, limits.h};
                  outcomes.push_back(Mirror(x, cosine, bend, limits));
                  for (const double ratio : {0.01, 1 / 1.5, 1.0, 1.5, 100.0})
                    outcomes.push_back(Refract(x, ratio, cosine, bend, limits));
                  const double trace = ReceivedTrace(x, cosine, curvature, -curvature, limits);
                  ASSERT_TRUE(std::isfinite(trace) && trace >= 0);
                  outcomes.push_back(ScatterDiffusely(trace, limits.s, limits));
                }
              }
              for (const double lobe : {0.0, 1e-12, kDiffuseLobe, 1e12})
                outcomes.push_back(Blur(x, lobe, limits));
              for (const Spectrum& outcome : outcomes) {
                ExpectWithin(outcome, limits, "first");
                ExpectWithin(Travel(outcome, diagonal, limits), limits, "second");
              }
              ASSERT_FALSE(HasFailure());
            }
          }
        }
      }
    }
    EXPECT_EQ(states, 3 * 4 * 3 * 2 * 2);
  }
}

}  // namespace
}  // namespace lucerna
