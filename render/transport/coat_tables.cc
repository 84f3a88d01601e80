#include "render/transport/coat_tables.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "render/base/parallel.h"
#include "render/base/shared_values.h"
#include "render/math/rng.h"
#include "render/math/warp.h"
#include "render/scene/coat_table.h"
#include "render/scene/materials_in_use.h"
#include "render/transport/bsdf.h"
#include "render/transport/coat.h"
#include "render/transport/coat_walk.h"

namespace lucerna {
namespace {

// Facets that are averaged over: their slopes, which the critical angle cuts somewhere, and
// azimuths of each slope, turned by this share of the step between them against those of the last
// one.
constexpr int kSlopes = 96;
constexpr int kFacetAzimuths = 12;
constexpr float kGoldenRatio = 0.618034F;
// Strata of the angle at the base.
constexpr int kAngles = 32;
// Where the coat is smooth, one number is all that is averaged over.
constexpr int kSmoothAngles = 4096;
// Azimuths of an anisotropic coat, over a quarter of a turn, both ends among them.
constexpr int kAzimuths = 9;
constexpr int kScalings = 8;
// CoatTable::widening is looked for between these.
constexpr double kLeastWidening = 0.05;
constexpr double kMostWidening = 4;
// Of walks through a layer that scatters: events after which no more walks begin, for each cosine
// and from the base. A thick layer that absorbs nothing would hold a process for minutes.
constexpr std::int64_t kEventsOfNode = std::int64_t{1} << 18;
constexpr std::int64_t kEventsFromBase = std::int64_t{1} << 22;
// The narrowest width of a family. A coat that is smoother passes as much.
constexpr float kNarrowestOfFamily = 0.02F;

// Averages over the facets that are seen from `w`: visit(m, share of the average) for each. Few
// facets are steep, but a smooth function of their slope is not smooth in the number that chooses
// them: it has a root where that is 1, which is taken out.
template <typename Visit>
float MeanOverFacets(const Ggx& ggx, Vec3 w, const Visit& visit) {
  double sum = 0;
  for (int i = 0; i < kSlopes; ++i) {
    const float root = (static_cast<float>(i) + 0.5F) / kSlopes;
    const float share = 2 * root / (kSlopes * kFacetAzimuths);
    const float turn = std::fmod(kGoldenRatio * static_cast<float>(i), 1.0F);
    for (int j = 0; j < kFacetAzimuths; ++j) {
      const float u2 = (static_cast<float>(j) + turn) / kFacetAzimuths;
      const Vec3 m = ggx.SampleVisible(w, 1 - root * root, u2);
      if (Dot(w, m) > 0) sum += static_cast<double>(share * visit(m, share));
    }
  }
  return static_cast<float>(sum);
}

float RoughEntering(const MaterialNumbers& material, const Ggx& ggx, Vec3 w) {
  const float ior = material.ior;
  const float visible = ggx.G1(w);
  return MeanOverFacets(ggx, w, [&](Vec3 m, float /*share*/) {
    const float cos_m = Dot(w, m);
    float cos_t = 0;
    const float reflected = FresnelDielectric(cos_m, ior, cos_t);
    const Vec3 inside = w * (-1 / ior) + m * (cos_m / ior - cos_t);
    if (!(reflected < 1) || !(inside.z < 0)) return 0.0F;
    return (1 - reflected) * ggx.G2(w, -inside) / visible * CoatCrossing(material, -inside.z);
  });
}

// The share of light that the coat's facets reflect away from it.
float RoughReflected(const MaterialNumbers& material, const Ggx& ggx, Vec3 w) {
  const float visible = ggx.G1(w);
  return MeanOverFacets(ggx, w, [&](Vec3 m, float /*share*/) {
    float cos_t = 0;
    const float reflected = FresnelDielectric(Dot(w, m), material.ior, cos_t);
    const Vec3 up = ReflectAt(w, m);
    return up.z > 0 ? reflected * ggx.G2(w, up) / visible : 0.0F;
  });
}

// Of light that goes up from the base: the share that the coat's surface sends down to it.
float RoughReturned(const MaterialNumbers& material, const Ggx& ggx, Vec3 w) {
  const float visible = ggx.G1(w);
  return CoatCrossing(material, w.z) * MeanOverFacets(ggx, w, [&](Vec3 m, float /*share*/) {
           float cos_t = 0;
           const float reflected = FresnelDielectric(Dot(w, m), 1 / material.ior, cos_t);
           const Vec3 down = ReflectAt(w, m);
           if (!(down.z > 0)) return 0.0F;
           return reflected * ggx.G2(w, down) / visible * CoatCrossing(material, down.z);
         });
}

// Means over directions that leave a diffuse surface: of(cosine), whose density is 2 cosine.
template <typename Function>
float MeanOverBase(int angles, const Function& of) {
  double sum = 0;
  for (int i = 0; i < angles; ++i) {
    sum += static_cast<double>(
        of(std::sqrt((static_cast<float>(i) + 0.5F) / static_cast<float>(angles))));
  }
  return static_cast<float>(sum / angles);
}

// f(wo, wi) = (1 - R(wo)) (1 - R(wi)) / (1 - R̄) · ρ/π, with R the share that the coat's surface
// reflects and R̄ its mean, reflects all of what is left when ρ is 1 (Kelemen & Szirmay-Kalos 2001,
// "A Microfacet Based Coupled Specular-Matte BRDF Model with Importance Sampling").
CoatTable MakePassingTable(const MaterialNumbers& material) {
  CoatTable table;
  const bool is_smooth = HasNoFacets(material);
  const Ggx ggx(material);
  table.rows = material.alpha_u == material.alpha_v ? 1 : kAzimuths;
  const auto azimuth_of = [&](int row) {
    return table.rows == 1
               ? 0
               : 0.5F * kPi * static_cast<float>(row) / static_cast<float>(kAzimuths - 1);
  };
  const auto passed = [&](float cosine, int row) {
    if (is_smooth) return SmoothCoatEntering(material, cosine);
    return 1 - RoughReflected(material, ggx, DirectionAt(cosine, azimuth_of(row)));
  };
  float mean = 0;
  float sum_of_weights = 0;
  for (int row = 0; row < table.rows; ++row) {
    // All light that falls in along the surface is reflected.
    for (int i = 0; i < CoatTable::kCosines && !is_smooth; ++i)
      table.entering.push_back(i == 0 ? 0.0F : std::max(0.0F, passed(CoatTable::CosineOf(i), row)));
    const bool is_end = table.rows > 1 && (row == 0 || row == table.rows - 1);
    const float weight = is_end ? 0.5F : 1.0F;
    sum_of_weights += weight;
    mean += weight * MeanOverBase(is_smooth ? kSmoothAngles : kAngles,
                                  [&](float cosine) { return passed(cosine, row); });
  }
  mean /= sum_of_weights;
  table.passing = material.ior / std::sqrt(mean);
  table.leaving = mean * table.passing / Square(material.ior);
  return table;
}

CoatTable MakeTable(const MaterialNumbers& material) {
  if (material.coat_passes_rest) return MakePassingTable(material);
  CoatTable table;
  const float ior = material.ior;
  if (HasNoFacets(material)) {
    table.inner = MeanOverBase(kSmoothAngles, [&](float cosine) {
      float cos_t = 0;
      return FresnelDielectric(cosine, 1 / ior, cos_t) * Square(CoatCrossing(material, cosine));
    });
    // By reciprocity, what leaves is what enters over the square of the index.
    table.leaving =
        MeanOverBase(kSmoothAngles,
                     [&](float cosine) { return SmoothCoatEntering(material, cosine); }) /
        Square(ior);
    return table;
  }
  const Ggx ggx(material);
  table.rows = material.alpha_u == material.alpha_v ? 1 : kAzimuths;
  float sum_of_weights = 0;
  for (int row = 0; row < table.rows; ++row) {
    const float azimuth =
        table.rows == 1 ? 0
                        : 0.5F * kPi * static_cast<float>(row) / static_cast<float>(kAzimuths - 1);
    for (int i = 0; i < CoatTable::kCosines; ++i) {
      const float cosine = CoatTable::CosineOf(i);
      const Vec3 w = DirectionAt(cosine, azimuth);
      table.entering.push_back(i == 0 ? 0.0F : std::min(1.0F, RoughEntering(material, ggx, w)));
    }
    // The trapezoidal rule, exact for the first harmonics.
    const bool is_end = table.rows > 1 && (row == 0 || row == table.rows - 1);
    const float weight = is_end ? 0.5F : 1.0F;
    sum_of_weights += weight;
    table.inner += weight * MeanOverBase(kAngles, [&](float cosine) {
                     return RoughReturned(material, ggx, DirectionAt(cosine, azimuth));
                   });
    table.leaving += weight * MeanOverBase(kAngles, [&](float cosine) {
                       return RoughEntering(material, ggx, DirectionAt(cosine, azimuth));
                     });
  }
  table.inner /= sum_of_weights;
  table.leaving /= sum_of_weights * Square(ior);
  return table;
}

// Nodes of cosines for sums of 2 cosine d cosine, where cosine is (i / last)².
double WeightOfNode(int node) {
  const auto cosine = static_cast<double>(CoatTable::CosineOf(node));
  return (node == CoatTable::kCosines - 1 ? 0.5 : 1.0) * 4 * cosine * std::sqrt(cosine) /
         (CoatTable::kCosines - 1);
}

// To a table of what is not scattered.
void AddScattering(const MaterialNumbers& material, CoatTable& table) {
  constexpr std::size_t kAlbedos = CoatTable::kAlbedos;
  constexpr std::size_t kCosines = CoatTable::kCosines;
  CoatTable::Scattering& scattering = table.scattering;
  scattering.entering.assign(kAlbedos * kCosines, 0.0F);
  scattering.back.assign(kAlbedos * kCosines, 0.0F);
  KeyedRng rng(0x48415a45ULL);
  for (int node = 1; node < CoatTable::kCosines; ++node) {
    std::array<double, kAlbedos> entering{};
    std::array<double, kAlbedos> back{};
    int walks = 0;
    std::int64_t events = 0;
    for (; walks < kCoatWalks && events < kEventsOfNode; ++walks) {
      const Crossed crossed =
          CrossSurface(material, DirectionAt(CoatTable::CosineOf(node), 2 * kPi * rng.Uniform()),
                       material.ior, rng);
      if (!(crossed.transmitted > 0)) continue;
      LayerWalk in_layer(material, {crossed.beyond.x, crossed.beyond.y, -crossed.beyond.z},
                         static_cast<double>(crossed.transmitted), rng);
      in_layer.ScatterFirst();
      const bool is_at_base = in_layer.ToBase([&](double left, const AlbedoWeights& albedos) {
        for (std::size_t row = 0; row < kAlbedos; ++row)
          back[row] += left * albedos[row];
      });
      events += in_layer.events();
      if (!is_at_base) continue;
      for (std::size_t row = 0; row < kAlbedos; ++row)
        entering[row] += in_layer.weight() * in_layer.albedos()[row];
    }
    for (std::size_t row = 0; row < kAlbedos; ++row) {
      entering[row] /= walks;
      back[row] /= walks;
      const std::size_t at = row * kCosines + static_cast<std::size_t>(node);
      scattering.entering[at] = static_cast<float>(entering[row]);
      scattering.back[at] = static_cast<float>(back[row]);
      scattering.mean_back[row] += static_cast<float>(WeightOfNode(node) * back[row]);
    }
  }
  constexpr int kFromBase = 16 * kCoatWalks;
  std::array<double, kAlbedos> inner{};
  int walks = 0;
  for (std::int64_t events = 0; walks < kFromBase && events < kEventsFromBase; ++walks) {
    const float u1 = rng.Uniform();
    LayerWalk in_layer(material, SquareToCosineHemisphere(u1, rng.Uniform()), 1, rng);
    const bool is_at_base = in_layer.ToBase([](double, const AlbedoWeights&) {});
    events += in_layer.events();
    if (!is_at_base || !in_layer.is_scattered()) continue;
    for (std::size_t row = 0; row < kAlbedos; ++row)
      inner[row] += in_layer.weight() * in_layer.albedos()[row];
  }
  for (std::size_t row = 0; row < kAlbedos; ++row)
    scattering.inner[row] = static_cast<float>(inner[row] / walks);
}

// [albedos] of shares by meetings with the metal.
using WalkedShares = std::vector<std::array<double, CoatTable::kHits + 1>>;

// What light of a metal of medium reflectance weighs that has met it so often.
constexpr double kMediumReflectance = 0.6;

// Sums of cosines of the metal's facets, and of what they are weighted by.
struct MeanCosines {
  CosineSums sums{};
  double weight = 0;

  [[nodiscard]] CoatTable::CosineWeights Mean() const {
    CoatTable::CosineWeights mean = {};
    if (!(weight > 0)) return mean;
    for (std::size_t i = 0; i < mean.size(); ++i)
      mean[i] = static_cast<float>(sums[i] / weight);
    return mean;
  }
};

// Of light that leaves after its first meeting with the metal, and of all that does later.
struct NodeCosines {
  MeanCosines once, more;
};

// Adds the shares of flux at a node that leave coat and metal after 0, 1, 2, ... meetings. Returns
// the events in a layer that scatters.
int AddWalk(const MaterialNumbers& material, int walk, int node, WalkedShares& shares,
            NodeCosines& cosines) {
  MetalWalk metal_walk(material, CoatTable::CosineOf(node), WalkNumbers(walk, node));
  const auto place = [](int meetings) {
    return static_cast<std::size_t>(std::min(meetings, CoatTable::kHits));
  };
  if (material.HasHaze()) {
    return metal_walk.ThroughHaze([&](int meetings, double flux, const AlbedoWeights& albedos) {
      for (std::size_t row = 0; row < shares.size(); ++row)
        shares[row][place(meetings)] += flux * albedos[row];
    });
  }
  metal_walk.Through(material.base_hits, [&](int meetings, double flux, Vec3 /*out*/) {
    shares[0][place(meetings)] += flux;
    MeanCosines& mean = meetings < 2 ? cosines.once : cosines.more;
    const double weight = flux * std::pow(kMediumReflectance, meetings);
    Add(metal_walk.cosines(), weight, mean.sums);
    mean.weight += weight * meetings;
  });
  return 0;
}

// The mean of visit(direction outside, share of flux, share of the mean, cosine at the facet) over
// the directions in which light from `w` leaves that has met a metal of these facets once, 0 where
// none does. The metal reflects all, and so lets the coat's surface through.
template <typename Visit>
float MeanOverReflected(const Material& material, Vec3 w, const Ggx& facets, const Visit& visit) {
  Vec3 inside;
  if (!CoatRefracted(material, w, inside)) return 0;
  const float visible = facets.G1(inside);
  return MeanOverFacets(facets, inside, [&](Vec3 m, float share) {
    const Vec3 up = ReflectAt(inside, m);
    const float x = up.x * material.ior;
    const float y = up.y * material.ior;
    const float squared = 1 - x * x - y * y;
    if (!(up.z > 0) || !(squared > 0)) return 0.0F;
    return visit(Vec3{x, y, std::sqrt(squared)}, facets.G2(inside, up) / visible, share,
                 Dot(inside, m));
  });
}

// CoatTable::widening of light at right angles that has met the metal once: where the likelihood is
// greatest of the half vectors that random walks have. Facets of widths w have slopes (x, y) with
// density 1 / (π w_u w_v (1 + q)²), q = x²/w_u² + y²/w_v², and there the derivative of its
// logarithm has the same mean over the walks as over what the lobe brings.
float FittedWidening(const Material& material) {
  struct Met {
    double x2, y2;  // squares of slopes
    double flux;
  };
  const auto met_with = [&](Vec3 out, double flux) {
    Vec3 inside;
    if (!(flux > 0) || !CoatRefracted(material, out, inside)) return Met{0, 0, 0};
    const auto x = static_cast<double>(inside.x / (1 + inside.z));
    const auto y = static_cast<double>(inside.y / (1 + inside.z));
    return Met{x * x, y * y, flux};
  };
  std::vector<Met> walked;
  walked.reserve(kCoatWalks);
  for (int walk = 0; walk < kCoatWalks; ++walk) {
    MetalWalk(material, 1, WalkNumbers(walk, CoatTable::kCosines - 1))
        .Through(/*most_meetings=*/1, [&](int /*meetings*/, double flux, Vec3 out) {
          walked.push_back(met_with(out, flux));
        });
  }
  const auto squared = [](float width) {
    return static_cast<double>(width) * static_cast<double>(width);
  };
  const double turned_u = squared((1 - 1 / material.ior) * material.alpha_u);
  const double turned_v = squared((1 - 1 / material.ior) * material.alpha_v);
  const auto is_wider = [&](double widening) {
    const double u2 = squared(material.base_alpha_u) + widening * turned_u;
    const double v2 = squared(material.base_alpha_v) + widening * turned_v;
    struct Mean {
      double sum = 0, flux = 0;
    };
    const auto add = [&](const Met& met, double share, Mean& mean) {
      const double slope = met.x2 * turned_u / (u2 * u2) + met.y2 * turned_v / (v2 * v2);
      mean.sum += share * met.flux * slope / (1 + met.x2 / u2 + met.y2 / v2);
      mean.flux += share * met.flux;
    };
    Mean of_walks;
    for (const Met& met : walked)
      add(met, 1, of_walks);
    Mean of_lobe;
    const Ggx facets(static_cast<float>(std::sqrt(u2)), static_cast<float>(std::sqrt(v2)));
    MeanOverReflected(material, {0, 0, 1}, facets,
                      [&](Vec3 out, float flux, float share, float /*cosine*/) {
                        add(met_with(out, static_cast<double>(flux * CoatEntering(material, out))),
                            static_cast<double>(share), of_lobe);
                        return flux;
                      });
    return of_walks.sum * of_lobe.flux > of_lobe.sum * of_walks.flux;
  };
  double low = kLeastWidening;
  double high = kMostWidening;
  constexpr int kHalvings = 10;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = (low + high) / 2;
    (is_wider(middle) ? low : high) = middle;
  }
  return static_cast<float>((low + high) / 2);
}

// Azimuths over which directions at one cosine are averaged.
int TurnsOf(const Material& material) {
  return material.alpha_u == material.alpha_v && material.base_alpha_u == material.base_alpha_v ? 1
                                                                                                : 8;
}

template <typename Visit>
void ForEachTurn(const Material& material, float cosine, const Visit& visit) {
  const int turns = TurnsOf(material);
  for (int turn = 0; turn < turns; ++turn)
    visit(DirectionAt(cosine,
                      2 * kPi * (static_cast<float>(turn) + 0.5F) / static_cast<float>(turns)));
}

// [kCosines × kCosines] of the flux from one node, what leaves at each after one meeting with a
// metal of these facets that reflects all, and so lets the coat's surface through. Over azimuths an
// average.
struct NodeFlux {
  std::vector<double> flux;
  // The same times Lagrange's polynomials at the metal's facets; empty where they are not wanted.
  std::vector<CosineSums> cosines;
};
NodeFlux ReflectedBetweenNodes(const Material& material, const Ggx& facets, bool has_cosines) {
  constexpr std::size_t kCosines = CoatTable::kCosines;
  NodeFlux reflected;
  reflected.flux.resize(kCosines * kCosines);
  if (has_cosines) reflected.cosines.resize(kCosines * kCosines);
  const double of_turn = 1.0 / TurnsOf(material);
  for (std::size_t i = 1; i < kCosines; ++i) {
    ForEachTurn(material, CoatTable::CosineOf(static_cast<int>(i)), [&](Vec3 w) {
      MeanOverReflected(material, w, facets, [&](Vec3 out, float flux, float share, float cosine) {
        const CoatTable::Place node = CoatTable::PlaceOf(out.z);
        const double leaving = of_turn * static_cast<double>(flux * share);
        const std::size_t below = i * kCosines + node.below;
        const double above = leaving * static_cast<double>(node.share);
        reflected.flux[below] += leaving - above;
        reflected.flux[below + 1] += above;
        if (has_cosines) {
          const CosineSums at_facet = LagrangeAt(std::max(0.0F, cosine));
          Add(at_facet, leaving - above, reflected.cosines[below]);
          Add(at_facet, above, reflected.cosines[below + 1]);
        }
        return flux;
      });
    });
  }
  return reflected;
}

// What the first term of transport/coat.h brings of the flux at `cosine`, of a metal that reflects
// all.
double MeanMetOnce(const Material& material, float cosine) {
  const Ggx facets = BaseFacets(material);
  double sum = 0;
  ForEachTurn(material, cosine, [&](Vec3 w) {
    const float mean = MeanOverReflected(
        material, w, facets, [&](Vec3 out, float flux, float /*share*/, float /*cosine*/) {
          return CoatEntering(material, out) * flux;
        });
    sum += static_cast<double>(CoatEntering(material, w) * mean);
  });
  return sum / TurnsOf(material);
}

// What a metal makes of the residual at a node: shares by meetings, of which those after the first
// become a geometric series, equal to them at a medium reflectance.
void AddMeetings(const std::array<double, CoatTable::kHits + 1>& shares, const NodeCosines& cosines,
                 std::size_t node, CoatTable& table) {
  double more = 0;
  double left = 0;  // of `more`, at a medium reflectance, once at least
  double power = 1;
  for (std::size_t hit = 2; hit < shares.size(); ++hit, power *= kMediumReflectance) {
    more += shares[hit];
    left += shares[hit] * power;
  }
  const double all = shares[1] + more;
  const double share = more > 0 ? left / more : 1;
  table.met_once[node] = all > 0 ? static_cast<float>(shares[1] / all) : 0.0F;
  table.goes_on[node] = static_cast<float>((1 - share) / (1 - kMediumReflectance * share));
  // Where nothing meets the metal again, what is left of light that meets it once is there.
  table.residual_cosines[node] = (cosines.more.weight > 0 ? cosines.more : cosines.once).Mean();
}

// Fills CoatTable::once_cosines: numbers of the two directions, d(w) + d(w'), whose mean over what
// the first term brings of each direction is what the walks' mean differs by from the lobe's.
void AddOnce(const NodeFlux& reflected, const std::vector<NodeCosines>& walked, CoatTable& table) {
  constexpr std::size_t kCosines = CoatTable::kCosines;
  constexpr int kRounds = 64;
  // Over azimuths a mean, up to a factor.
  std::vector<double> entering(kCosines);
  for (std::size_t at = 0; at < table.entering.size(); ++at)
    entering[at % kCosines] += static_cast<double>(table.entering[at]);
  std::vector<CosineSums> missing(kCosines);
  std::vector<double> all(kCosines);
  for (std::size_t i = 1; i < kCosines; ++i) {
    CosineSums lobe{};
    for (std::size_t j = 0; j < kCosines; ++j) {
      all[i] += reflected.flux[i * kCosines + j] * entering[j];
      Add(reflected.cosines[i * kCosines + j], entering[j], lobe);
    }
    if (!(all[i] > 0) || !(walked[i].once.weight > 0)) continue;
    Add(walked[i].once.sums, 1 / walked[i].once.weight, missing[i]);
    Add(lobe, -1 / all[i], missing[i]);
  }
  std::vector<CosineSums> found(kCosines);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<CosineSums> next = found;
    for (std::size_t i = 1; i < kCosines; ++i) {
      if (!(all[i] > 0)) continue;
      CosineSums rest = missing[i];
      Add(found[i], -1, rest);
      for (std::size_t j = 1; j < kCosines; ++j)
        Add(found[j], -reflected.flux[i * kCosines + j] * entering[j] / all[i], rest);
      Add(rest, 0.5, next[i]);
    }
    found = std::move(next);
  }
  table.once_cosines.resize(kCosines);
  for (std::size_t i = 1; i < kCosines; ++i) {
    for (std::size_t k = 0; k < found[i].size(); ++k)
      table.once_cosines[i][k] = static_cast<float>(found[i][k]);
  }
  table.once_cosines[0] = table.once_cosines[1];
}

// Requires a material with a table for its coat alone, to which the rest is added.
void AddResidual(const Material& material, CoatTable& table) {
  constexpr std::size_t kCosines = CoatTable::kCosines;
  const std::size_t albedos = material.HasHaze() ? CoatTable::kAlbedos : 1;
  std::vector<WalkedShares> walked(kCosines, WalkedShares(albedos));
  std::vector<NodeCosines> cosines(kCosines);
  for (int i = 1; i < CoatTable::kCosines; ++i) {
    WalkedShares& here = walked[static_cast<std::size_t>(i)];
    int walks = 0;
    std::int64_t events = 0;
    for (; walks < kCoatWalks && events < kEventsOfNode; ++walks) {
      events += AddWalk(material, walks, i, here, cosines[static_cast<std::size_t>(i)]);
    }
    for (auto& row : here) {
      for (double& share : row)
        share /= walks;
    }
  }
  // Facets of the coat throw some of the light back that comes near the critical angle, which the
  // share that enters does not contain: the factor is scaled until the flux after one meeting is
  // that of the walk. Half of the error goes to each of its two occurrences.
  // Where E is the same for all azimuths, sums over nodes are the averages over facets.
  const bool has_nodes = table.rows == 1 && !table.entering.empty();
  NodeFlux reflected;
  if (!HasNoFacets(material))
    reflected = ReflectedBetweenNodes(material, BaseFacets(material), !material.HasHaze());
  const auto met_once = [&](int i) {
    if (!has_nodes) return MeanMetOnce(material, CoatTable::CosineOf(i));
    const auto node = static_cast<std::size_t>(i);
    double sum = 0;
    for (std::size_t j = 0; j < kCosines; ++j)
      sum += reflected.flux[node * kCosines + j] * static_cast<double>(table.entering[j]);
    return static_cast<double>(table.entering[node]) * sum;
  };
  for (int round = 0; round < kScalings && !table.entering.empty(); ++round) {
    std::vector<float> scaled = table.entering;
    for (int i = 1; i < CoatTable::kCosines; ++i) {
      const double once = met_once(i);
      if (!(once > 0)) continue;
      const auto scale =
          static_cast<float>(std::sqrt(walked[static_cast<std::size_t>(i)][0][1] / once));
      for (std::size_t at = static_cast<std::size_t>(i); at < scaled.size(); at += kCosines)
        scaled[at] *= scale;
    }
    table.entering = std::move(scaled);
  }
  if (!reflected.cosines.empty()) AddOnce(reflected, cosines, table);
  table.residual.assign(albedos * kCosines, 0.0F);
  for (std::size_t row = 0; row < albedos; ++row) {
    std::array<double, CoatTable::kHits + 1> by_hits = {};
    double sum = 0;
    for (int i = 1; i < CoatTable::kCosines; ++i) {
      auto& here = walked[static_cast<std::size_t>(i)][row];
      // Only what it brings too little can be made up for. Under a smooth coat it is exact, but for
      // haze, and what the walks differ by is noise.
      here[1] =
          HasNoFacets(material) && !material.HasHaze() ? 0 : std::max(0.0, here[1] - met_once(i));
      double residual = 0;
      for (std::size_t hit = 0; hit < here.size(); ++hit) {
        residual += here[hit];
        by_hits[hit] += WeightOfNode(i) * here[hit];
      }
      table.residual[row * kCosines + static_cast<std::size_t>(i)] = static_cast<float>(residual);
      sum += WeightOfNode(i) * residual;
    }
    if (!material.HasHaze()) {
      for (std::vector<float>* const column : {&table.met_once, &table.goes_on})
        column->resize(kCosines);
      table.residual_cosines.resize(kCosines);
      for (std::size_t node = 1; node < kCosines; ++node)
        AddMeetings(walked[node][row], cosines[node], node, table);
      // No light falls in along the surface.
      for (std::vector<float>* const column : {&table.met_once, &table.goes_on})
        column->front() = (*column)[1];
      table.residual_cosines[0] = table.residual_cosines[1];
    }
    table.mean_residual.push_back(static_cast<float>(sum));
    CoatTable::ByHits& shares = table.by_hits.emplace_back();
    for (std::size_t hit = 0; hit < by_hits.size(); ++hit)
      shares[hit] = sum > 0 ? static_cast<float>(by_hits[hit] / sum) : 0.0F;
  }
}

// Requires a table with the residual, to which the lobe is added that has its flux.
void AddAgain(const Material& material, CoatTable& table) {
  constexpr std::size_t kCosines = CoatTable::kCosines;
  const CoatTable::ByHits& shares = table.by_hits[0];
  for (std::size_t hit = 2; hit < shares.size(); ++hit)
    table.meetings_again += static_cast<float>(hit - 1) * shares[hit];
  const std::vector<double> reflected =
      ReflectedBetweenNodes(material, AgainFacets(material), /*has_cosines=*/false).flux;
  // Half of each error goes to each of the two occurrences of a factor.
  constexpr int kRounds = 64;
  std::vector<double> again(kCosines);
  for (std::size_t i = 1; i < kCosines; ++i)
    again[i] = std::sqrt(static_cast<double>(table.residual[i]));
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> scaled = again;
    for (std::size_t i = 1; i < kCosines; ++i) {
      double brought = 0;
      for (std::size_t j = 0; j < kCosines; ++j)
        brought += again[i] * reflected[i * kCosines + j] * again[j];
      scaled[i] *= brought > 0 ? std::sqrt(static_cast<double>(table.residual[i]) / brought) : 0;
    }
    again = std::move(scaled);
  }
  table.again.assign(again.begin(), again.end());
}

CoatTable MakeCoat(const Material& original) {
  CoatTable table = MakeTable(original);
  if (original.HasHaze() && original.kind == Material::Kind::kCoatedDiffuse)
    AddScattering(original, table);
  if (original.kind == Material::Kind::kCoatedConductor) {
    Material material = original;
    material.coat = &table;
    if (!HasNoFacets(material)) table.widening = FittedWidening(material);
    AddResidual(material, table);
    if (!material.HasHaze()) AddAgain(material, table);
  }
  return table;
}

// A table that is to be made, of `material`.
struct WantedCoat {
  Material material;
  CoatTable* table;
};

CoatFamily::Differing DifferingOf(const MaterialNumbers& material) {
  using enum CoatFamily::Differing;
  if (material.thickness_texture != kNoTexture) return kThickness;
  return (material.roughness_textures[0] & material.roughness_textures[1]) != kNoTexture ? kSurface
                                                                                         : kBase;
}

// The tables of a coat that is another one at each place, or of one over such a metal, and appends
// them to those that are to be made.
std::shared_ptr<const CoatFamily> FamilyOf(const Material& material,
                                           std::vector<WantedCoat>& wanted) {
  const auto family = std::make_shared<CoatFamily>();
  using enum CoatFamily::Differing;
  family->differing = DifferingOf(material);
  if (family->differing == kThickness) {
    family->largest = -std::expm1(-material.thickness);
  } else {
    const float widest = family->differing == kBase
                             ? std::max(material.base_alpha_u, material.base_alpha_v)
                             : std::max(material.alpha_u, material.alpha_v);
    family->least = CoatFamily::SpacingOf(kNarrowestOfFamily);
    family->largest = CoatFamily::SpacingOf(std::max(widest, 2 * kNarrowestOfFamily));
  }
  family->tables.resize(CoatFamily::kTables);
  for (int i = 0; i < CoatFamily::kTables; ++i) {
    Material one = material;
    const float number = family->least + (family->largest - family->least) * static_cast<float>(i) /
                                             static_cast<float>(CoatFamily::kTables - 1);
    switch (family->differing) {
      case kSurface:
        one.alpha_u = one.alpha_v = CoatFamily::WidthAt(number);
        break;
      case kBase:
        one.base_alpha_u = one.base_alpha_v = CoatFamily::WidthAt(number);
        break;
      case kThickness:
        // Of a thick layer the number is 1.
        if (i < CoatFamily::kTables - 1) one.thickness = -std::log1p(-number);
        break;
    }
    wanted.push_back({std::move(one), &family->tables[static_cast<std::size_t>(i)]});
  }
  return family;
}

}  // namespace

void PrepareCoats(std::vector<Material>& materials, int threads) {
  using FamilyKey = std::pair<CoatNumbers, CoatFamily::Differing>;
  static SharedValues<CoatNumbers, CoatTable> shared_tables;
  static SharedValues<FamilyKey, CoatFamily> shared_families;
  std::map<CoatNumbers, std::shared_ptr<const CoatTable>> tables;
  std::map<FamilyKey, std::shared_ptr<const CoatFamily>> families;
  std::vector<WantedCoat> wanted;
  for (Material& material : materials) {
    if (!HasCoatTables(material)) continue;
    if (material.HasCoatTexture()) {
      const FamilyKey key(CoatNumbersOf(material), DifferingOf(material));
      auto& family = families[key];
      if (family == nullptr) family = shared_families.Find(key);
      if (family == nullptr) family = FamilyOf(material, wanted);
      material.owned_coats = family;
      material.coats = family.get();
      FitCoat(material);
      continue;
    }
    const CoatNumbers key = CoatNumbersOf(material);
    auto& table = tables[key];
    if (table == nullptr) table = shared_tables.Find(key);
    if (table == nullptr) {
      const auto made = std::make_shared<CoatTable>();
      wanted.push_back({material, made.get()});
      table = made;
    }
    material.owned_coat = table;
    material.coat = table.get();
  }
  if (wanted.empty()) return;
  ThreadTeam(threads).For(wanted.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      *wanted[i].table = MakeCoat(wanted[i].material);
  });
  for (const auto& [key, table] : tables)
    shared_tables.Share(key, table);
  for (const auto& [key, family] : families)
    shared_families.Share(key, family);
}

}  // namespace lucerna
