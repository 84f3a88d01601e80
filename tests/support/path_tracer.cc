#include "tests/support/path_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "render/base/parallel.h"
#include "render/geometry/intersector.h"
#include "render/geometry/surface_uv.h"
#include "render/math/color_space.h"
#include "render/math/double3.h"
#include "render/math/equal_area_square.h"
#include "render/math/rng.h"
#include "render/math/warp.h"
#include "render/scene/density_grid.h"
#include "render/scene/subsurface_table.h"
#include "render/scene/texture.h"
#include "render/transport/bump.h"
#include "tests/support/hair_reference.h"

namespace lucerna {
namespace {

using Color = std::array<double, 3>;

constexpr Color Times(const Color& a, const Color& b) {
  return {a[0] * b[0], a[1] * b[1], a[2] * b[2]};
}
constexpr Color Times(const Color& a, double s) {
  return {a[0] * s, a[1] * s, a[2] * s};
}
constexpr void AddTo(Color& sum, const Color& term) {
  for (std::size_t c = 0; c < 3; ++c)
    sum[c] += term[c];
}
double Largest(const Color& c) {
  return std::max(c[0], std::max(c[1], c[2]));
}
Color FromFloat(Rgb c) {
  return {static_cast<double>(c.r), static_cast<double>(c.g), static_cast<double>(c.b)};
}
// Scenes and images are in Rec. 709, products of colours are taken in the working space.
Color Working(const Color& c) {
  Color out{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      out[i] += kWorkingFrom709[i][k] * c[k];
  }
  return out;
}

// --- surfaces ----------------------------------------------------------------------------------

// Unpolarised, by the law of Snell and the amplitudes of Fresnel. `eta`: index where the light
// goes over the index where it is; cos_i in (0, 1].
double DielectricReflectance(double cos_i, double eta, double& cos_t) {
  const double sin2_t = (1 - cos_i * cos_i) / (eta * eta);
  if (sin2_t >= 1) {
    cos_t = 0;
    return 1;
  }
  cos_t = std::sqrt(1 - sin2_t);
  const double s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
  const double p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
  return (s * s + p * p) / 2;
}

// The same amplitudes with the complex index n + i·k.
double ConductorReflectance(double cos_i, double n, double k) {
  const std::complex<double> index2 = std::complex<double>(n, k) * std::complex<double>(n, k);
  const std::complex<double> b = std::sqrt(index2 - (1 - cos_i * cos_i));  // index · cos θt
  const std::complex<double> s = (cos_i - b) / (cos_i + b);
  const std::complex<double> p = (index2 * cos_i - b) / (index2 * cos_i + b);
  return (std::norm(s) + std::norm(p)) / 2;
}

struct Surface {
  Material::Kind kind = Material::Kind::kDiffuse;
  bool is_smooth = false;
  bool is_coat_smooth = false;
  bool gathers = false;
  Color reflectance{};  // diffuse, working space
  Color eta{}, k{};     // conductor, Rec. 709
  double ior = 1, alpha_u = 0, alpha_v = 0;
  double around_metal = 1;  // the index that eta and k of a metal under a coat are divided by
  Color transmittance{};    // of a sheet, working space
  double thickness = 0;     // of a coat
  int base_hits = 0;
  Color coat_albedo{};  // of one scattering in it; over a metal Rec. 709
  double phase_g = 0;   // its mean cosine
  bool is_base_smooth = false;
  double base_alpha_u = 0, base_alpha_v = 0;     // of the metal under a coat
  ReferenceFibre fibre;                          // hair
  Color reflection_tint{}, transmission_tint{};  // metals and dielectrics
  // Below a surface.
  const SubsurfaceTable* below = nullptr;
  Color extinction{};
};

// With what textures of roughness and thickness say in place of the numbers.
Material CompletedAt(const Scene& scene, const Material& material, const TexturePlace& place) {
  Material here = material;
  const auto set_widths = [&](std::size_t first, float& alpha_u, float& alpha_v) {
    const std::array<float*, 2> widths = {&alpha_u, &alpha_v};
    for (std::size_t i = 0; i < 2; ++i) {
      const std::int32_t texture = material.roughness_textures[first + i];
      if (texture == kNoTexture) continue;
      const float roughness = std::clamp(TextureNumber(scene.textures, texture, place), 0.0F, 1.0F);
      *widths[i] = material.remaps_roughness ? std::sqrt(roughness) : roughness;
    }
    if (std::max(alpha_u, alpha_v) < 1e-3F) alpha_u = alpha_v = 0;
  };
  if (material.HasRoughnessTexture()) {
    set_widths(0, here.alpha_u, here.alpha_v);
    set_widths(2, here.base_alpha_u, here.base_alpha_v);
    here.may_be_smooth = here.base_may_be_smooth = false;
  }
  if (material.thickness_texture != kNoTexture) {
    here.thickness =
        std::max(TextureNumber(scene.textures, material.thickness_texture, place), 0.0F);
  }
  return here;
}

Surface SurfaceOf(const Scene& scene, const SurfacePoint& point) {
  const TexturePlace place = {UvAt(scene, point), point.position, point.geometric_normal,
                              VertexColorAt(scene, point)};
  const Material material = CompletedAt(scene, scene.materials[point.material], place);
  Surface surface;
  surface.kind = material.kind;
  surface.is_smooth = IsSmooth(material);
  surface.is_coat_smooth = material.alpha_u == 0 && material.alpha_v == 0;
  surface.gathers = Gathers(material);
  surface.reflectance = Working(FromFloat(material.reflectance));
  surface.eta = FromFloat(material.eta);
  surface.k = FromFloat(material.k);
  surface.ior = static_cast<double>(material.ior);
  surface.around_metal = material.is_metal_in_coat ? 1 : surface.ior;
  surface.alpha_u = static_cast<double>(std::max(material.alpha_u, 1e-4F));
  surface.alpha_v = static_cast<double>(std::max(material.alpha_v, 1e-4F));
  surface.transmittance = Working(FromFloat(material.transmittance));
  surface.thickness = static_cast<double>(material.thickness);
  surface.base_hits = material.base_hits;
  surface.coat_albedo = FromFloat(material.coat_albedo);
  if (material.kind != Material::Kind::kCoatedConductor)
    surface.coat_albedo = Working(surface.coat_albedo);
  surface.phase_g = static_cast<double>(material.phase_g);
  surface.is_base_smooth = material.base_alpha_u == 0 && material.base_alpha_v == 0;
  surface.base_alpha_u = static_cast<double>(std::max(material.base_alpha_u, 1e-4F));
  surface.base_alpha_v = static_cast<double>(std::max(material.base_alpha_v, 1e-4F));
  surface.fibre = {static_cast<double>(material.ior), static_cast<double>(material.beta_m),
                   static_cast<double>(material.beta_n), static_cast<double>(material.scale_tilt),
                   Working(FromFloat(material.absorption))};
  surface.reflection_tint = Working(FromFloat(material.reflection_tint));
  surface.transmission_tint = Working(FromFloat(material.transmission_tint));
  surface.below = material.below;
  surface.extinction = Working(FromFloat(material.extinction));
  if (material.texture != kNoTexture) {
    const Color color = FromFloat(TextureColor(scene.textures, material.texture, place));
    surface.reflectance = Working(Times(color, static_cast<double>(material.texture_scale)));
    surface.eta = {1, 1, 1};
    for (std::size_t c = 0; c < 3; ++c) {
      // (k² / (4 + k²)) is the reflectance at right angles for n = 1.
      const double r = std::min(color[c], 0.9999);
      surface.k[c] = 2 * std::sqrt(r / (1 - r));
    }
  }
  if (material.second_texture != kNoTexture) {
    const Color color = FromFloat(TextureColor(scene.textures, material.second_texture, place));
    surface.transmittance = Working(Times(color, static_cast<double>(material.texture_scale)));
  }
  return surface;
}

// Rec. 709. `outside`: the index of what the metal is in.
Color MetalColor(const Surface& surface, double cos_i, double outside = 1) {
  Color reflected{};
  for (std::size_t c = 0; c < 3; ++c) {
    reflected[c] = ConductorReflectance(std::min(1.0, cos_i), surface.eta[c] / outside,
                                        surface.k[c] / outside);
  }
  return reflected;
}

double SmithLambda(const Surface& surface, Double3 w) {
  const double x = surface.alpha_u * w.x;
  const double y = surface.alpha_v * w.y;
  return (std::sqrt(1 + (x * x + y * y) / (w.z * w.z)) - 1) / 2;
}

Double3 Unit(Double3 v) {
  return v * (1 / Length(v));
}

// A facet with density D(m)·cosθ.
Double3 DrawFacet(const Surface& surface, double u1, double u2) {
  const double slope = std::sqrt(u1 / (1 - u1));
  const double phi = 2 * kPi64 * u2;
  return Unit(
      {surface.alpha_u * slope * std::cos(phi), surface.alpha_v * slope * std::sin(phi), 1});
}

// A facet that light meets, and the weight of a direction that it sends light to.
struct Facet {
  Double3 m;
  double cos_m = 0;
  double share = 0;  // of reflection
  double cos_t = 0;
};

// `up`: where the light comes from, up.z > 0. False: no facet is seen.
bool MeetFacet(const Surface& surface, Double3 up, double eta, double u1, double u2, Facet& facet) {
  facet.m = surface.is_coat_smooth ? Double3{0, 0, 1} : DrawFacet(surface, u1, u2);
  facet.cos_m = Dot(up, facet.m);
  if (!(facet.cos_m > 0)) return false;
  facet.share = DielectricReflectance(std::min(1.0, facet.cos_m), eta, facet.cos_t);
  return true;
}

// Walter et al. eq. (41).
double FacetWeight(const Surface& surface, const Facet& facet, Double3 up, Double3 leaving) {
  if (surface.is_coat_smooth) return 1;
  const double g2 = 1 / (1 + SmithLambda(surface, up) + SmithLambda(surface, leaving));
  return facet.cos_m * g2 / (up.z * facet.m.z);
}

struct Scattered {
  Double3 wi;
  Color weight{};  // f·|cosθ| / density
  bool is_delta = false;
  double index = 1;  // where wi is over where wo is
};

Double3 CosineDirection(double u1, double u2) {
  const double sine = std::sqrt(u1);
  const double phi = 2 * kPi64 * u2;
  return {sine * std::cos(phi), sine * std::sin(phi), std::sqrt(1 - u1)};
}

// What the facet reflects. False: nothing.
bool ReflectAtFacet(const Surface& surface, const Facet& facet, Double3 up, double side,
                    Scattered& out) {
  const Double3 reflected = facet.m * (2 * facet.cos_m) - up;
  if (!(reflected.z > 0)) return false;
  const double weight = FacetWeight(surface, facet, up, reflected);
  out.wi = reflected * side;
  out.weight = {weight, weight, weight};
  out.is_delta = surface.is_coat_smooth;
  return true;
}

// Henyey & Greenstein 1941: where light that goes in `direction` is scattered.
Double3 ScatteredByPhase(Double3 direction, double g, double u1, double u2) {
  const double s = (1 - g * g) / (1 - g + 2 * g * u1);
  const double cosine = std::abs(g) < 1e-3 ? 2 * u1 - 1 : (1 + g * g - s * s) / (2 * g);
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  const double phi = 2 * kPi64 * u2;
  // Two axes across.
  const Double3 a = std::abs(direction.x) < 0.7 ? Double3{1, 0, 0} : Double3{0, 1, 0};
  const Double3 x = Unit(a - direction * Dot(a, direction));
  const Double3 y = {direction.y * x.z - direction.z * x.y, direction.z * x.x - direction.x * x.z,
                     direction.x * x.y - direction.y * x.x};
  return Unit(x * (sine * std::cos(phi)) + y * (sine * std::sin(phi)) + direction * cosine);
}

// The metal under a coat, which light meets on its way in `direction`, and the one that it goes on
// in. False: it is absorbed.
bool ReflectAtMetal(const Surface& surface, double u1, double u2, Double3& direction,
                    Color& weight) {
  Surface metal = surface;
  metal.alpha_u = surface.base_alpha_u;
  metal.alpha_v = surface.base_alpha_v;
  metal.is_coat_smooth = surface.is_base_smooth;
  const Double3 up = direction * -1;
  Facet facet;
  facet.m = metal.is_coat_smooth ? Double3{0, 0, 1} : DrawFacet(metal, u1, u2);
  facet.cos_m = Dot(up, facet.m);
  if (!(facet.cos_m > 0)) return false;
  direction = facet.m * (2 * facet.cos_m) - up;
  if (!(direction.z > 0)) return false;
  weight = Times(Times(weight, MetalColor(surface, facet.cos_m, surface.around_metal)),
                 FacetWeight(metal, facet, up, direction));
  return true;
}

// A walk through a coat: down through its surface, to the base and up again, as often as it takes.
bool ScatterInCoat(const Surface& surface, Double3 up, double side, const std::array<double, 3>& u,
                   Scattered& out) {
  const double eta = surface.ior;
  Facet facet;
  if (!MeetFacet(surface, up, eta, u[1], u[2], facet)) return false;
  if (u[0] < facet.share) return ReflectAtFacet(surface, facet, up, side, out);
  // More numbers than the caller has.
  KeyedRng rng(CombineKeys(static_cast<std::uint64_t>(u[0] * 0x1p52),
                           static_cast<std::uint64_t>(u[1] * 0x1p52)));
  const auto next = [&] { return static_cast<double>(rng.Bits() >> 11) * 0x1p-53; };
  const Double3 down = facet.m * (facet.cos_m / eta - facet.cos_t) - up * (1 / eta);
  if (!(down.z < 0)) return false;
  const double entering = FacetWeight(surface, facet, up, down);
  out.weight = {entering, entering, entering};
  out.is_delta = surface.is_smooth;
  // On the way from the surface or the base to one of them. True at the base.
  const auto cross_layer = [&](Double3& direction) {
    if (!(Largest(surface.coat_albedo) > 0)) {
      out.weight = Times(out.weight, std::exp(-surface.thickness / std::abs(direction.z)));
      return direction.z < 0;
    }
    double height = direction.z < 0 ? surface.thickness : 0;
    while (true) {
      height -= direction.z * std::log(1 - next());
      if (height <= 0) return true;
      if (height >= surface.thickness) return false;
      out.weight = Times(out.weight, surface.coat_albedo);
      const double u1 = next();
      const double u2 = next();
      direction = ScatteredByPhase(direction, surface.phase_g, u1, u2);
    }
  };
  Double3 direction = down;
  for (int hit = 0;;) {
    if (cross_layer(direction)) {
      if (hit++ == surface.base_hits) return false;
      const double u1 = next();
      const double u2 = next();
      if (surface.kind == Material::Kind::kCoatedConductor) {
        if (!ReflectAtMetal(surface, u1, u2, direction, out.weight)) return false;
      } else {
        out.weight = Times(out.weight, surface.reflectance);
        direction = CosineDirection(u1, u2);
      }
      continue;
    }
    const double u3 = next();
    const double u4 = next();
    if (!MeetFacet(surface, direction, 1 / eta, u3, u4, facet)) return false;
    // Seen from below: what is reflected goes down.
    if (next() < facet.share) {
      const Double3 reflected = facet.m * (2 * facet.cos_m) - direction;
      if (!(reflected.z > 0)) return false;
      out.weight = Times(out.weight, FacetWeight(surface, facet, direction, reflected));
      direction = reflected * -1;
      continue;
    }
    const Double3 leaving = facet.m * (facet.cos_m * eta - facet.cos_t) - direction * eta;
    if (!(leaving.z < 0)) return false;
    out.weight = Times(out.weight, FacetWeight(surface, facet, direction, leaving));
    out.wi = leaving * -side;
    return true;
  }
}

// The share of what falls in from `up` that a facet drawn for it lets through.
double DrawnEntering(const Surface& surface, Double3 up, double u1, double u2) {
  Facet facet;
  if (!MeetFacet(surface, up, surface.ior, u1, u2, facet)) return 0;
  const Double3 down = facet.m * (facet.cos_m / surface.ior - facet.cos_t) - up * (1 / surface.ior);
  if (!(facet.share < 1) || !(down.z < 0)) return 0;
  return (1 - facet.share) * FacetWeight(surface, facet, up, down);
}

// The mean of that over directions with density cosine / pi.
double MeanEntering(const Surface& surface) {
  constexpr int kSteps = 40;
  const auto middle = [](int i) { return (i + 0.5) / kSteps; };
  double sum = 0;
  for (int i = 0; i < kSteps * kSteps; ++i) {
    const double cosine = std::sqrt((i + 0.5) / (kSteps * kSteps));
    const Double3 up = {std::sqrt(1 - cosine * cosine), 0, cosine};
    if (surface.is_coat_smooth) {
      sum += DrawnEntering(surface, up, 0, 0) * kSteps * kSteps;
      continue;
    }
    for (int j = 0; j < kSteps * kSteps; ++j)
      sum += DrawnEntering(surface, up, middle(j / kSteps), middle(j % kSteps));
  }
  return sum / (static_cast<double>(kSteps) * kSteps * kSteps * kSteps);
}

// One of some directions, evenly to all sides, by what the fibre scatters there (resampled
// importance sampling, Talbot et al. 2005): of one such direction alone the weight would be 4 pi
// times a lobe, which few paths meet.
bool ScatterInHair(const ReferenceFibre& fibre, Double3 wo, const std::array<double, 3>& u,
                   Scattered& out) {
  constexpr int kDirections = 64;
  constexpr double kGolden = 0.6180339887498949;
  std::array<Double3, kDirections> directions;
  std::array<Color, kDirections> shares;
  std::array<double, kDirections> sums{};
  double sum = 0;
  for (std::size_t i = 0; i < kDirections; ++i) {
    const auto number = static_cast<double>(i);
    const double cosine = 1 - 2 * std::fmod(u[1] + number / kDirections, 1.0);
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    const double phi = 2 * kPi64 * (u[2] + number * kGolden);
    directions[i] = {sine * std::cos(phi), sine * std::sin(phi), cosine};
    shares[i] = ReferenceHairShare(fibre, wo, directions[i]);
    sum += shares[i][0] + shares[i][1] + shares[i][2];
    sums[i] = sum;
  }
  if (!(sum > 0)) return false;
  const auto drawn = static_cast<std::size_t>(std::min<std::ptrdiff_t>(
      std::ranges::upper_bound(sums, u[0] * sum) - sums.begin(), kDirections - 1));
  const double weight = sums[drawn] - (drawn > 0 ? sums[drawn - 1] : 0);
  out.wi = directions[drawn];
  out.weight = Times(shares[drawn], 4 * kPi64 * sum / (kDirections * weight));
  return true;
}

// In the shading frame. False: absorbed.
bool Scatter(const Surface& surface, Double3 wo, const std::array<double, 3>& u, Scattered& out) {
  if (wo.z == 0) return false;
  const double side = wo.z < 0 ? -1 : 1;
  const Double3 up = wo * side;
  out.is_delta = surface.is_smooth;
  out.index = 1;
  if (surface.kind == Material::Kind::kDiffuse) {
    const double sine = std::sqrt(u[1]);
    const double phi = 2 * kPi64 * u[2];
    out.wi = Double3{sine * std::cos(phi), sine * std::sin(phi), std::sqrt(1 - u[1])} * side;
    out.weight = surface.reflectance;
    return true;
  }
  if (surface.kind == Material::Kind::kHair) return ScatterInHair(surface.fibre, wo, u, out);
  if (surface.kind == Material::Kind::kCoatedDiffuse)
    return ScatterInCoat(surface, up, side, u, out);
  if (surface.kind == Material::Kind::kCoatedConductor) {
    if (!ScatterInCoat(surface, up, side, u, out)) return false;
    // Of products of what indices reflect, as for a bare metal.
    out.weight = Working(out.weight);
    return true;
  }
  if (surface.kind == Material::Kind::kThinDielectric) {
    // Reflected at either face, any number of times.
    double cos_t = 0;
    const double once = DielectricReflectance(std::min(1.0, up.z), surface.ior, cos_t);
    const double reflected = once + (1 - once) * (1 - once) * once / (1 - once * once);
    out.wi = u[0] < reflected ? Double3{-wo.x, -wo.y, wo.z} : wo * -1;
    out.weight = u[0] < reflected ? surface.reflection_tint : surface.transmission_tint;
    return true;
  }
  if (surface.kind == Material::Kind::kDiffuseTransmission) {
    const bool reflects = u[0] < 0.5;
    out.wi = CosineDirection(u[1], u[2]) * (reflects ? side : -side);
    out.weight = Times(reflects ? surface.reflectance : surface.transmittance, 2);
    return true;
  }
  const Double3 m = surface.is_smooth ? Double3{0, 0, 1} : DrawFacet(surface, u[1], u[2]);
  const double cos_m = Dot(up, m);
  if (!(cos_m > 0)) return false;
  const Double3 reflected = m * (2 * cos_m) - up;
  // Walter et al. eq. (41).
  const auto weight_of = [&](Double3 wi) {
    if (surface.is_smooth) return 1.0;
    const double g2 = 1 / (1 + SmithLambda(surface, up) + SmithLambda(surface, wi));
    return cos_m * g2 / (up.z * m.z);
  };
  if (surface.kind == Material::Kind::kConductor) {
    if (!(reflected.z > 0)) return false;
    out.wi = reflected * side;
    out.weight = Times(Times(Working(MetalColor(surface, cos_m)), surface.reflection_tint),
                       weight_of(reflected));
    return true;
  }
  const double eta = wo.z > 0 ? surface.ior : 1 / surface.ior;
  double cos_t = 0;
  if (u[0] < DielectricReflectance(std::min(1.0, cos_m), eta, cos_t)) {
    if (!(reflected.z > 0)) return false;
    out.wi = reflected * side;
    out.weight = Times(surface.reflection_tint, weight_of(reflected));
    return true;
  }
  const Double3 refracted = m * (cos_m / eta - cos_t) - up * (1 / eta);
  if (!(refracted.z < 0)) return false;
  out.wi = refracted * side;
  out.index = eta;
  out.weight = Times(surface.transmission_tint, weight_of(refracted) / (eta * eta));
  return true;
}

// --- numbers -----------------------------------------------------------------------------------

// The numbers of one path: the first ones from a Kronecker lattice with a random shift, which
// spreads the paths of a replica evenly, the others independent.
constexpr std::size_t kEvenDimensions = 11;

class PathNumbers {
 public:
  PathNumbers(std::uint64_t key, const std::array<double, kEvenDimensions>& shifts, int path)
      : shifts_(shifts), path_(path), rng_(CombineKeys(key, static_cast<std::uint64_t>(path))) {}

  double Next() {
    static const std::array<double, kEvenDimensions> kSteps = [] {
      constexpr std::array<int, kEvenDimensions> kPrimes = {2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31};
      std::array<double, kEvenDimensions> steps{};
      for (std::size_t d = 0; d < kEvenDimensions; ++d)
        steps[d] = std::sqrt(static_cast<double>(kPrimes[d]));
      return steps;
    }();
    if (dimension_ >= kEvenDimensions) {
      return static_cast<double>(rng_.Bits() >> 11) * 0x1p-53;
    }
    const double x = shifts_[dimension_] + path_ * kSteps[dimension_];
    ++dimension_;
    return x - std::floor(x);
  }

 private:
  const std::array<double, kEvenDimensions>& shifts_;
  int path_;
  KeyedRng rng_;
  std::size_t dimension_ = 0;
};

}  // namespace

// --- paths -------------------------------------------------------------------------------------

class PathTracer {
 public:
  PathTracer(const Scene& scene, const PathTracerSettings& settings)
      : scene_(scene), settings_(settings) {
    if (scene.camera.lens_radius > 0) {
      std::fprintf(stderr, "the path tracer knows no lens\n");
      std::abort();
    }
    first_stand_in_ = static_cast<std::uint32_t>(scene.spheres.size());
    scene_.materials.emplace_back();
    const auto material = static_cast<std::int32_t>(scene_.materials.size()) - 1;
    const double area = kPi64 * static_cast<double>(settings.delta_radius) *
                        static_cast<double>(settings.delta_radius);
    const auto stand_in = [&](const auto& light, const std::function<Color(Vec3)>& factor) {
      scene_.spheres.push_back(
          {light.position, settings.delta_radius, false, {material, kNoAreaLight}, {}});
      stand_ins_.push_back({Times(Working(FromFloat(light.intensity)), 1 / area), factor});
    };
    for (const PointLight& light : scene.point_lights)
      stand_in(light, [](Vec3 /*leaving*/) { return Color{1, 1, 1}; });
    for (const SpotLight& light : scene.spot_lights)
      stand_in(light, [&light](Vec3 leaving) { return Falloff(light, leaving); });
    for (const GoniometricLight& light : scene.goniometric_lights)
      stand_in(light, [&light](Vec3 leaving) { return OnMap(light, leaving); });
    for (const ProjectionLight& light : scene.projection_lights)
      stand_in(light, [&light](Vec3 leaving) { return OnSlide(light, leaving); });
    const double sine = std::sin(static_cast<double>(settings.delta_angle_rad));
    cos_cone_ = std::sqrt(1 - sine * sine);
    for (const DistantLight& light : scene.distant_lights) {
      suns_.push_back({Unit(Double3(-light.direction)),
                       Times(Working(FromFloat(light.irradiance)), 1 / (kPi64 * sine * sine))});
    }
    StatusOr<std::unique_ptr<Intersector>> intersector = Intersector::Create(scene_);
    if (!intersector.ok()) {
      std::fprintf(stderr, "%s\n", std::string(intersector.status().message()).c_str());
      std::abort();
    }
    intersector_ = std::move(intersector).value();
    for (std::size_t i = 0; i < scene_.materials.size(); ++i) {
      if (scene_.materials[i].kind != Material::Kind::kSubsurface) continue;
      SurfacePoint point;
      point.material = static_cast<std::uint32_t>(i);
      mean_entering_[point.material] = MeanEntering(SurfaceOf(scene_, point));
    }
  }

  [[nodiscard]] TracedImage Trace() const {
    TracedImage image(settings_.width, settings_.height, settings_.replicas);
    const auto channels =
        static_cast<std::size_t>(settings_.width) * static_cast<std::size_t>(settings_.height) * 3;
    ThreadTeam team(settings_.threads);
    team.For(static_cast<std::size_t>(settings_.replicas), 1,
             [&](std::size_t begin, std::size_t end) {
               for (std::size_t replica = begin; replica < end; ++replica)
                 TraceReplica(replica, &image.radiance_[replica * channels]);
             });
    return image;
  }

 private:
  struct StandIn {
    Color radiance;
    std::function<Color(Vec3)> factor;  // in the direction that light leaves in, unit
  };
  struct Sun {
    Double3 towards;
    Color radiance;
  };

  void TraceReplica(std::size_t replica, double* radiance) const {
    const std::uint64_t key = CombineKeys(settings_.key, replica);
    std::array<double, kEvenDimensions> shifts{};
    KeyedRng rng(key);
    for (double& shift : shifts)
      shift = static_cast<double>(rng.Bits() >> 11) * 0x1p-53;
    const double share =
        static_cast<double>(settings_.width) * settings_.height / settings_.paths_per_replica;
    const double half = std::tan(scene_.camera.fov_deg * kPi64 / 360);
    const double shorter = std::min(settings_.width, settings_.height);
    for (int path = 0; path < settings_.paths_per_replica; ++path) {
      PathNumbers numbers(key, shifts, path);
      const double x = numbers.Next() * settings_.width;
      const double y = numbers.Next() * settings_.height;
      const Vec3 direction = {static_cast<float>((2 * x - settings_.width) / shorter * half),
                              static_cast<float>((settings_.height - 2 * y) / shorter * half), 1};
      const Transform& to_world = scene_.camera.camera_to_world;
      const Ray ray = {to_world.Point({0, 0, 0}), Normalize(to_world.Vector(direction)), HUGE_VALF};
      const std::array<double, 3> seen = ToRec709(Radiance(ray, numbers));
      const auto pixel =
          static_cast<std::size_t>(static_cast<int>(y) * settings_.width + static_cast<int>(x));
      for (std::size_t c = 0; c < 3; ++c)
        radiance[3 * pixel + c] += seen[c] * share;
    }
  }

  enum class Met : std::uint8_t { kNothing, kSurface, kMedium };

  // What the ray meets behind stand-ins and interfaces: a surface, or a medium that scatters it, at
  // `point`. `weight` becomes that of what is there; stand-ins that the ray passes add to `seen`.
  Met Meet(Ray ray, bool sees_stand_ins, PathNumbers& numbers, std::int32_t& medium, Color& weight,
           Color& seen, SurfacePoint& point) const {
    while (true) {
      Hit hit;
      const bool is_met = intersector_->Intersect(ray, hit);
      if (medium != kNoMedium) {
        double length = is_met ? static_cast<double>(hit.t) : HUGE_VAL;
        const Medium& through = scene_.media[static_cast<std::size_t>(medium)];
        // From so far away next to nothing comes back to the scene.
        const double farthest = 8 * static_cast<double>(intersector_->bounds().Diagonal());
        if (through.density != nullptr
                ? IsScatteredUnevenly(through, ray, farthest, numbers, length, weight)
                : IsScattered(through, numbers, length, weight)) {
          point.position = ray.origin + ray.direction * static_cast<float>(length);
          return Met::kMedium;
        }
      }
      if (!is_met) return Met::kNothing;
      point = intersector_->SurfaceAt(ray, hit);
      if (hit.geometry == GeometryOf(scene_, ShapeKind::kSphere) &&
          hit.primitive >= first_stand_in_) {
        const Vec3 wo = -ray.direction;
        if (sees_stand_ins && Dot(point.geometric_normal, wo) > 0) {
          const StandIn& light = stand_ins_[hit.primitive - first_stand_in_];
          AddTo(seen, Times(weight, Times(light.radiance, light.factor(wo))));
        }
      } else if (scene_.materials[point.material].kind == Material::Kind::kInterface) {
        medium = Beyond(point, ray.direction, medium);
      } else {
        return Met::kSurface;
      }
      ray.origin = LeavingPoint(point, ray.direction);
    }
  }

  // Coefficients mix as those of a thin layer do.
  static Color ExtinctionOf(const Medium& medium) {
    Color extinction = Working(FromFloat(medium.absorption));
    AddTo(extinction, Working(FromFloat(medium.scattering)));
    return extinction;
  }

  // Whether a medium scatters light within `length`, which becomes the place; a distance is drawn
  // by the extinction of one channel, and weighed by the mean density of all.
  static bool IsScattered(const Medium& medium, PathNumbers& numbers, double& length,
                          Color& weight) {
    const Color extinction = ExtinctionOf(medium);
    const auto channel = static_cast<std::size_t>(3 * numbers.Next());
    const double drawn = -std::log(1 - numbers.Next()) / extinction[channel];
    const bool is_scattered = drawn < length;
    if (is_scattered) length = drawn;
    Color kept{};
    double density = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      kept[c] = extinction[c] > 0 ? std::exp(-extinction[c] * length) : 1;
      density += kept[c] * (is_scattered ? extinction[c] : 1) / 3;
    }
    if (is_scattered) kept = Times(kept, Working(FromFloat(medium.scattering)));
    weight = density > 0 ? Times(weight, Times(kept, 1 / density)) : Color{};
    return is_scattered;
  }

  // The same by collisions at the greatest density, of which the share of the density that is there
  // is real (null collisions: Woodcock et al. 1965). Nothing of how the renderer integrates a
  // density is used.
  static bool IsScatteredUnevenly(const Medium& medium, const Ray& ray, double farthest,
                                  PathNumbers& numbers, double& length, Color& weight) {
    const Color extinction = ExtinctionOf(medium);
    const Color scattering = Working(FromFloat(medium.scattering));
    const double most = Largest(extinction) * static_cast<double>(medium.density->largest());
    if (!(most > 0)) return false;
    const double mean = (extinction[0] + extinction[1] + extinction[2]) / 3;
    const double end = std::min(length, farthest);
    double t = 0;
    while (true) {
      t -= std::log(1 - numbers.Next()) / most;
      if (!(t < end)) return false;
      const double density = medium.density->At(ray.origin + ray.direction * static_cast<float>(t));
      const double share = mean * density / most;
      const bool is_real = numbers.Next() < share;
      for (std::size_t c = 0; c < 3; ++c) {
        weight[c] *=
            is_real ? scattering[c] / mean : (1 - extinction[c] * density / most) / (1 - share);
      }
      if (is_real) {
        length = t;
        return true;
      }
    }
  }

  // The medium of a path through a surface.
  std::int32_t Beyond(const SurfacePoint& surface, Vec3 direction, std::int32_t before) const {
    const ShapeTraits& traits = TraitsOf(scene_, surface);
    if (traits.medium_inside == traits.medium_outside) return before;
    return Dot(direction, surface.geometric_normal) > 0 ? traits.medium_outside
                                                        : traits.medium_inside;
  }

  // pbrt's spot: a cubic step of the cosine.
  static Color Falloff(const SpotLight& spot, Vec3 leaving) {
    const double cosine = Dot(Unit(Double3(leaving)), Unit(Double3(spot.direction)));
    const auto outer = static_cast<double>(spot.cos_total_width);
    const auto inner = static_cast<double>(spot.cos_falloff_start);
    const double t = std::clamp((cosine - outer) / (inner - outer), 0.0, 1.0);
    const double step = cosine >= inner ? 1 : 3 * t * t - 2 * t * t * t;
    return {step, step, step};
  }

  static Vec3 InAxes(const ShapeAxes& axes, Vec3 direction) {
    return {Dot(direction, axes.x), Dot(direction, axes.y), Dot(direction, axes.z)};
  }

  // Of a pixel of a picture over [0, 1]².
  static Color PixelAt(const Picture& picture, double x, double y) {
    const auto texel = [](double place, int size) {
      return std::clamp(static_cast<int>(place * size), 0, size - 1);
    };
    return FromFloat(picture.At(texel(x, picture.width), texel(y, picture.height)));
  }

  static Color OnMap(const GoniometricLight& light, Vec3 leaving) {
    const Vec2 place = EqualAreaPlace(Normalize(InAxes(light.axes, leaving)));
    const Color pixel =
        PixelAt(*light.map, static_cast<double>(place.x), static_cast<double>(place.y));
    const double gray = (pixel[0] + pixel[1] + pixel[2]) / 3;
    return {gray, gray, gray};
  }

  // The slide at distance 1 before the light.
  static Color OnSlide(const ProjectionLight& light, Vec3 leaving) {
    const Double3 in_axes(InAxes(light.axes, leaving));
    if (!(in_axes.z > 0)) return {};
    const double x = (1 + in_axes.x / in_axes.z / static_cast<double>(light.half_width)) / 2;
    const double y = (1 - in_axes.y / in_axes.z / static_cast<double>(light.half_height)) / 2;
    if (!(x >= 0 && x < 1 && y >= 0 && y < 1)) return {};
    return Working(PixelAt(*light.map, x, y));
  }

  // Whether the ray goes through the rectangle, from the side that sees light.
  static bool Passes(const Portal& portal, Vec3 from, Vec3 direction) {
    const Double3 x(portal.along_x);
    const Double3 y(portal.along_y);
    const Double3 normal = Cross(x, y);
    const Double3 to = Double3(from) - Double3(portal.corner);
    const double approach = Dot(Double3(direction), normal);
    if (approach <= 0 || Dot(to, normal) >= 0) return false;
    const Double3 at = to + Double3(direction) * (-Dot(to, normal) / approach);
    const double s = Dot(at, x) / Dot(x, x);
    const double t = Dot(at, y) / Dot(y, y);
    return s >= 0 && s <= 1 && t >= 0 && t <= 1;
  }

  Color FromInfinity(Vec3 from, Vec3 direction, bool sees_stand_ins) const {
    Color seen{};
    for (const InfiniteLight& light : scene_.infinite_lights) {
      if (light.portal && !Passes(*light.portal, from, direction)) continue;
      const Color scale = Working(FromFloat(light.radiance));
      if (light.map == nullptr) {
        AddTo(seen, scale);
        continue;
      }
      const Vec2 place = EqualAreaPlace(Normalize(InAxes(light.axes, direction)));
      const Color pixel =
          PixelAt(*light.map, static_cast<double>(place.x), static_cast<double>(place.y));
      AddTo(seen, Times(scale, Working(pixel)));
    }
    if (sees_stand_ins) {
      const Double3 towards = Unit(Double3(direction));
      for (const Sun& sun : suns_) {
        if (Dot(towards, sun.towards) > cos_cone_) AddTo(seen, sun.radiance);
      }
    }
    return seen;
  }

  // Of a row or column of `count` that go on as `wrap` says; -1 where there is none.
  static int Wrapped(double place, int count, Texture::Wrap wrap) {
    const double period = wrap == Texture::Wrap::kMirror ? 2.0 * count : count;
    const bool is_inside = place >= 0 && place < count;
    if (wrap == Texture::Wrap::kBlack && !is_inside) return -1;
    if (wrap == Texture::Wrap::kClamp || is_inside)
      return static_cast<int>(std::clamp(place, 0.0, count - 1.0));
    const double within = place - std::floor(place / period) * period;
    return static_cast<int>(within < count ? within : period - 1 - within);
  }

  // With a picture: between the centres of its pixels, the first row at v = 1.
  Color Emitted(const AreaLight& light, const SurfacePoint& point) const {
    const Color scale = Working(FromFloat(light.radiance));
    if (light.picture == nullptr) return scale;
    const Picture& picture = *light.picture;
    const Vec2 uv = light.mapping.Map({UvAt(scene_, point), {}, {}});
    const double x = static_cast<double>(uv.x) * picture.width - 0.5;
    const double y = (1 - static_cast<double>(uv.y)) * picture.height - 0.5;
    Color sum{};
    for (int i = 0; i < 4; ++i) {
      const double column = std::floor(x) + i % 2;
      const double row = std::floor(y) + i / 2;
      const double share = (1 - std::abs(x - column)) * (1 - std::abs(y - row));
      // Rows grow downwards and v upwards, which is the same for each kind of wrapping.
      const int at_u = Wrapped(column, picture.width, light.wrap_u);
      const int at_v = Wrapped(row, picture.height, light.wrap_v);
      if (at_u < 0 || at_v < 0) continue;
      AddTo(sum, Times(FromFloat(picture.At(at_u, at_v)), share));
    }
    return Times(scale, Working(sum));
  }

  // Draws the material of a mix, and turns the normal where that has bumps.
  void Prepare(SurfacePoint& point, PathNumbers& numbers) const {
    const Material* material = &scene_.materials[point.material];
    const TexturePlace place = {UvAt(scene_, point), point.position, point.geometric_normal};
    while (material->kind == Material::Kind::kMix) {
      const float amount = material->amount_texture == kNoTexture
                               ? material->amount
                               : TextureNumber(scene_.textures, material->amount_texture, place);
      const bool is_second = numbers.Next() < static_cast<double>(amount);
      point.material = static_cast<std::uint32_t>(material->mixed[is_second ? 1 : 0]);
      material = &scene_.materials[point.material];
    }
    if (material->HasBumps()) {
      TurnShadingNormal(scene_, *material, place, point);
    } else if (material->IsAnisotropic()) {
      FindTangent(scene_, point);
    }
  }

  // Below a plane surface of one material: light leaves at a point that is drawn on the plane by an
  // exponential of the distance, if there is a surface, to which `point` moves. In the shading
  // frame. False: absorbed.
  bool ScatterBelow(const Surface& surface, Double3 wo, const std::array<double, 3>& u,
                    PathNumbers& numbers, const Frame& frame, SurfacePoint& point,
                    Scattered& out) const {
    if (wo.z == 0) return false;
    const double side = wo.z < 0 ? -1 : 1;
    const Double3 up = wo * side;
    Facet facet;
    if (!MeetFacet(surface, up, surface.ior, u[1], u[2], facet)) return false;
    if (u[0] < facet.share) return ReflectAtFacet(surface, facet, up, side, out);
    const double entering =
        DrawnEntering(surface, up, u[1], u[2]) / std::max(1 - facet.share, 1e-12);
    constexpr double kFreePaths = 3;
    const double mean_distance = kFreePaths / surface.extinction[1];
    const double distance = -mean_distance * std::log(1 - numbers.Next());
    const double turn = 2 * kPi64 * numbers.Next();
    const Vec3 moved = point.position + frame.s * static_cast<float>(distance * std::cos(turn)) +
                       frame.t * static_cast<float>(distance * std::sin(turn));
    constexpr float kAbove = 1e-3F;
    Hit hit;
    const Ray probe = {moved + frame.n * kAbove, -frame.n, 2 * kAbove};
    if (!intersector_->Intersect(probe, hit)) return false;
    const SurfacePoint there = intersector_->SurfaceAt(probe, hit);
    if (there.material != point.material) return false;
    point = there;
    const double density = std::exp(-distance / mean_distance) / mean_distance;
    const double u1 = numbers.Next();
    const double u2 = numbers.Next();
    out.wi = CosineDirection(u1, u2);
    const double u3 = numbers.Next();
    const double u4 = numbers.Next();
    const double leaving =
        DrawnEntering(surface, out.wi, u3, u4) / mean_entering_.at(point.material);
    out.wi = out.wi * side;
    out.is_delta = false;
    for (std::size_t c = 0; c < 3; ++c) {
      const double optical = distance * surface.extinction[c];
      const SubsurfaceTable::Mix mix =
          surface.below->MixOf(static_cast<float>(surface.reflectance[c]));
      const double per_distance =
          static_cast<double>(surface.below->Density(mix, static_cast<float>(optical))) *
          surface.extinction[c];
      out.weight[c] = entering * leaving * per_distance / density;
    }
    return true;
  }

  // In world space. Below a surface `point` moves. False: absorbed.
  bool ScatterAtSurface(Vec3 wo, PathNumbers& numbers, SurfacePoint& point,
                        Scattered& scattered) const {
    const Surface surface = SurfaceOf(scene_, point);
    const Frame frame = ShadingFrame(point);
    const std::array<double, 3> u = {numbers.Next(), numbers.Next(), numbers.Next()};
    const Double3 wo_local = Unit(Double3(frame.ToLocal(wo)));
    const bool is_scattered =
        surface.kind == Material::Kind::kSubsurface
            ? ScatterBelow(surface, wo_local, u, numbers, frame, point, scattered)
            : Scatter(surface, wo_local, u, scattered);
    if (!is_scattered) return false;
    const Vec3 wi = frame.ToWorld(ToFloat(scattered.wi));
    // What the shading normal calls reflection must be one for the geometry too.
    const bool transmits = scattered.wi.z * wo_local.z < 0;
    const bool crosses = Dot(wo, point.geometric_normal) * Dot(wi, point.geometric_normal) < 0;
    scattered.wi = Double3(wi);
    return transmits == crosses;
  }

  Color Radiance(Ray ray, PathNumbers& numbers) const {
    Color seen{};
    Color weight = {1, 1, 1};
    // Radiance is compressed in glass: undone for the roulette, which else would end half of the
    // paths that enter.
    double compression = 1;
    bool only_smooth = true;
    bool gathered = false;
    int events_left = settings_.max_depth;
    std::int32_t medium = scene_.camera.medium;
    for (int vertex = 0;; ++vertex) {
      SurfacePoint point;
      const Met met = Meet(ray, !only_smooth, numbers, medium, weight, seen, point);
      if (met == Met::kNothing) {
        AddTo(seen, Times(weight, FromInfinity(ray.origin, ray.direction, !only_smooth)));
        return seen;
      }
      const Vec3 wo = -ray.direction;
      if (met == Met::kSurface && point.area_light != kNoAreaLight) {
        const AreaLight& light = scene_.area_lights[static_cast<std::size_t>(point.area_light)];
        if (light.two_sided || Dot(point.geometric_normal, wo) > 0) {
          AddTo(seen, Times(weight, Emitted(light, point)));
        }
      }
      if (events_left == 0) return seen;
      bool gathers = true;
      if (met == Met::kSurface) {
        Prepare(point, numbers);
        gathers = SurfaceOf(scene_, point).gathers;
      }
      // The event where photons are first gathered belongs to both ends of a path.
      if (gathers && !gathered) {
        gathered = true;
        events_left = settings_.max_depth;
      }
      --events_left;

      Scattered scattered;
      if (met == Met::kMedium) {
        const auto g = static_cast<double>(scene_.media[static_cast<std::size_t>(medium)].g);
        const double u1 = numbers.Next();
        const double u2 = numbers.Next();
        scattered.wi = ScatteredByPhase(Unit(Double3(ray.direction)), g, u1, u2);
        scattered.weight = {1, 1, 1};
        ray.origin = point.position;
      } else {
        if (!ScatterAtSurface(wo, numbers, point, scattered)) return seen;
        const Vec3 wi = ToFloat(scattered.wi);
        const bool crosses = Dot(wo, point.geometric_normal) * Dot(wi, point.geometric_normal) < 0;
        if (crosses) medium = Beyond(point, wi, medium);
        ray.origin = LeavingPoint(point, wi);
      }
      ray.direction = Normalize(ToFloat(scattered.wi));
      weight = Times(weight, scattered.weight);
      compression *= scattered.index * scattered.index;
      only_smooth = only_smooth && scattered.is_delta;
      const double survival = Largest(weight) * compression;
      if (!(survival > 0)) return seen;
      if (vertex > 3 && survival < 1) {
        if (!(numbers.Next() < survival)) return seen;
        weight = Times(weight, 1 / survival);
      }
    }
  }

  Scene scene_;  // with stand-ins as the last spheres
  PathTracerSettings settings_;
  std::unique_ptr<Intersector> intersector_;
  std::uint32_t first_stand_in_ = 0;
  std::vector<StandIn> stand_ins_;
  std::vector<Sun> suns_;
  double cos_cone_ = 1;
  std::map<std::uint32_t, double> mean_entering_;  // by material
};

TracedImage::TracedImage(int width, int height, int replicas)
    : width_(width),
      height_(height),
      replicas_(replicas),
      radiance_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                static_cast<std::size_t>(replicas) * 3) {}

MeasuredMean TracedImage::MeanOver(const PixelBlock& block, int channel) const {
  std::vector<double> means;
  for (int replica = 0; replica < replicas_; ++replica) {
    double sum = 0;
    for (int y = block.y0; y < block.y1; ++y) {
      for (int x = block.x0; x < block.x1; ++x) {
        sum += radiance_[static_cast<std::size_t>(((replica * height_ + y) * width_ + x) * 3 +
                                                  channel)];
      }
    }
    means.push_back(sum / ((block.x1 - block.x0) * (block.y1 - block.y0)));
  }
  return MeanOf(means);
}

TracedImage TracePaths(const Scene& scene, const PathTracerSettings& settings) {
  return PathTracer(scene, settings).Trace();
}

}  // namespace lucerna
