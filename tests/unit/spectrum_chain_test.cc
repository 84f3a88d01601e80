// Long random paths lose no precision: no NaN, no negative variance, whatever the magnitudes.
//
// The same equations run in extended precision with a running error analysis: every number carries
// a bound of how far a double computation of it may be off, each operation adding its operands'
// bounds and a rounding of four units (2^-51, four because the order of operations may differ).
// So each chain has its own proven bound, which holds through clamps, since a clamp never widens a
// difference. Where a decision (penumbra or not, reflected or not) is within its bound, the chain
// ends. Source: Wilkinson 1963, "Rounding Errors in Algebraic Processes", ch. 1.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "gtest/gtest.h"

#include "render/frequency/spectrum.h"
#include "render/math/rng.h"

namespace lucerna {
namespace {

using Real = long double;
constexpr Real kRounding = 0x1p-51L;

// A number and how far from it a double's computation of it may be.
struct Tracked {
  Real value = 0;
  Real error = 0;

  Tracked() = default;
  Tracked(double exact) : value(exact) {}  // NOLINT: a constant is a Tracked without error
  Tracked(Real v, Real e) : value(v), error(e) {}
};

Real Times(Real a, Real b) {
  return a == 0 || b == 0 ? 0 : a * b;
}
Tracked Rounded(Real value, Real error) {
  return {value, error + std::abs(value) * kRounding};
}
Tracked operator+(Tracked a, Tracked b) {
  return Rounded(a.value + b.value, a.error + b.error);
}
Tracked operator-(Tracked a) {
  return {-a.value, a.error};
}
Tracked operator-(Tracked a, Tracked b) {
  return a + -b;
}
Tracked operator*(Tracked a, Tracked b) {
  return Rounded(a.value * b.value, Times(std::abs(a.value), b.error) +
                                        Times(std::abs(b.value), a.error) +
                                        Times(a.error, b.error));
}
Tracked operator/(Tracked a, Tracked b) {
  const Real q = a.value / b.value;
  const Real least = std::abs(b.value) - b.error;
  if (!(least > 0)) return {q, HUGE_VALL};
  return Rounded(q, (a.error + Times(std::abs(q), b.error)) / least);
}
Tracked Abs(Tracked a) {
  return {std::abs(a.value), a.error};
}
Tracked Max(Tracked a, Tracked b) {
  return {std::max(a.value, b.value), std::max(a.error, b.error)};
}
Tracked Sqrt(Tracked a) {
  const Real root = std::sqrt(a.value);
  return Rounded(root,
                 root > 0 ? std::min(std::sqrt(a.error), a.error / root) : std::sqrt(a.error));
}
Tracked Clamp(Tracked a, double low, double high) {
  return {std::clamp<Real>(a.value, low, high),
          std::min(a.error, static_cast<Real>(high) - static_cast<Real>(low))};
}

struct Reference {
  Tracked s, v, p, g, h;
};

const SpectrumLimits kLimits = SpectrumLimits::ForDiagonal(1);

Reference Held(const Reference& x) {
  return {Clamp(x.s, 0, kLimits.s), Clamp(x.v, -kLimits.v, kLimits.v), Clamp(x.p, 1e-14, 10),
          Clamp(x.g, 0, kLimits.g), Clamp(x.h, 0, kLimits.h)};
}

Reference TravelReference(const Reference& x, double d) {
  const Tracked u = Tracked(1) + x.v * d;
  const Tracked au = Max(Abs(u), 1e-9);
  const Tracked gd = x.g * d / au;
  const Tracked sf = x.s + x.h * d / au + Tracked(3) * gd * gd;
  const Tracked big = Max(u * u + x.p * sf * d * d, 1e-12);
  const Tracked k = Sqrt(big);
  return Held({sf / big, (x.v * u + sf * x.p * d) / big, x.p / big, x.g / (k * k * k),
               x.h / (k * k * k * k) + Tracked(3) * x.g * x.g * d / (k * k * k * k * k)});
}

Reference Mean(const Reference& a, const Reference& b) {
  return Held({(a.s + b.s) / 2, (a.v + b.v) / 2, (a.p + b.p) / 2, Max(a.g, b.g), Max(a.h, b.h)});
}

Reference MirrorReference(const Reference& x, double cosine, const SurfaceBend& bend) {
  const auto axis = [&](Tracked c, Tracked sn, double kappa) {
    const Tracked rate = Abs(Tracked(kappa) + x.v * c);
    const Tracked size = std::abs(kappa);
    const Tracked hs = Tracked(2) * size * (Tracked(1) + sn * sn) / (c * c * c) * rate * rate +
                       Tracked(16) * size * size * size + Tracked(2) * bend.second_gradient / c;
    const Tracked v2 = x.v + Tracked(2) * kappa / c;
    const Tracked t = sn / c;
    const Tracked e = Tracked(2) * t * kappa / c;
    const Tracked turn = Tracked(6) * kappa * t * (Tracked(kappa) + x.v * c);
    return Reference{x.s + e * e, v2, x.p, x.g + (Tracked(2) * bend.gradient + Abs(turn)) / (c * c),
                     x.h + hs / (c * c)};
  };
  const Tracked c = cosine;
  Reference sagittal = axis(1, 0, bend.sagittal);
  sagittal.s = x.s;
  sagittal.v = x.v + Tracked(2) * bend.sagittal * c;
  sagittal.g = 0;
  return Mean(axis(c, Sqrt(Tracked(1) - c * c), bend.tangential), sagittal);
}

Reference RefractReference(const Reference& x, double ratio, double cosine,
                           const SurfaceBend& bend) {
  const Tracked dl_sine = {std::sin(0.02L), 0x1p-60L};
  const Tracked dl_cosine = {std::cos(0.02L), 0x1p-54L};
  const auto cosine2 = [&](Tracked sn) {
    return Sqrt(Max(Tracked(1) - Tracked(ratio) * sn * (Tracked(ratio) * sn), 0.0004));
  };
  const auto f = [&](Tracked sn, Tracked c, double kappa) {
    const Tracked c2 = cosine2(sn);
    return (Tracked(ratio) * c * c * x.v - (c2 - Tracked(ratio) * c) * kappa) / (c2 * c2);
  };
  const auto axis = [&](Tracked c, Tracked sn, double kappa) {
    const Tracked c2 = cosine2(sn);
    const Tracked v2 = f(sn, c, kappa);
    const Tracked more = f(sn * dl_cosine + c * dl_sine, c * dl_cosine - sn * dl_sine, kappa);
    const Tracked less = f(sn * dl_cosine - c * dl_sine, c * dl_cosine + sn * dl_sine, kappa);
    const Tracked rate = Tracked(kappa) + x.v * c;
    const Tracked a = Abs(c2 - Tracked(ratio) * c) / (c2 * c2);
    const Tracked size = std::abs(kappa);
    const Tracked gs = (more - less) / 0.04 * rate;
    const Tracked hs = Abs(more - v2 - (v2 - less)) / (Tracked(0.02) * 0.02) * rate * rate +
                       Abs(Tracked(1) - ratio) * size * size * size + a * bend.second_gradient;
    const Tracked m = c2 / c;
    const Tracked q = Tracked(ratio) * c * c / (c2 * c2);
    const Tracked t1 = sn / c;
    const Tracked t2 = Tracked(ratio) * sn / c2;
    const Tracked e = Tracked(2) * (t2 * v2 - t1 * x.v / m) + Tracked(kappa) * (t2 - t1) / c2;
    const Tracked slant = Tracked(ratio) * sn * v2 * v2 - q * sn * x.v * x.v;
    return Reference{x.s / (m * m) + e * e, v2, x.p * (ratio / m) * (ratio / m),
                     x.g * q / m + a * bend.gradient / c2 + Abs(gs + slant) / c2,
                     x.h * q / (m * m) + hs / (c2 * c2)};
  };
  const Tracked c = cosine;
  const Tracked sn = Sqrt(Tracked(1) - c * c);
  Reference sagittal = axis(1, 0, bend.sagittal);
  sagittal.s = x.s;
  sagittal.v = Tracked(ratio) * x.v - (cosine2(sn) - Tracked(ratio) * c) * bend.sagittal;
  sagittal.g = 0;
  return Mean(axis(c, sn, bend.tangential), sagittal);
}

struct Outcome {
  Spectrum spectrum;
  Reference reference;
  bool undecided = false;
};

double LogUniform(KeyedRng& rng, double low, double high) {
  return std::pow(10, low + (high - low) * static_cast<double>(rng.Uniform()));
}
double Signed(KeyedRng& rng, double size) {
  return rng.Uniform() < 0.5F ? -size : size;
}

// One random event on both. `reach` is the decades that distances and curvatures span on either
// side of 1.
void Step(KeyedRng& rng, double reach, bool curved, Outcome& now) {
  Spectrum& x = now.spectrum;
  Reference& r = now.reference;
  const auto any = [&] { return LogUniform(rng, -reach, reach); };
  switch (rng.Bits() % (curved ? 8 : 6)) {
    case 0:
    case 1: {
      const double d = any();
      x = Travel(x, d, kLimits);
      r = TravelReference(r, d);
      return;
    }
    case 2: {
      const double o = any() * any();
      x = Narrow(x, o, kLimits);
      r = Held({r.s + o, r.v, r.p, r.g, r.h});
      return;
    }
    case 3: {
      const double lobe = LogUniform(rng, -12, -0.5);
      x = Blur(x, lobe, kLimits);
      r = Held({r.s, r.v, r.p + lobe, r.g, r.h});
      return;
    }
    case 4: {
      const double offset = any();
      const double rest = any();
      const Tracked u = Tracked(1) + r.v * rest;
      const Tracked blur = r.p * rest * rest;
      const Tracked margin = u * offset * (u * offset) - Tracked(4) * blur;
      now.undecided = !(std::abs(margin.value) > margin.error);
      Tracked o = Tracked(0.08) / (Tracked(offset) * offset);
      if (margin.value < 0) o = Max(o, Tracked(100) * u * u / blur);
      x = PassEdge(x, offset, rest, 0.08, kLimits);
      r = Held({r.s + Clamp(o, 0, kLimits.s), r.v, r.p, r.g, r.h});
      return;
    }
    case 5: {
      const double kappa = Signed(rng, any());
      const double c = 0.02 + 0.98 * static_cast<double>(rng.Uniform());
      const SurfaceBend bend = {.tangential = kappa};
      x = Mirror(x, c, bend, kLimits);
      r = MirrorReference(r, c, bend);
      return;
    }
    default: {
      const bool refracts = rng.Bits() % 2 == 0;
      const double c = 0.02 + 0.98 * static_cast<double>(rng.Uniform());
      const double size = any();
      const SurfaceBend bend = {Signed(rng, size), Signed(rng, any()), size * any(),
                                size * size * any()};
      // Not exact in double, and so held the same way on both sides.
      const SurfaceBend held = {bend.tangential, bend.sagittal, std::min(bend.gradient, kLimits.g),
                                std::min(bend.second_gradient, kLimits.h)};
      if (!refracts) {
        x = Mirror(x, c, held, kLimits);
        r = MirrorReference(r, c, held);
        return;
      }
      const double ratio = rng.Bits() % 2 == 0 ? 1 / 1.5 : 1.5;
      const double sine = ratio * std::sqrt(1 - c * c);
      now.undecided = std::abs(sine - 1) < 1e-14;
      x = Refract(x, ratio, c, held, kLimits);
      r = sine >= 1 ? MirrorReference(r, c, held) : RefractReference(r, ratio, c, held);
      return;
    }
  }
}

struct Tally {
  int chains = 0;
  int undecided = 0;
  int proven = 0;  // chains whose own bound of s is below 1e-6
  int off = 0;     // chains whose s is off by more than 1e-9
};

Tally RunChains(std::uint64_t key, int chains, int longest, double reach, bool curved) {
  Tally tally;
  for (int i = 0; i < chains; ++i) {
    KeyedRng rng(CombineKeys(key, static_cast<std::uint64_t>(i)));
    Outcome now;
    now.spectrum = {1e4, 0, 0.25, 0, 0};
    now.reference = {1e4, 0.0, 0.25, 0.0, 0.0};
    const int length = 1 + static_cast<int>(rng.Bits() % static_cast<std::uint64_t>(longest));
    for (int step = 0; step < length && !now.undecided; ++step) {
      Step(rng, reach, curved, now);
      if (now.undecided) break;
      const Spectrum& x = now.spectrum;
      const Reference& r = now.reference;
      const auto within = [](double got, Tracked expected) {
        return std::isfinite(got) && std::abs(static_cast<Real>(got) - expected.value) <=
                                         expected.error + std::numeric_limits<double>::min();
      };
      const bool good = x.s >= 0 && x.p > 0 && x.g >= 0 && x.h >= 0 && within(x.s, r.s) &&
                        within(x.v, r.v) && within(x.p, r.p) && within(x.g, r.g) &&
                        within(x.h, r.h);
      if (!good) {
        ADD_FAILURE() << "chain " << i << " step " << step << ": s " << x.s << " v " << x.v << " p "
                      << x.p << " g " << x.g << " h " << x.h << " against s " << r.s.value << " v "
                      << r.v.value << " p " << r.p.value << " g " << r.g.value << " h "
                      << r.h.value;
        return tally;
      }
    }
    ++tally.chains;
    tally.undecided += now.undecided ? 1 : 0;
    if (now.undecided) continue;
    const Tracked s = now.reference.s;
    const Real scale = std::max(s.value, static_cast<Real>(1e-300));
    tally.proven += s.error / scale < 1e-6L ? 1 : 0;
    tally.off += std::abs(static_cast<Real>(now.spectrum.s) - s.value) / scale > 1e-9L ? 1 : 0;
  }
  return tally;
}

void Report(const char* name, const Tally& tally) {
  testing::Test::RecordProperty(std::string(name) + "_undecided", tally.undecided);
  testing::Test::RecordProperty(std::string(name) + "_proven", tally.proven);
  testing::Test::RecordProperty(std::string(name) + "_off", tally.off);
}

// Only an exact focus magnifies a rounding: an error of 1e-9 needs |u| below 2^-52 / 1e-9 = 2e-7
// of v d, with no blur to hide it. u has a bounded density, so at most a few legs in a million
// come that near; the longest chains here have 12, so that a share of 1e-4 is ample.
void ExpectPrecise(const Tally& tally) {
  EXPECT_LE(tally.off, tally.chains / 10000);
  EXPECT_LE(tally.undecided, tally.chains / 100);
  // And the proof is worth something: it bounds nearly every chain's s to 1e-6.
  EXPECT_GE(tally.proven, tally.chains - tally.chains / 1000);
}

TEST(SpectrumChainTest, OfFlatAndFirstOrderEventsAreAsPreciseAsProven) {
  const Tally tally = RunChains(1, 500000, 12, 6, false);
  Report("flat", tally);
  ExpectPrecise(tally);
}

TEST(SpectrumChainTest, OfCurvedSurfacesAreAsPreciseAsProven) {
  const Tally tally = RunChains(2, 500000, 12, 6, true);
  Report("curved", tally);
  ExpectPrecise(tally);
}

// Within three decades foci are common.
TEST(SpectrumChainTest, OfMildMagnitudesAreAsPreciseAsProven) {
  const Tally tally = RunChains(4, 100000, 12, 1.5, true);
  Report("mild", tally);
  ExpectPrecise(tally);
}

TEST(SpectrumChainTest, OfAHundredEventsAreAsPreciseAsProven) {
  const Tally tally = RunChains(3, 5000, 100, 6, true);
  Report("long", tally);
  ExpectPrecise(tally);
}

}  // namespace
}  // namespace lucerna
