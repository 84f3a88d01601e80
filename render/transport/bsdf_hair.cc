// Scattering by a fibre of hair.
//
// A fibre is a cylinder of dielectric: of the light that meets it, part is reflected (p = 0), part
// passes through (p = 1), part leaves after p - 1 reflections within. Each part is the product of
// M, over the angle with the plane across the fibre, N, over the angle around it, and A, how much
// of the light takes this way.
//
// Sources: Marschner et al. 2003, "Light Scattering from Human Hair Fibers"; d'Eon et al. 2011, "An
// Energy-Conserving Hair Reflectance Model" (M); d'Eon et al. 2013, "Importance Sampling for
// Physically-Based Hair Fiber Models"; Chiang et al. 2016, "A Practical and Controllable Hair and
// Fur Model for Production Path Tracing" (roughness, N, the last part).
//
// The frame: x along the fibre, z along the normal of the tube. theta is a direction's angle with
// the plane of y and z, phi its angle around x, from z towards y. Where light meets the tube across
// its width follows from the direction that it comes from: h = sin(gamma_o), gamma_o = phi_o.
//
// Light leaves the tube where it came in, and a ray that begins within the tube leaves it unseen;
// so eye paths and photons scatter at different places of it, and agree on averages over its width
// alone. The model's functions of phi are then even, but those of theta have no symmetry: M counts
// directions by solid angle while the width of the tube shrinks with cos(theta), A is that of
// theta_o, and the scales are tilted. The adjoint for photons is written out below.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "render/transport/bsdf_kinds.h"

namespace lucerna {
namespace {

// p = 0, 1 and 2 have lobes of their own; all others leave together, evenly around the fibre.
constexpr std::size_t kLobes = 4;

constexpr float kTwoPi = 2 * std::numbers::pi_v<float>;

// exp(-x)·I0(x), x >= 0: Abramowitz & Stegun, 9.8.1 and 9.8.2, to 2e-7.
double ScaledBesselI0(double x) {
  if (x < 3.75) {
    const double t = x * x / (3.75 * 3.75);
    return std::exp(-x) *
           (1 + t * (3.5156229 +
                     t * (3.0899424 +
                          t * (1.2067492 + t * (0.2659732 + t * (0.0360768 + t * 0.0045813))))));
  }
  const double t = 3.75 / x;
  return (0.39894228 +
          t * (0.01328592 +
               t * (0.00225319 +
                    t * (-0.00157565 +
                         t * (0.00916281 +
                              t * (-0.02057706 +
                                   t * (0.02635537 + t * (-0.01647633 + t * 0.00392377)))))))) /
         std::sqrt(x);
}

// A direction's angle with the plane across the fibre.
struct Inclination {
  float sine, cosine;  // cosine >= 0

  // Turned by the angle of this sine and cosine. Over the pole it comes down on the other side.
  [[nodiscard]] Inclination Turned(float by_sine, float by_cosine) const {
    return {sine * by_cosine + cosine * by_sine, std::abs(cosine * by_cosine - sine * by_sine)};
  }
};

Inclination InclinationOf(Vec3 direction) {
  return {std::clamp(direction.x, -1.0F, 1.0F), std::hypot(direction.y, direction.z)};
}

// d'Eon et al. 2011, eq. (7), a density of solid angle without the share of phi: its integral
// times cos(theta_i) over theta_i is 1. Written with one exponent that is never above 0, so that
// small variances neither overflow nor need a case of their own.
float LongitudinalDensity(const Inclination& out, const Inclination& in, float variance) {
  const auto v = static_cast<double>(variance);
  const double a = static_cast<double>(out.cosine) * static_cast<double>(in.cosine);
  // cos(theta_o + theta_i) - 1, from the difference of unit vectors: small angles keep their
  // digits.
  const double sines = static_cast<double>(out.sine) + static_cast<double>(in.sine);
  const double cosines = static_cast<double>(out.cosine) - static_cast<double>(in.cosine);
  const double below_peak = -0.5 * (sines * sines + cosines * cosines);
  return static_cast<float>(std::exp(below_peak / v) * ScaledBesselI0(a / v) /
                            (v * -std::expm1(-2 / v)));
}

// Of a fibre, what does not depend on directions (Chiang et al. 2016, section 4).
struct FibreLobes {
  std::array<float, kLobes> variance;  // of M
  float scale;                         // of the logistic distribution in N
  float sine, cosine;                  // of the tilt

  explicit FibreLobes(const Material& material)
      : variance(), scale(0), sine(std::sin(material.scale_tilt)), cosine(0) {
    const float m = material.beta_m;
    const float root = 0.726F * m + 0.812F * m * m + 3.7F * std::pow(m, 20.0F);
    variance[0] = root * root;
    variance[1] = 0.25F * variance[0];
    variance[2] = 4 * variance[0];
    variance[3] = variance[2];
    const float n = material.beta_n;
    // The root of pi/8.
    scale = 0.626657069F * (0.265F * n + 1.194F * n * n + 5.372F * std::pow(n, 22.0F));
    cosine = std::sqrt(1 - sine * sine);
  }

  // Around which direction M scatters, instead of `out`: the scales turn the three first parts by
  // -2, 1 and 4 times their tilt.
  [[nodiscard]] Inclination Tilted(const Inclination& out, std::size_t p) const {
    const float sine2 = 2 * sine * cosine;
    const float cosine2 = cosine * cosine - sine * sine;
    switch (p) {
      case 0:
        return out.Turned(-sine2, cosine2);
      case 1:
        return out.Turned(sine, cosine);
      case 2:
        return out.Turned(2 * sine2 * cosine2, cosine2 * cosine2 - sine2 * sine2);
      default:
        return out;
    }
  }
};

// Where a ray meets the tube across its width: the angle gamma_o, whose sine is h.
struct Offset {
  float sine = 0, cosine = 1;

  // `out`: of the same direction.
  Offset(Vec3 wo, const Inclination& out) {
    if (!(out.cosine > 0)) return;
    sine = std::clamp(wo.y / out.cosine, -1.0F, 1.0F);
    cosine = std::min(std::abs(wo.z) / out.cosine, 1.0F);
  }
};

// Of light that leaves at `theta_o` and meets the fibre at h.
struct Crossing {
  std::array<Rgb, kLobes> shares;       // A
  std::array<float, kLobes - 1> turns;  // phi_i - phi_o of a smooth fibre [rad]

  // Chiang et al. 2016, section 3.
  Crossing(const Material& material, const Inclination& out, const Offset& offset)
      : shares(), turns() {
    float unused = 0;
    const float reflected =
        FresnelDielectric(std::max(1e-6F, out.cosine * offset.cosine), material.ior, unused);
    // The index that a section across the fibre shows.
    const float across =
        std::sqrt(std::max(1e-6F, material.ior * material.ior - out.sine * out.sine));
    const float sin_gamma_t = std::clamp(offset.sine * out.cosine / across, -1.0F, 1.0F);
    const float cos_gamma_t = std::sqrt(1 - sin_gamma_t * sin_gamma_t);
    const float sin_theta_t = std::clamp(out.sine / material.ior, -1.0F, 1.0F);
    const float cos_theta_t = std::sqrt(std::max(1e-6F, 1 - sin_theta_t * sin_theta_t));
    const float length = 2 * cos_gamma_t / cos_theta_t;  // of one crossing, in radii
    const auto passed_by = [&](float absorption) { return std::exp(-absorption * length); };
    const Rgb passed = {passed_by(material.absorption.r), passed_by(material.absorption.g),
                        passed_by(material.absorption.b)};
    const Rgb inside = passed * reflected;  // what is left of light after a crossing
    // Of how often the rest goes on within, the sum over all that are left.
    const auto all_orders = [](float left) { return left / std::max(1e-6F, 1 - left); };
    shares[0] = Gray(reflected);
    shares[1] = passed * ((1 - reflected) * (1 - reflected));
    shares[2] = shares[1] * inside;
    shares[3] = shares[2] * Rgb{all_orders(inside.r), all_orders(inside.g), all_orders(inside.b)};
    const float gamma_o = std::atan2(offset.sine, offset.cosine);
    const float gamma_t = std::asin(sin_gamma_t);
    for (std::size_t p = 0; p < turns.size(); ++p) {
      const auto times = static_cast<float>(p);
      turns[p] = 2 * times * gamma_t - 2 * gamma_o + times * std::numbers::pi_v<float>;
    }
  }
};

float Logistic(float x, float scale) {
  return 1 / (1 + std::exp(-x / scale));
}

// A logistic distribution that ends at -pi and pi: its density, and the number of a share `u`.
float TrimmedLogisticDensity(float x, float scale) {
  const float tail = std::exp(-std::abs(x) / scale);
  const float below = Logistic(-std::numbers::pi_v<float>, scale);
  return tail / (scale * (1 + tail) * (1 + tail) * (1 - 2 * below));
}

float TrimmedLogisticAt(float u, float scale) {
  const float below = Logistic(-std::numbers::pi_v<float>, scale);
  const float share = std::clamp(below + u * (1 - 2 * below), 1e-20F, 1 - 0x1p-24F);
  return std::clamp(-scale * std::log(1 / share - 1), -std::numbers::pi_v<float>,
                    std::numbers::pi_v<float>);
}

// N: the density of phi = phi_i - phi_o [rad⁻¹].
float AzimuthalDensity(const Crossing& crossing, std::size_t p, float phi, float scale) {
  if (p + 1 == kLobes) return 1 / kTwoPi;
  return TrimmedLogisticDensity(std::remainder(phi - crossing.turns[p], kTwoPi), scale);
}

// phi_i - phi_o.
float TurnBetween(Vec3 wo, Vec3 wi) {
  return std::atan2(wi.y * wo.z - wi.z * wo.y, wi.y * wo.y + wi.z * wo.z);
}

// The BSDF times the cosine with the normal, which it does not depend on [sr⁻¹].
Rgb ScatteredShare(const Material& material, const FibreLobes& lobes, Vec3 wo, Vec3 wi,
                   Carried carried) {
  Inclination out = InclinationOf(wo);
  Inclination in = InclinationOf(wi);
  const Offset offset(wo, out);
  float factor = 1;
  if (carried == Carried::kFlux) {
    // Photons come from `wo`, and eyes would see them leave to `wi`: the value for the way back,
    // times the widths that both see. Averages over the width are even in phi, so offset and phi
    // stay.
    if (!(out.cosine > 0)) return {};
    factor = in.cosine / out.cosine;
    std::swap(out, in);
  }
  const Crossing crossing(material, out, offset);
  const float phi = TurnBetween(wo, wi);
  Rgb sum;
  for (std::size_t p = 0; p < kLobes; ++p) {
    sum += crossing.shares[p] * (LongitudinalDensity(lobes.Tilted(out, p), in, lobes.variance[p]) *
                                 AzimuthalDensity(crossing, p, phi, lobes.scale));
  }
  return sum * factor;
}

// With which of the parts light is drawn: in proportion to what they carry, on average over the
// channels.
std::array<float, kLobes> LobeShares(const Crossing& crossing) {
  std::array<float, kLobes> shares{};
  float sum = 0;
  for (std::size_t p = 0; p < kLobes; ++p) {
    const Rgb& a = crossing.shares[p];
    shares[p] = a.r + a.g + a.b;
    sum += shares[p];
  }
  for (float& share : shares)
    share = sum > 0 ? share / sum : 1.0F / static_cast<float>(kLobes);
  return shares;
}

float DensityOf(const FibreLobes& lobes, const Inclination& out, const Crossing& crossing, Vec3 wo,
                Vec3 wi) {
  const Inclination in = InclinationOf(wi);
  const float phi = TurnBetween(wo, wi);
  const std::array<float, kLobes> shares = LobeShares(crossing);
  float density = 0;
  for (std::size_t p = 0; p < kLobes; ++p) {
    density += shares[p] * LongitudinalDensity(lobes.Tilted(out, p), in, lobes.variance[p]) *
               AzimuthalDensity(crossing, p, phi, lobes.scale);
  }
  return density;
}

// What is divided by the cosine here is multiplied by it again by all callers.
float PerCosine(Vec3 wi) {
  constexpr float kLeast = 1e-9F;
  return 1 / std::max(kLeast, std::abs(wi.z));
}

}  // namespace

bool HairBsdf::Sample(const Material& material, Vec3 wo, float u_lobe, float u1, float u2,
                      Carried carried, BsdfSample& sample) {
  const FibreLobes lobes(material);
  const Inclination out = InclinationOf(wo);
  const Offset offset(wo, out);
  const Crossing crossing(material, out, offset);
  const std::array<float, kLobes> shares = LobeShares(crossing);
  std::size_t p = 0;
  while (p + 1 < kLobes && u_lobe >= shares[p]) {
    u_lobe -= shares[p];
    ++p;
  }
  if (!(shares[p] > 0)) return false;
  // What is left of the number is as good as another one.
  const float u3 = std::clamp(u_lobe / shares[p], 0.0F, 0x1.fffffep-1F);
  // d'Eon et al. 2013, section 4: theta as of a direction that is spread around the mirrored one.
  const Inclination tilted = lobes.Tilted(out, p);
  const float v = lobes.variance[p];
  const float least = std::exp(-2 / v);
  const float along = std::clamp(1 + v * std::log(u1 + (1 - u1) * least), -1.0F, 1.0F);
  const float across = std::sqrt(std::max(0.0F, 1 - along * along)) * std::cos(kTwoPi * u2);
  const float sine = std::clamp(-along * tilted.sine + across * tilted.cosine, -1.0F, 1.0F);
  const float cosine = std::sqrt(1 - sine * sine);
  const float turn =
      p + 1 == kLobes ? kTwoPi * u3 : crossing.turns[p] + TrimmedLogisticAt(u3, lobes.scale);
  const float phi = std::atan2(wo.y, wo.z) + turn;
  sample.wi = {sine, cosine * std::sin(phi), cosine * std::cos(phi)};
  sample.is_delta = false;
  sample.pdf = DensityOf(lobes, out, crossing, wo, sample.wi);
  if (!(sample.pdf > 0)) return false;
  sample.weight = ScatteredShare(material, lobes, wo, sample.wi, carried) * (1 / sample.pdf);
  return true;
}

Rgb HairBsdf::Evaluate(const Material& material, Vec3 wo, Vec3 wi, Carried carried) {
  return ScatteredShare(material, FibreLobes(material), wo, wi, carried) * PerCosine(wi);
}

float HairBsdf::Pdf(const Material& material, Vec3 wo, Vec3 wi) {
  const Inclination out = InclinationOf(wo);
  const Crossing crossing(material, out, Offset(wo, out));
  return DensityOf(FibreLobes(material), out, crossing, wo, wi);
}

Rgb HairBsdf::Albedo(const Material& material) {
  return HairReflectance(material.absorption, material.beta_n);
}

float HairBsdf::ReflectedShare(const Material& /*material*/, float /*cos_o*/) {
  return 1;
}

float HairBsdf::ShareOfFirst(const Material& /*material*/, Vec3 /*wo*/) {
  return 1;
}

Rgb HairBsdf::EyeFactor(const Material& /*material*/, Vec3 /*wo*/) {
  return {};
}

float HairBsdf::PhotonFactor(const Material& /*material*/, Vec3 /*wi*/) {
  return 1;
}

}  // namespace lucerna
