#include "worker/gather.h"

#include <cmath>

#include "render/math/octahedral.h"
#include "render/math/rng.h"
#include "render/transport/bsdf.h"

namespace lucerna {
namespace {

// Surfaces turned less than this from each other count as one.
constexpr float kSameSurfaceCosine = 0.7F;
// A photon on a surface turned further away counts in a hollow corner only, where each of the two
// points lies in front of the other's surface: there the photons of one wall make up for the part
// of the disc that the other wall lacks. Across an outward edge, and through a thin wall, they
// would be another place's light.
constexpr float kLeastCornerCosine = -0.2F;

bool Counts(const PhotonRecord& photon, Vec3 normal, Vec3 to_photon) {
  const float cosine = Dot(photon.normal, normal);
  if (cosine >= kSameSurfaceCosine) return true;
  return cosine >= kLeastCornerCosine && Dot(to_photon, normal) > 0 &&
         Dot(to_photon, photon.normal) < 0;
}

constexpr std::size_t kRowsPerPiece = 2048;

struct Piece {
  std::vector<std::uint32_t> hitpoints;
  std::vector<std::uint32_t> counts;
  std::array<std::vector<std::int64_t>, 3> flux;
  std::uint64_t pairs = 0;
};

// 64 random bits that belong to a (photon, hitpoint) pair.
std::uint64_t PairBits(std::uint32_t photon_key, std::uint32_t hitpoint) {
  std::uint64_t x = (static_cast<std::uint64_t>(photon_key) << 32 | hitpoint) * 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 32)) * 0xD6E8FEB86659FD93ULL;
  return x ^ (x >> 32);
}

}  // namespace

Accumulation Gather(const HitpointBlock& block, const RadiusColumn& radii, const PhotonGrid& grid,
                    const std::vector<Material>& materials, const Kernel& kernel,
                    const FluxScale& scale, ThreadTeam& team, const std::atomic<bool>& stop) {
  const std::size_t rows = block.size();
  const std::size_t piece_count = (rows + kRowsPerPiece - 1) / kRowsPerPiece;
  std::vector<Piece> pieces(piece_count);
  team.For(piece_count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      Piece& piece = pieces[p];
      const std::size_t first = p * kRowsPerPiece;
      const std::size_t last = std::min(rows, first + kRowsPerPiece);
      auto glossy = std::lower_bound(
          block.glossy.begin(), block.glossy.end(), first,
          [](const GlossyHitpoint& g, std::size_t row) { return g.hitpoint < row; });
      for (std::size_t row = first; row < last && !stop.load(std::memory_order_relaxed); ++row) {
        const auto hitpoint = static_cast<std::uint32_t>(row);
        const Vec3 normal = DecodeOctahedral(block.normals_oct[row]);
        const float radius = radii[row];
        const float inverse_squared = 1 / (radius * radius);
        std::uint32_t count = 0;
        std::int64_t sum_r = 0;
        std::int64_t sum_g = 0;
        std::int64_t sum_b = 0;
        const auto add = [&](const PhotonRecord& photon, Rgb quanta) {
          const std::uint64_t bits = PairBits(photon.key, hitpoint);
          constexpr std::uint64_t kMask = (1U << 21) - 1;
          sum_r += RoundDithered(quanta.r, static_cast<std::uint32_t>(bits & kMask));
          sum_g += RoundDithered(quanta.g, static_cast<std::uint32_t>((bits >> 21) & kMask));
          sum_b += RoundDithered(quanta.b, static_cast<std::uint32_t>((bits >> 42) & kMask));
          ++count;
        };
        if (glossy == block.glossy.end() || glossy->hitpoint != row) {
          grid.ForEachWithin(block.positions[row], radius, [&](std::size_t i, float squared) {
            const PhotonRecord& photon = grid.record(i);
            if (!Counts(photon, normal, grid.position(i) - block.positions[row])) return;
            add(photon, photon.flux * scale.quanta_per_watt *
                            kernel.Shape(squared * inverse_squared));
          });
        } else {
          const Material& material = materials[glossy->material];
          const Frame frame(DecodeOctahedral(glossy->shading_normal_oct));
          const Vec3 wo = frame.ToLocal(DecodeOctahedral(glossy->to_eye_oct));
          const bool transmits = material.kind == Material::Kind::kDielectric;
          ++glossy;
          grid.ForEachWithin(block.positions[row], radius, [&](std::size_t i, float squared) {
            const PhotonRecord& photon = grid.record(i);
            const Vec3 to_photon = grid.position(i) - block.positions[row];
            // Photons on the far side of a rough dielectric count too.
            const bool is_behind = transmits && Dot(photon.normal, normal) < 0;
            if (!Counts(photon, is_behind ? -normal : normal, to_photon)) return;
            const Vec3 wi = frame.ToLocal(DecodeOctahedral(photon.arrival_oct));
            const Rgb bsdf = EvaluateBsdf(material, wo, wi, Carried::kRadiance);
            add(photon, photon.flux * bsdf * scale.quanta_per_watt *
                            kernel.Shape(squared * inverse_squared));
          });
        }
        if (count == 0) continue;
        piece.hitpoints.push_back(hitpoint);
        piece.counts.push_back(count);
        piece.flux[0].push_back(sum_r);
        piece.flux[1].push_back(sum_g);
        piece.flux[2].push_back(sum_b);
        piece.pairs += count;
      }
    }
  });

  Accumulation accumulation;
  std::size_t touched = 0;
  for (const Piece& piece : pieces) touched += piece.hitpoints.size();
  accumulation.hitpoints.reserve(touched);
  accumulation.counts.reserve(touched);
  for (auto& channel : accumulation.flux) channel.reserve(touched);
  const auto append = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  for (const Piece& piece : pieces) {
    append(accumulation.hitpoints, piece.hitpoints);
    append(accumulation.counts, piece.counts);
    for (std::size_t c = 0; c < 3; ++c) append(accumulation.flux[c], piece.flux[c]);
    accumulation.tally.pairs += piece.pairs;
  }
  return accumulation;
}

}  // namespace lucerna
