// How fine is the detail in the light around one photon's path?
//
// Across the path, a neighbouring ray is an offset x [m] and a turn θ [rad]. Around the photon the
// local light field is modelled, along one transverse axis, as
//
//   L(x, θ) ~ exp(-1/2 [(θ - v x)²/p + s x²])
//
// and g, h bound how the vergence v changes across the beam: that is what makes a caustic.
// Frequencies are angular, so s is also the variance of the amplitude spectrum of the irradiance
// on a plane across the ray. Unlike the entries of a covariance matrix these numbers are never
// differences of large ones, so no operator loses them.
//
// Each function is one event on a path: pure, in path order, without a look at the scene. All
// that it needs comes in as a number. An axis is tangential (in the plane of incidence) or
// sagittal (across it); a photon carries one spectrum for both, and every function combines the
// two: means of s, v, p, maxima of g, h.
//
// Promises of every function that returns a Spectrum
//   1. Every number of the outcome is within the limits, whatever finite numbers come in.
//   2. A NaN in a spectrum, a cosine or a curvature goes out again, so that a bad normal shows
//      where it is counted.
//   3. Only + - * / and square roots: the same bits on every machine of one numeric profile.
//
// Lengths are in the scene's unit, called metre here. Cosines are of angles to the normal, clamped
// to [0.02, 1]. A curvature κ [m⁻¹] is positive where the surface is convex towards the light that
// comes in, whichever side that is.
//
// Source: after Belcour & Soler 2011, "Frequency Based Kernel Estimation for Progressive Photon
// Mapping"; the form (s, v, p, g, h) and its equations are our own derivation.
#pragma once

#include <span>

#include "render/math/vector.h"

namespace lucerna {

struct Spectrum {
  double s = 0;  // spatial spectral variance [m⁻²]: 0 = even light, large = fine detail
  double v = 0;  // vergence [m⁻¹]: 1 / radius of the wavefront, > 0 diverging
  double p = 0;  // angular variance at one place [rad²]: the apparent size of the source
  double g = 0;  // bound of |dv/dx| [m⁻²]
  double h = 0;  // bound of |d²v/dx²| [m⁻³]

  constexpr bool operator==(const Spectrum&) const = default;
};

inline constexpr double kSmallestAngularVariance = 1e-14;  // [rad²]
inline constexpr double kLargestAngularVariance = 10;      // [rad²], no angular structure at all

// What a spectrum may be in a scene of one size. All limits scale with it, so a scene in
// millimetres and the same scene in kilometres shrink their radii alike.
struct SpectrumLimits {
  double source_s;         // [m⁻²], of a point source: a millionth of the diagonal wide
  double s;                // [m⁻²]
  double v;                // [m⁻¹]
  double g;                // [m⁻²]
  double h;                // [m⁻³]
  double curvature;        // [m⁻¹]
  double distance_m;       // the longest leg
  double edge_distance_m;  // the nearest that an edge may pass

  // For a scene whose bounds have this diagonal, which is held within the range of a normal float.
  [[nodiscard]] static SpectrumLimits ForDiagonal(double diagonal_m);
  [[nodiscard]] Spectrum Clamp(const Spectrum& spectrum) const;
};

// Sources.

[[nodiscard]] Spectrum PointSource(const SpectrumLimits& limits);

// A point whose intensity changes with direction: `relative_intensity` is that of the photon's
// direction over the largest, `relative_curvature` [rad⁻²] the size of its second derivative over
// the angle, over the largest intensity.
[[nodiscard]] Spectrum SpotSource(double relative_intensity, double relative_curvature,
                                  const SpectrumLimits& limits);
// Returns the largest relative curvature [rad⁻²] of a smooth-step falloff of this width.
[[nodiscard]] double SmoothFalloffCurvature(double width_rad);

// Area, centre and covariance of the points of an emitter, each point weighted by its area.
struct EmitterMoments {
  double area = 0;                                        // [m²]
  double x = 0, y = 0, z = 0;                             // centre [m]
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // covariance [m²]
};
[[nodiscard]] EmitterMoments TriangleMoments(Vec3 a, Vec3 b, Vec3 c);
// Requires a unit normal.
[[nodiscard]] EmitterMoments DiscMoments(Vec3 center, Vec3 normal, double radius_m);
// Both together. An emitter is the whole connected surface, never one small triangle of it.
[[nodiscard]] EmitterMoments Merge(const EmitterMoments& a, const EmitterMoments& b);

// A Lambertian emitter of any shape, as seen along the photon's unit direction: leaving at a slant,
// it is narrower across the ray.
[[nodiscard]] Spectrum AreaSource(const EmitterMoments& emitter, Vec3 direction,
                                  const SpectrumLimits& limits);
[[nodiscard]] Spectrum SphereSource(double radius_m, const SpectrumLimits& limits);
// All light from one direction.
[[nodiscard]] Spectrum DirectionalSource(const SpectrumLimits& limits);
// `laplacian` [rad⁻² × luminance] over the sphere of directions, of a map slightly blurred;
// `mean_luminance` is that of the whole map.
[[nodiscard]] Spectrum EnvironmentSource(double laplacian, double luminance, double mean_luminance,
                                         double texel_rad, const SpectrumLimits& limits);

// Flight.

// Free flight. Detail leaks into angle and the beam widens.
// With g = h = 0 a leg may be cut anywhere: Travel(a) then Travel(b) equals Travel(a + b), and s/p
// stays. With g the cut leg is up to a quarter lower in what g adds to s: cut only where an event
// is.
[[nodiscard]] Spectrum Travel(const Spectrum& spectrum, double distance_m,
                              const SpectrumLimits& limits);

// The field times a window of this precision [m⁻²] across the ray: s grows by it.
[[nodiscard]] Spectrum Narrow(const Spectrum& spectrum, double precision,
                              const SpectrumLimits& limits);

// How strongly an edge is felt by a photon that passes it, for a tolerated relative bias and the
// kernel's second moment: in [0, 1]. All that is known is that light reaches as far as the edge,
// and bias below the tolerance need not be resolved.
[[nodiscard]] double EdgeStrength(double relative_bias, double mu2);

// A silhouette edge near one leg.
struct PassedEdge {
  double along_m = 0;   // from the leg's start to where the edge is nearest
  double offset_m = 0;  // distance between edge and leg there
};

// The photon passes an edge at `offset_m`, with `rest_m` of its leg to go. A photon inside the
// penumbra to come counts the full edge. Requires the spectrum at the edge; returns it there.
[[nodiscard]] Spectrum PassEdge(const Spectrum& spectrum, double offset_m, double rest_m,
                                double strength, const SpectrumLimits& limits);

// One leg past edges sorted by along_m. Only the two that alone would leave the most detail at
// the leg's end count, so that a hedge costs no more than a wall. No edges: Travel.
[[nodiscard]] Spectrum TravelPastEdges(const Spectrum& spectrum, double distance_m,
                                       std::span<const PassedEdge> edges, double strength,
                                       const SpectrumLimits& limits);

// Surfaces that store or scatter.

// Returns the trace [m⁻²] of the irradiance's spectral covariance on the receiving surface: what
// a deposit carries. Includes the falloff at oblique incidence and the receiver's own principal
// curvatures. NaN if a NaN came in, else finite.
[[nodiscard]] double ReceivedTrace(const Spectrum& spectrum, double cosine, double curvature1,
                                   double curvature2, const SpectrumLimits& limits);

// Scattering that forgets direction. The lit patch, of the trace that arrived and with its own
// texture [m⁻²], is the new source. Complete only after LeaveDiffuse.
[[nodiscard]] Spectrum ScatterDiffusely(double received_trace, double texture_detail,
                                        const SpectrumLimits& limits);
// Before the first flight after ScatterDiffusely, once its length is known: an evenly lit wall
// ends somewhere, and the next leg's length is how far one may hope. Without it the bias was 17
// times the tolerance in a corner.
[[nodiscard]] Spectrum LeaveDiffuse(const Spectrum& spectrum, double next_distance_m,
                                    const SpectrumLimits& limits);

// Returns one texel's share of a texture's spectral variance per axis, in 1/texel-unit²; its mean
// over the texels is the texture's detail. `laplacian` in albedo/texel-unit².
[[nodiscard]] double TexelDetail(double laplacian, double albedo, double mean_albedo, double texel);

// A lobe of at least this variance [rad²] is as good as diffuse.
inline constexpr double kDiffuseLobe = 0.25;
// The variance per axis [rad²] of a GGX reflection lobe's core. Its tails have none that is finite.
[[nodiscard]] double ReflectedLobe(double alpha);
// The same through a rough boundary into the other medium. `ior_ratio` = n1/n2.
[[nodiscard]] double RefractedLobe(double alpha, double ior_ratio, double cosine);
// The mean of both axes at oblique incidence: a lobe is narrower across the plane of incidence.
[[nodiscard]] double ObliqueLobe(double lobe, double cosine);
// Directions blurred by a lobe of this variance [rad²], after Mirror or Refract.
[[nodiscard]] Spectrum Blur(const Spectrum& spectrum, double lobe, const SpectrumLimits& limits);

// How a surface bends at a point.
struct SurfaceBend {
  double tangential = 0;       // κ in the plane of incidence [m⁻¹]
  double sagittal = 0;         // κ across it [m⁻¹]
  double gradient = 0;         // bound of |dκ/ds| along the surface [m⁻²]
  double second_gradient = 0;  // bound of |d²κ/ds²| [m⁻³]

  constexpr bool operator==(const SurfaceBend&) const = default;
};

// What a hitpoint whose own lobe has variance `lobe` [rad²] sees of the light that arrives: only s
// changes. For ReceivedTrace.
[[nodiscard]] Spectrum SeeGlossily(const Spectrum& spectrum, double cosine, const SurfaceBend& bend,
                                   double lobe, const SpectrumLimits& limits);

// Specular surfaces, to second order.

// A mirror, and total internal reflection: seen from inside, a convex body has κ < 0.
[[nodiscard]] Spectrum Mirror(const Spectrum& spectrum, double cosine, const SurfaceBend& bend,
                              const SpectrumLimits& limits);
// Into the other medium, `ior_ratio` = n1/n2, `cosine` on the side of incidence. Where no light
// gets through (beyond the critical angle) it is Mirror.
[[nodiscard]] Spectrum Refract(const Spectrum& spectrum, double ior_ratio, double cosine,
                               const SurfaceBend& bend, const SpectrumLimits& limits);

}  // namespace lucerna
