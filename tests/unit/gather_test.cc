// Hitpoints add up exactly the photons that reach them, to the last bit.
//
// The oracle goes over all pairs, in the other order (photons first), with the same rounding of
// each pair. Equality is exact, because integers are added.
#include "worker/gather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/octahedral.h"
#include "render/math/rng.h"
#include "render/math/warp.h"
#include "render/transport/bsdf.h"
#include "tests/support/gather_sums.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

// A deposit with all that it may have.
struct Photon {
  Vec3 position;
  Rgb flux;
  Vec3 normal;
  std::uint32_t arrival_oct;
  std::uint32_t key;
};

std::vector<Deposits> Columns(const std::vector<std::vector<Photon>>& chunks) {
  std::vector<Deposits> columns;
  for (const std::vector<Photon>& chunk : chunks) {
    Deposits& deposits = columns.emplace_back();
    for (const Photon& photon : chunk) {
      deposits.rows.push_back({photon.position, photon.flux, photon.key});
      deposits.normals.push_back(photon.normal);
      deposits.arrivals_oct.push_back(photon.arrival_oct);
    }
  }
  return columns;
}

struct Case {
  std::vector<std::vector<Photon>> deposits;
  HitpointBlock block;
  RadiusColumn radii;
  Bounds region;
  std::vector<Material> materials = {DiffuseMaterial(0.5F),
                                     ConductorMaterial(Gray(0.2F), Gray(3), 0.4F, 0.3F),
                                     DielectricMaterial(1.5F, 0.5F)};
};

Vec3 RandomDirection(KeyedRng& rng) {
  const float u1 = rng.Uniform();
  const float u2 = rng.Uniform();
  return SquareToSphere(u1, u2);
}

Case RandomCase(int photons, int hitpoints, bool glossy, std::uint64_t key) {
  Case out;
  KeyedRng rng(key);
  const auto point = [&] {
    const float x = rng.Uniform();
    const float y = rng.Uniform();
    return Vec3{x, y, 0.05F * rng.Uniform()};
  };
  out.deposits.resize(4);
  for (int i = 0; i < photons; ++i) {
    Photon deposit{};
    deposit.position = point();
    deposit.flux = {rng.Uniform(), 1e-4F * rng.Uniform(), 10};
    deposit.normal = RandomDirection(rng);
    deposit.arrival_oct = EncodeOctahedral(RandomDirection(rng));
    deposit.key = static_cast<std::uint32_t>(rng.Bits());
    out.region.Add(deposit.position);
    out.deposits[static_cast<std::size_t>(i % 4)].push_back(deposit);
  }
  for (int i = 0; i < hitpoints; ++i) {
    out.block.positions.push_back(point());
    out.block.normals_oct.push_back(EncodeOctahedral(RandomDirection(rng)));
    out.radii.push_back(std::pow(10.0F, -4 + 4 * rng.Uniform()));
    if (glossy && i % 3 != 0) {
      out.block.glossy.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i % 3),
                                  EncodeOctahedral(RandomDirection(rng)),
                                  EncodeOctahedral(RandomDirection(rng))});
    }
  }
  return out;
}

Accumulation GatherAll(const Case& input, const Kernel& kernel, const FluxScale& scale,
                       int threads) {
  ThreadTeam team(threads);
  const PhotonGrid grid(Columns(input.deposits), input.region, 0.02F, team);
  return GatherSums(input.block, input.radii, {grid}, input.materials, kernel, scale, team);
}

// Caustic rows and the others gather from photons of their own; a caustic photon from a point light
// counts in full, one from an emitter that scattered rays find as well counts less.
TEST(GatherTest, CausticRowsTakeCausticPhotonsAloneAndWeighThem) {
  const std::uint32_t up = EncodeOctahedral({0, 0, 1});
  Case input;
  input.block.positions = {{0, 0, 0}, {0, 0, 0}};
  input.block.normals_oct = {up, up};
  input.block.glossy = {{1, 1, up, up}};
  input.block.caustic_rows = 1;
  input.radii = {0.1F, 0.1F};
  Photon photon{};
  photon.flux = Gray(1);
  photon.normal = {0, 0, 1};
  photon.arrival_oct = up;
  photon.position = {0.01F, 0, 0};
  input.region.Add({-1, -1, -1});
  input.region.Add({1, 1, 1});
  input.deposits = {{photon}};
  ThreadTeam team(1);
  const FluxScale scale = FluxScale::ForPower(Gray(1));
  const Scene scene;
  RenderSettings settings;
  settings.width = settings.height = 1;
  settings.photons_per_pass = 1;
  settings.initial_radius = 1;
  const CausticWeight weight(scene, settings, input.region);
  const auto sums = [&](float emission_density) {
    std::vector<Deposits> caustics = Columns({{photon, photon}});
    caustics[0].emission_densities = {emission_density, emission_density};
    const PhotonGrid grid(Columns(input.deposits), input.region, 0.1F, team);
    const PhotonGrid caustic_grid(caustics, input.region, 0.1F, team);
    return GatherSums(input.block, input.radii, {grid, &caustic_grid, &weight}, input.materials,
                      Kernel{KernelKind::kConstant}, scale, team);
  };
  const Accumulation of_point = sums(HUGE_VALF);
  ASSERT_EQ(of_point.hitpoints, (std::vector<std::uint32_t>{0, 1}));
  EXPECT_EQ(of_point.counts, (std::vector<std::uint32_t>{1, 2}));
  // Straight down and straight up: f(n, n) of the metal, once for each photon.
  const Vec3 n = {0, 0, 1};
  const Material& metal = input.materials[1];
  const double f = static_cast<double>(EvaluateBsdf(metal, n, n, Carried::kRadiance).g);
  const double quanta = static_cast<double>(scale.quanta_per_watt.g);
  EXPECT_NEAR(static_cast<double>(of_point.flux[1][1]), 2 * f * quanta, 2);
  const float density = 3;
  const double share = static_cast<double>(weight.OfPhotons(density, 1, PdfBsdf(metal, n, n)));
  ASSERT_GT(share, 0.01);
  ASSERT_LT(share, 0.99);
  EXPECT_NEAR(static_cast<double>(sums(density).flux[1][1]), 2 * f * share * quanta, 2);
}

std::uint64_t PairBits(std::uint32_t key, std::uint32_t hitpoint) {
  std::uint64_t x = (std::uint64_t{key} << 32 | hitpoint) * 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 32)) * 0xD6E8FEB86659FD93ULL;
  return x ^ (x >> 32);
}

// The sums of all hitpoints [counts, r, g, b], touched or not.
std::vector<std::array<std::int64_t, 4>> Oracle(const Case& input, const Kernel& kernel,
                                                const FluxScale& scale) {
  std::vector<std::array<std::int64_t, 4>> sums(input.block.size());
  std::vector<const GlossyHitpoint*> glossy(input.block.size());
  for (const GlossyHitpoint& g : input.block.glossy)
    glossy[g.hitpoint] = &g;
  for (const auto& chunk : input.deposits) {
    for (const Photon& photon : chunk) {
      for (std::size_t row = 0; row < sums.size(); ++row) {
        const float radius = input.radii[row];
        const float squared = LengthSquared(photon.position - input.block.positions[row]);
        if (!(squared < radius * radius)) continue;
        const Vec3 normal = DecodeOctahedral(input.block.normals_oct[row]);
        const Vec3 to_photon = photon.position - input.block.positions[row];
        Vec3 side = normal;
        Rgb bsdf = Gray(1);
        if (glossy[row] != nullptr) {
          const Material& material = input.materials[glossy[row]->material];
          if (material.kind == Material::Kind::kDielectric && Dot(photon.normal, normal) < 0) {
            side = -normal;
          }
          const Frame frame(DecodeOctahedral(glossy[row]->shading_normal_oct));
          bsdf =
              EvaluateBsdf(material, frame.ToLocal(DecodeOctahedral(glossy[row]->to_eye_oct)),
                           frame.ToLocal(DecodeOctahedral(photon.arrival_oct)), Carried::kRadiance);
        }
        const float cosine = Dot(photon.normal, side);
        const float twice_height = Dot(to_photon, side) + Dot(to_photon, photon.normal);
        const float most = (cosine >= 0.71F ? 2 * std::max(0.0F, 1 - cosine) : 0) + 0.1F * 0.1F;
        if (cosine < 0 || twice_height * twice_height > most * (radius * radius)) continue;
        const float shape = kernel.Shape(squared * (1 / (radius * radius)));
        const std::uint64_t bits = PairBits(photon.key, static_cast<std::uint32_t>(row));
        ++sums[row][0];
        for (int c = 0; c < 3; ++c) {
          const float quanta = photon.flux[c] * bsdf[c] * scale.quanta_per_watt[c] * shape;
          sums[row][static_cast<std::size_t>(c) + 1] += RoundDithered(
              quanta, static_cast<std::uint32_t>((bits >> (21 * c)) & ((1U << 21) - 1)));
        }
      }
    }
  }
  return sums;
}

void ExpectEqualsOracle(const Case& input, const Kernel& kernel) {
  const FluxScale scale = FluxScale::ForPower({1, 1e-3F, 300});
  const auto expected = Oracle(input, kernel, scale);
  const Accumulation actual = GatherAll(input, kernel, scale, 1);
  std::size_t i = 0;
  std::uint64_t pairs = 0;
  for (std::size_t row = 0; row < expected.size(); ++row) {
    if (expected[row][0] == 0) continue;
    ASSERT_LT(i, actual.size());
    ASSERT_EQ(actual.hitpoints[i], row);
    ASSERT_EQ(actual.counts[i], expected[row][0]);
    for (std::size_t c = 0; c < 3; ++c)
      ASSERT_EQ(actual.flux[c][i], expected[row][c + 1]) << row;
    pairs += actual.counts[i];
    ++i;
  }
  EXPECT_EQ(i, actual.size());
  EXPECT_EQ(actual.tally.pairs, pairs);
  EXPECT_EQ(GatherAll(input, kernel, scale, 3), actual);
}

// On a glossy surface the BSDF may push a contribution beyond the range of the sums: it is left out
// and counted, while those at its end stay.
TEST(GatherTest, LeavesOutWhatHasNoRoomAndCountsIt) {
  Case input;
  input.block.positions = {{0, 0, 0}};
  input.block.normals_oct = {EncodeOctahedral({0, 0, 1})};
  input.radii = {1};
  input.deposits.resize(1);
  input.block.glossy = {{0, 1, EncodeOctahedral({0, 0, 1}), EncodeOctahedral({0, 0, 1})}};
  const FluxScale scale = FluxScale::ForPower(Gray(1));
  const auto add = [&](float flux) {
    Photon deposit{};
    deposit.flux = {0, flux, 0};
    deposit.normal = {0, 0, 1};
    deposit.arrival_oct = EncodeOctahedral({0, 0, 1});
    input.region.Add(deposit.position);
    input.deposits[0].push_back(deposit);
  };
  const Vec3 up = {0, 0, 1};
  const float bsdf = EvaluateBsdf(input.materials[1], up, up, Carried::kRadiance).g;
  // A little below, for the rounding of the product.
  const float largest = 0.999F * kLargestContribution * scale.watts_per_quantum.g / bsdf;
  add(largest);
  add(largest);
  for (const float flux : {1.002F * largest, 3e38F, HUGE_VALF, NAN})
    add(flux);
  const Accumulation sum = GatherAll(input, Kernel{KernelKind::kConstant}, scale, 1);
  ASSERT_EQ(sum.size(), 1U);
  EXPECT_EQ(sum.counts[0], 2U);
  EXPECT_NEAR(static_cast<double>(sum.flux[1][0]), 2 * 0.999 * 0x1p33, 0x1p34 * 0x1p-20);
  EXPECT_EQ(sum.tally.pairs, 2U);
  EXPECT_EQ(sum.tally.excess, 4U);
  // The column of the error estimate has terms up to eight times as large.
  EXPECT_LE(std::abs(sum.evidence[0][0]), 16 * static_cast<std::int64_t>(kLargestContribution));
}

TEST(GatherTest, EqualsTheSumOverAllPairs) {
  for (const KernelKind kind : {KernelKind::kConstant, KernelKind::kEpanechnikov}) {
    ExpectEqualsOracle(RandomCase(2000, 5000, /*glossy=*/false, 1), Kernel{kind});
    ExpectEqualsOracle(RandomCase(1000, 2500, /*glossy=*/true, 2), Kernel{kind});
  }
}

TEST(GatherTest, HandlesOnePhotonNoneAndFarHitpoints) {
  ExpectEqualsOracle(RandomCase(1, 200, false, 3), Kernel{});
  ExpectEqualsOracle(RandomCase(0, 200, true, 4), Kernel{});
  Case far = RandomCase(500, 200, false, 5);
  for (std::size_t i = 0; i < far.block.size(); i += 2) {
    far.block.positions[i] = far.block.positions[i] + Vec3{100, -50, 3};
    if (i % 4 == 0) far.radii[i] = 1000;
  }
  ExpectEqualsOracle(far, Kernel{});
}

TEST(GatherTest, DoesNotSeeTheOrderOfPhotons) {
  Case forward = RandomCase(3000, 500, true, 6);
  Case backward = forward;
  std::ranges::reverse(backward.deposits);
  for (auto& chunk : backward.deposits)
    std::ranges::reverse(chunk);
  const FluxScale scale = FluxScale::ForPower(Gray(1));
  EXPECT_EQ(GatherAll(forward, Kernel{}, scale, 1), GatherAll(backward, Kernel{}, scale, 2));
}

// A surface keeps its photons to itself, on each of its sides: neither the other wall of a corner
// nor a sheet above or below shares them. A bend does.
TEST(GatherTest, TellsItsOwnSurfaceFromOthers) {
  const auto count = [](Vec3 photon_position, Vec3 photon_normal) {
    Case input;
    Photon deposit{};
    deposit.position = photon_position;
    deposit.flux = Gray(1);
    deposit.normal = photon_normal;
    input.deposits = {{deposit}};
    input.region.Add(photon_position);
    input.block.positions = {{0, 0, 0}};
    input.block.normals_oct = {EncodeOctahedral({0, 0, 1})};
    input.radii = {1};
    return GatherAll(input, Kernel{}, FluxScale::ForPower(Gray(1)), 1).size();
  };
  EXPECT_EQ(count({0.1F, 0, 0}, {0, 0, 1}), 1U);
  EXPECT_EQ(count({0.1F, 0, 0.3F}, {-1, 0, 0}), 0U) << "a wall that rises from the floor";
  EXPECT_EQ(count({0.1F, 0, -0.3F}, {1, 0, 0}), 0U) << "the side of a box under its top";
  EXPECT_EQ(count({0.1F, 0, 0.1F}, {1, 0, 0}), 0U) << "the back of a wall";
  EXPECT_EQ(count({0.1F, 0, -0.01F}, {0, 0, -1}), 0U) << "the far side of a thin floor";
  EXPECT_EQ(count({0.1F, 0, 0.04F}, {0, 0, 1}), 1U) << "hardly higher";
  EXPECT_EQ(count({0.1F, 0, 0.06F}, {0, 0, 1}), 0U) << "a sheet above";
  // A bend by 40 degrees right beside the hitpoint, and one halfway.
  EXPECT_EQ(count({0.75F, 0, 0.63F}, {-0.6428F, 0, 0.766F}), 1U);
  EXPECT_EQ(count({0.75F, 0, 0.21F}, {-0.6428F, 0, 0.766F}), 1U);
  // On a ball of radius 1.3 below the hitpoint, 40 degrees away.
  EXPECT_EQ(count({0.8356F, 0, -0.3041F}, {0.6428F, 0, 0.766F}), 1U);
  // Inside a ball of radius 0.6 above it, 80 degrees away.
  EXPECT_EQ(count({0.5909F, 0, 0.4958F}, {-0.9848F, 0, 0.1736F}), 1U);
}

// Photons without normals all count; that is right where none would have been refused.
TEST(GatherTest, TakesEveryPhotonWithoutNormals) {
  Case input = RandomCase(2000, 500, /*glossy=*/false, 7);
  const FluxScale scale = FluxScale::ForPower(Gray(1));
  const auto without = [&] {
    std::vector<Deposits> columns = Columns(input.deposits);
    for (Deposits& deposits : columns) {
      deposits.normals.clear();
      deposits.arrivals_oct.clear();
    }
    ThreadTeam team(1);
    const PhotonGrid grid(columns, input.region, 0.02F, team);
    EXPECT_FALSE(grid.has_normals());
    return GatherSums(input.block, input.radii, {grid}, input.materials, Kernel{}, scale, team);
  };
  EXPECT_NE(without(), GatherAll(input, Kernel{}, scale, 1)) << "normals at random";
  const Vec3 up = {0, 0, 1};
  for (auto& chunk : input.deposits) {
    for (Photon& photon : chunk) {
      photon.normal = up;
      photon.position.z = 0;
    }
  }
  for (Vec3& position : input.block.positions)
    position.z = 0;
  std::ranges::fill(input.block.normals_oct, EncodeOctahedral(up));
  const Accumulation sum = without();
  EXPECT_GT(sum.tally.pairs, 1000U);
  EXPECT_EQ(sum, GatherAll(input, Kernel{}, scale, 1));
}

}  // namespace
}  // namespace lucerna
