#include "worker/gather.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "render/math/octahedral.h"
#include "render/math/rng.h"
#include "render/transport/bsdf.h"
#include "render/transport/material_at.h"
#include "worker/cut_disc.h"
#include "worker/gather_piece.h"
#include "worker/gather_segments.h"

namespace lucerna {
namespace {

// Whether a photon lies on the hitpoint's surface, and not on one above or below it. Along an arc
// the height of the photon over the hitpoint's plane is the hitpoint's over the photon's, so that
// both cancel in the sum below; at a bend of angle a, which is no edge up to 45 degrees, it is at
// most sin(a) times the distance; on a step, or a sheet that lies over another, nothing bends.
// Without an edge in the disc a surface may turn by up to 90 degrees, if it does so along an arc.
template <bool kCut>
bool IsOnSurface(Vec3 photon_normal, Vec3 normal, Vec3 to_photon, float squared_reach) {
  constexpr float kMostStep = 0.1F;  // twice its height over the reach, for rounding and facets
  constexpr float kLeastCosine = kCut ? kSameSurfaceCosine : 0;
  const float cosine = Dot(photon_normal, normal);
  if (!(cosine >= kLeastCosine)) return false;
  const float bend = cosine >= kSameSurfaceCosine ? 2 * std::max(0.0F, 1 - cosine) : 0;
  const float twice_height = Dot(to_photon, normal) + Dot(to_photon, photon_normal);
  return twice_height * twice_height <= (bend + kMostStep * kMostStep) * squared_reach;
}

// What a photon that counts adds to the columns of its radius controller, one class for
// each kind: chosen once per batch, so that a job pays for no other kind than its own.

template <Evidence kEvidence>
struct EvidenceSums;

template <>
struct EvidenceSums<Evidence::kNone> {
  EvidenceSums(Vec3 /*normal*/, const FluxScale& /*scale*/) {}
  void Add(const PhotonGrid& /*grid*/, std::size_t /*photon*/, Vec3 /*to_photon*/,
           float /*squared*/, float /*squared_radius*/, float /*weight*/, const CutDisc* /*cut*/) {}
  void Store(std::span<std::int64_t> /*columns*/) const {}
};

// Counts by cell of the disc (see kSectors).
template <>
struct EvidenceSums<Evidence::kSectors> {
  EvidenceSums(Vec3 normal, const FluxScale& /*scale*/) : frame(normal) {}
  void Add(const PhotonGrid& /*grid*/, std::size_t /*photon*/, Vec3 to_photon, float squared,
           float squared_radius, float /*weight*/, const CutDisc* cut) {
    const std::size_t ring = 2 * squared < squared_radius ? 0 : 6;
    ++counts[ring + SectorOf(to_photon)];
    // In place of what an edge has cut away, the other side of the hitpoint.
    if (cut != nullptr && !cut->Holds(cut->PlaceOf(-to_photon)))
      ++counts[ring + SectorOf(-to_photon)];
  }
  // Sixths of a turn by the sides of two lines at 60 degrees and the x axis, without an arc
  // tangent.
  [[nodiscard]] std::size_t SectorOf(Vec3 to_photon) const {
    constexpr float kSqrt3 = 1.7320508F;
    const float x = Dot(to_photon, frame.s);
    const float y = Dot(to_photon, frame.t);
    const bool above = y >= 0;
    const float side = std::abs(y);
    const std::size_t third = side < kSqrt3 * x ? 0 : side < -kSqrt3 * x ? 2 : 1;
    return above ? third : 5 - third;
  }
  void Store(std::span<std::int64_t> columns) const {
    std::ranges::copy(counts, columns.begin() + kCommonColumns);
  }

  Frame frame;
  std::array<std::int64_t, kSectors> counts{};
};

// From luminance [W] to the weights of evidence, and where those are held.
float WeightScale(const FluxScale& scale) {
  return 1 / (Luminance(scale.watts_per_quantum) * (1 << kFluxBits));
}
constexpr float kLargestWeight = 256;

// Adds a squared weight to a sum in units of kWeight2Unit. A term has up to 44 bits, so that
// kMostTerms of them might not fit: the sum, which never falls, stays where a few more fit.
void AddSquare(double square, std::int64_t& sum) {
  constexpr std::int64_t kMost = std::int64_t{1} << 56;
  constexpr double kUnits = 1 / kWeight2Unit;
  sum = std::min(kMost, sum + std::max<std::int64_t>(1, std::llrint(square * kUnits)));
}

// Sums over a wider disc (see CurvatureColumn).
template <>
struct EvidenceSums<Evidence::kCurvature> {
  EvidenceSums(Vec3 /*normal*/, const FluxScale& scale) : weight_scale(WeightScale(scale)) {}
  void Add(const PhotonGrid& /*grid*/, std::size_t /*photon*/, Vec3 to_photon, float squared,
           float squared_radius, float weight, const CutDisc* cut) {
    constexpr float kPerRadius = 1 / (kCurvatureReach * kCurvatureReach);
    constexpr auto kUnits = static_cast<float>(1 / kWeightUnit);
    const float w = std::min(weight * weight_scale, kLargestWeight);
    const float u = squared / squared_radius * kPerRadius;
    if (cut == nullptr) {
      sums[kCurvatureLaplacian] += std::llrint(w * (2 * u - 1) * kUnits);
      AddSquare(static_cast<double>(w * w), sums[kCurvatureWeight2]);
      return;
    }
    // At most 16 times what a whole disc may add: 36 bits, so that kMostTerms fit.
    constexpr float kLargest = 16 * kLargestWeight * kLargestWeight;
    const float laplacian = w * cut->LaplacianAt(cut->PlaceOf(to_photon), u);
    sums[kCurvatureLaplacian] += std::llrint(std::clamp(laplacian, -kLargest, kLargest) * kUnits);
    AddSquare(static_cast<double>(std::min(w * w * cut->inverse_share(), kLargest)),
              sums[kCurvatureWeight2]);
  }
  void Store(std::span<std::int64_t> columns) const {
    std::ranges::copy(sums, columns.begin() + kCommonColumns);
  }

  float weight_scale;
  std::array<std::int64_t, kCurvatureColumns> sums{};
};

// Sums over the frequency photons (see FrequencyColumn).
template <>
struct EvidenceSums<Evidence::kFrequency> {
  static constexpr std::int64_t kMostTrace2 = std::int64_t{1} << 62;
  EvidenceSums(Vec3 /*normal*/, const FluxScale& scale) : weight_scale(WeightScale(scale)) {}
  void Add(const PhotonGrid& grid, std::size_t photon, Vec3 /*to_photon*/, float /*squared*/,
           float squared_radius, float weight, const CutDisc* /*cut*/) {
    const float trace = grid.has_traces() ? grid.trace(photon) : -1;
    if (!(trace >= 0)) return;
    // In double: the terms span ten decades, and each is rounded once.
    const auto w = static_cast<double>(std::min(weight * weight_scale, kLargestWeight));
    const auto x = static_cast<double>(std::min(trace * squared_radius, kLargestTrace));
    constexpr double kUnits = 1 / kWeightUnit;
    ++sums[kFrequencyCount];
    sums[kFrequencyWeight] += std::llrint(w * kUnits);
    AddSquare(w * w, sums[kFrequencyWeight2]);
    sums[kFrequencyTrace] += std::llrint(w * x * kUnits);
    // A term has up to 48 bits, so that here alone kMostTerms of them might not fit: the sum, which
    // never falls, stays at kMostTrace2.
    sums[kFrequencyTrace2] = std::min<std::int64_t>(
        kMostTrace2, sums[kFrequencyTrace2] + std::llrint(w * x * x * kUnits));
  }
  void Store(std::span<std::int64_t> columns) const {
    std::ranges::copy(sums, columns.begin() + kCommonColumns);
  }

  float weight_scale;
  std::array<std::int64_t, kFrequencyColumns> sums{};
};

// Around the shading normal of a hitpoint, turned as its surface is where that matters.
Frame FrameOf(const GlossyHitpoint& glossy, const GlossyPlace* place) {
  const Vec3 normal = DecodeOctahedral(glossy.shading_normal_oct);
  if (place == nullptr || place->tangent_oct == kNoTangent) return Frame(normal);
  const Vec3 tangent = DecodeOctahedral(place->tangent_oct);
  // Rounding leaves both a little off a right angle.
  const Vec3 along = tangent - normal * Dot(tangent, normal);
  return LengthSquared(along) > 0 ? Frame(Normalize(along), normal) : Frame(normal);
}

// What one hitpoint gathers from.
struct RowSource {
  const PhotonGrid& grid;
  const CausticWeight* caustic_weight = nullptr;  // of caustic photons
  std::span<std::uint32_t> found_by;
};

// Contributions to discs that are cut may weigh many times the kernel. Held here, kMostTerms of
// them fit; a photon that carries about the scene's power is far below.
constexpr float kLargestCutContribution = 8 * kLargestContribution;

// Without kNormals every photon counts that lies in the disc. With kCut the disc is `cut`.
template <typename GatherKernel, Evidence kEvidence, bool kNormals, bool kCut>
void GatherRow(const HitpointBlock& block, std::size_t row, float radius,
               const GlossyHitpoint* glossy, const std::vector<Material>& materials,
               const FluxScale& scale, const RowSource& source, const CutDisc* cut,
               GatherPiece& piece, PassSums& sums) {
  const PhotonGrid& grid = source.grid;
  const auto hitpoint = static_cast<std::uint32_t>(row);
  const Vec3 position = block.positions[row];
  const Vec3 normal = DecodeOctahedral(block.normals_oct[row]);
  const float squared_radius = radius * radius;
  const float inverse_squared = 1 / squared_radius;
  const float quanta_per_luminance = 1 / Luminance(scale.watts_per_quantum);
  std::uint32_t count = 0;
  std::int64_t sum_r = 0;
  std::int64_t sum_g = 0;
  std::int64_t sum_b = 0;
  EvidenceSums<kEvidence> evidence(normal, scale);
  const float reach = radius * ReachOf(kEvidence);
  // The whole kernel less the inner one: see kBlurColumn.
  constexpr float kInnerArea = kInnerShare * kInnerShare;
  const auto blurred = [&](float squared, float whole) {
    const float t2 = squared * inverse_squared * (1 / kInnerArea);
    return t2 < 1 ? whole - GatherKernel::Shape(t2) * (1 / kInnerArea) : whole;
  };
  std::int64_t blur = 0;
  const auto count_photon = [&](std::size_t number) {
    if (!source.found_by.empty()) MarkFound(source.found_by[number], hitpoint);
    ++count;
  };
  const auto add = [&](const PhotonRecord& photon, Rgb flux, float squared, DiscPlace place) {
    const float whole = GatherKernel::Shape(squared * inverse_squared);
    const std::uint64_t bits = PairBits(photon.key, hitpoint);
    const auto dither = [&](int channel) { return DitherOf(bits, channel); };
    if constexpr (kCut) {
      const auto held = [](float value, float least) {
        return std::clamp(value, least, kLargestCutContribution);
      };
      const float weighed = whole * cut->WeightAt(place);
      const Rgb quanta = flux * scale.quanta_per_watt * weighed;
      const float inner = (whole - blurred(squared, whole)) * cut->InnerWeightAt(place);
      blur += std::llrint(held(Luminance(flux) * quanta_per_luminance * (weighed - inner),
                               -kLargestCutContribution));
      // Rounding may leave a weight below 0.
      sum_r += RoundDithered(held(quanta.r, 0), dither(0));
      sum_g += RoundDithered(held(quanta.g, 0), dither(1));
      sum_b += RoundDithered(held(quanta.b, 0), dither(2));
    } else {
      const Rgb quanta = flux * scale.quanta_per_watt * whole;
      blur += std::llrint(Luminance(flux) * quanta_per_luminance * blurred(squared, whole));
      sum_r += RoundDithered(quanta.r, dither(0));
      sum_g += RoundDithered(quanta.g, dither(1));
      sum_b += RoundDithered(quanta.b, dither(2));
    }
  };
  // Photons beyond the radius, for evidence that reaches further, have no part in the estimate.
  const auto for_each_photon = [&](const auto& visit) {
    const auto near = [&](std::size_t i, float squared) { visit(i, squared, std::true_type()); };
    if constexpr (ReachOf(kEvidence) > 1) {
      grid.ForEachWithin(position, radius, reach, near, [&](std::size_t i, float squared) {
        visit(i, squared, std::false_type());
      });
    } else {
      grid.ForEachWithin(position, reach, near);
    }
  };
  // Whether a place belongs to the disc.
  const auto find_place = [&](Vec3 to_photon, DiscPlace& place) {
    if constexpr (kCut) {
      place = cut->PlaceOf(to_photon);
      return cut->Holds(place);
    } else {
      return true;
    }
  };
  if (!kNormals || glossy == nullptr) {
    for_each_photon([&](std::size_t i, float squared, auto is_near) {
      const auto& photon = grid.template record<kNormals>(i);
      const Vec3 to_photon = grid.position(i) - position;
      if constexpr (kNormals) {
        if (!IsOnSurface<kCut>(photon.normal, normal, to_photon,
                               std::max(squared, squared_radius))) {
          return;
        }
      }
      DiscPlace place;
      if (!find_place(to_photon, place)) return;
      count_photon(i);
      if constexpr (is_near()) add(photon, photon.flux, squared, place);
      evidence.Add(grid, i, to_photon, squared, squared_radius, Luminance(photon.flux), cut);
    });
  } else {
    const Material& untextured = materials[glossy->material];
    const MaterialNumbers& numbers = untextured;
    std::optional<Material> textured;
    const GlossyPlace* place_of = nullptr;
    if (!block.places.empty() && untextured.DependsOnPlace()) {
      place_of = &block.places[static_cast<std::size_t>(glossy - block.glossy.data())];
      static_cast<MaterialNumbers&>(textured.emplace()) = numbers;
      if (untextured.texture != kNoTexture) SetTexturedParameter(*textured, place_of->color);
      SetNumbers(*textured, place_of->numbers);
    }
    // Where a surface has two parts, caustic photons are gathered on the one at which eye paths go
    // on without being smooth: a rough coat, or what lies under a smooth one.
    // Other photons are gathered on the second.
    const MaterialProperties properties = PropertiesOf(textured ? *textured : untextured);
    if (properties.has_parts) {
      if (!textured) static_cast<MaterialNumbers&>(textured.emplace()) = numbers;
      textured->parts = source.caustic_weight != nullptr && properties.has_rough_coat
                            ? Parts::kFirst
                            : Parts::kSecond;
    }
    const Material& material = textured ? *textured : untextured;
    const Frame frame = FrameOf(*glossy, place_of);
    const Vec3 wo = frame.ToLocal(DecodeOctahedral(glossy->to_eye_oct));
    const bool transmits = Transmits(material);
    for_each_photon([&](std::size_t i, float squared, auto is_near) {
      const FacingRecord& photon = grid.template record<true>(i);
      const Vec3 to_photon = grid.position(i) - position;
      // Photons on the far side of a rough dielectric count too.
      const bool is_behind = transmits && Dot(photon.normal, normal) < 0;
      if (!IsOnSurface<kCut>(photon.normal, is_behind ? -normal : normal, to_photon,
                             std::max(squared, squared_radius))) {
        return;
      }
      DiscPlace place;
      if (!find_place(to_photon, place)) return;
      const Vec3 wi = frame.ToLocal(DecodeOctahedral(photon.arrival_oct));
      Rgb scattered = photon.flux * EvaluateBsdf(material, wo, wi, Carried::kRadiance);
      if (source.caustic_weight != nullptr) {
        scattered *= source.caustic_weight->OfPhotons(grid.emission_density(i), wi.z,
                                                      PdfBsdf(material, wo, wi));
      }
      if (!scale.HasRoomFor(scattered)) {
        ++piece.excess;
        return;
      }
      count_photon(i);
      if constexpr (is_near()) add(photon, scattered, squared, place);
      evidence.Add(grid, i, to_photon, squared, squared_radius, Luminance(scattered), cut);
    });
  }
  if (count == 0) return;
  std::array<std::int64_t, EvidenceColumns(kEvidence)> columns{};
  columns[kBlurColumn] = blur;
  evidence.Store(columns);
  piece.fits = sums.AddRow(row, count, {sum_r, sum_g, sum_b}, columns) && piece.fits;
  piece.pairs += count;
}

template <typename GatherKernel, Evidence kEvidence, bool kNormals>
std::vector<GatherPiece> GatherAll(const HitpointBlock& block, const RadiusColumn& radii,
                                   const GatheredPhotons& photons,
                                   const std::vector<Material>& materials, const FluxScale& scale,
                                   ThreadTeam& team, const std::atomic<bool>& stop,
                                   PassSums& sums) {
  const std::size_t rows = block.first_segment();
  const std::size_t first_caustic = block.first_caustic();
  const RowSource ordinary = {photons.grid, nullptr, photons.found_by};
  const RowSource caustic = {photons.caustics != nullptr ? *photons.caustics : photons.grid,
                             photons.caustic_weight, photons.caustic_found_by};
  const std::size_t piece_count = (rows + kRowsPerPiece - 1) / kRowsPerPiece;
  std::vector<GatherPiece> pieces(piece_count);
  team.For(piece_count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      GatherPiece& piece = pieces[p];
      const std::size_t first = p * kRowsPerPiece;
      const std::size_t last = std::min(rows, first + kRowsPerPiece);
      auto glossy = std::lower_bound(
          block.glossy.begin(), block.glossy.end(), first,
          [](const GlossyHitpoint& g, std::size_t row) { return g.hitpoint < row; });
      CutDisc cut;
      for (std::size_t row = first; row < last && !stop.load(std::memory_order_relaxed); ++row) {
        const bool is_glossy = glossy != block.glossy.end() && glossy->hitpoint == row;
        const GlossyHitpoint* lobe = is_glossy ? &*glossy++ : nullptr;
        const bool is_caustic = row >= first_caustic;
        if (is_caustic && photons.caustics == nullptr) continue;
        const RowSource& source = is_caustic ? caustic : ordinary;
        bool is_cut = false;
        if (photons.features != nullptr) {
          const CutDisc::Outcome outcome = cut.Cut(
              *photons.features, block.positions[row], DecodeOctahedral(block.normals_oct[row]),
              radii[row], ReachOf(kEvidence), GatherKernel::kKind, [&] {
                return source.grid.HasAnyWithin(block.positions[row],
                                                radii[row] * ReachOf(kEvidence));
              });
          if (outcome == CutDisc::Outcome::kEmpty) continue;
          is_cut = outcome == CutDisc::Outcome::kCut;
        }
        const auto gather_row = [&](auto with_normals, auto with_cut) {
          GatherRow<GatherKernel, kEvidence, with_normals(), with_cut()>(
              block, row, radii[row], lobe, materials, scale, source, is_cut ? &cut : nullptr,
              piece, sums);
        };
        if (is_caustic) {
          is_cut ? gather_row(std::true_type(), std::true_type())
                 : gather_row(std::true_type(), std::false_type());
        } else {
          is_cut ? gather_row(std::bool_constant<kNormals>(), std::true_type())
                 : gather_row(std::bool_constant<kNormals>(), std::false_type());
        }
      }
    }
  });

  if (photons.scattered != nullptr) {
    for (const GatherPiece& piece :
         GatherSegments<GatherKernel>(block, radii, *photons.scattered, photons.scattered_found_by,
                                      *photons.media, scale, team, stop, sums))
      pieces.push_back(piece);
  }
  return pieces;
}

using GatherFunction = decltype(&GatherAll<ConstantKernel, Evidence::kNone, true>);

template <Evidence kEvidence, bool kNormals>
GatherFunction ForKernel(KernelKind kernel) {
  return WithKernel(kernel, [](auto k) -> GatherFunction {
    return &GatherAll<decltype(k), kEvidence, kNormals>;
  });
}

// Each kernel with each kind of evidence.
template <bool kNormals>
GatherFunction Specialised(KernelKind kernel, Evidence evidence) {
  return [&]<std::size_t... kKinds>(std::index_sequence<kKinds...>) {
    constexpr std::array kForKernel = {&ForKernel<kAllEvidence[kKinds].kind, kNormals>...};
    return kForKernel[static_cast<std::size_t>(evidence)](kernel);
  }
  (std::make_index_sequence<kAllEvidence.size()>());
}

}  // namespace

StatusOr<BatchTally> Gather(const HitpointBlock& block, const RadiusColumn& radii,
                            const GatheredPhotons& photons, const std::vector<Material>& materials,
                            const Kernel& kernel, const FluxScale& scale, ThreadTeam& team,
                            const std::atomic<bool>& stop, Evidence evidence, PassSums& sums) {
  const bool has_normals = photons.grid.has_normals();
  LUCERNA_CHECK(photons.grid.size() == 0 || block.glossy.size() == block.caustic_rows ||
                has_normals);
  LUCERNA_CHECK(photons.scattered == nullptr || photons.media != nullptr);
  LUCERNA_CHECK(photons.caustics == nullptr || photons.caustic_weight != nullptr);
  LUCERNA_CHECK(sums.size() == block.size() && sums.evidence().size() == EvidenceColumns(evidence));
  const GatherFunction gather = has_normals ? Specialised<true>(kernel.kind, evidence)
                                            : Specialised<false>(kernel.kind, evidence);
  GatheredPhotons found = photons;
  if (found.features != nullptr && found.features->empty()) found.features = nullptr;
  BatchTally tally;
  for (const GatherPiece& piece : gather(block, radii, found, materials, scale, team, stop, sums)) {
    if (!piece.fits) return absl::OutOfRangeError("the sums of a batch would not fit in 64 bits");
    tally.pairs += piece.pairs;
    tally.excess += piece.excess;
  }
  return tally;
}

}  // namespace lucerna
