// Any bytes as what travels between coordinator and workers: no crash, no hang, no memory without
// bound, and what decodes comes back from its own encoding and is fit to merge.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "render/math/octahedral.h"
#include "render/wire/accumulation_codec.h"
#include "render/wire/block_codec.h"
#include "render/wire/photon_guide_codec.h"
#include "render/wire/slice_codec.h"
#include "tests/fuzz/fuzz_targets.h"

namespace lucerna {
namespace {

// What the receiver expects, chosen by the first byte.
struct Input {
  std::uint8_t choice = 0;
  std::string_view bytes;
};
Input Split(std::string_view bytes) {
  if (bytes.empty()) return {};
  return {static_cast<std::uint8_t>(bytes.front()), bytes.substr(1)};
}
std::string Joined(std::uint8_t choice, const std::string& bytes) {
  return std::string(1, static_cast<char>(choice)) + bytes;
}

std::size_t RowsOf(std::uint8_t choice) {
  return std::size_t{choice} % 64;
}

SliceShape ShapeOf(std::uint8_t choice) {
  const bool has_features = choice % 2 == 1;
  return {.passes = has_features ? PassRange{4, 5} : PassRange{16, 18},
          .pixels = std::size_t{choice} / 2 % 16,
          .evidence = has_features ? std::size_t{0} : std::size_t{2},
          .photons_per_pass = 100};
}

}  // namespace

bool FuzzAccumulation(std::string_view bytes) {
  const auto [choice, encoded] = Split(bytes);
  const std::size_t rows = RowsOf(choice);
  const auto accumulation = DecodeAccumulation(encoded, rows);
  if (!accumulation.ok()) return false;
  const std::string again = EncodeAccumulation(*accumulation, rows);
  const auto same = DecodeAccumulation(again, rows);
  LUCERNA_CHECK(same.ok() && EncodeAccumulation(*same, rows) == again);
  // Checked before anything is added: an accumulation that is refused leaves no trace.
  PassSums sums(rows, accumulation->evidence.size());
  static_cast<void>(sums.Add(*accumulation));
  return true;
}

std::vector<std::string> AccumulationSeeds() {
  std::vector<std::string> seeds;
  for (const std::uint32_t step : {1U, 17U}) {
    constexpr std::uint8_t kRows = 40;
    Accumulation accumulation;
    for (std::uint32_t i = 0; i < kRows; i += step) {
      accumulation.hitpoints.push_back(i);
      accumulation.counts.push_back(1 + i % 4);
      accumulation.flux[0].push_back(1000 * i);
      accumulation.flux[1].push_back(70'000 * (1 + i % 4));
      accumulation.flux[2].push_back(12'345);
    }
    accumulation.tally.photons = 100;
    seeds.push_back(Joined(kRows, EncodeAccumulation(accumulation, kRows)));
  }
  return seeds;
}

bool FuzzBlock(std::string_view bytes) {
  const auto [choice, encoded] = Split(bytes);
  const std::size_t rows = RowsOf(choice);
  const auto block = DecodeHitpointBlock(encoded, rows);
  if (!block.ok()) return false;
  LUCERNA_CHECK(block->size() <= rows && block->normals_oct.size() == block->size());
  for (const Vec3& position : block->positions)
    LUCERNA_CHECK(IsFinite(position));
  for (const GlossyHitpoint& glossy : block->glossy)
    LUCERNA_CHECK(glossy.hitpoint < block->size());
  const std::string again = EncodeHitpointBlock(*block);
  const auto same = DecodeHitpointBlock(again, rows);
  LUCERNA_CHECK(same.ok() && EncodeHitpointBlock(*same) == again);
  return true;
}

std::vector<std::string> BlockSeeds() {
  constexpr std::uint8_t kRows = 40;
  HitpointBlock block;
  const std::uint32_t up = EncodeOctahedral({0, 0, 1});
  for (std::uint32_t i = 0; i < kRows; ++i) {
    block.positions.push_back({static_cast<float>(i), 1, 2});
    block.normals_oct.push_back(up + i);
    if (i % 5 == 0) block.glossy.push_back({i, 1, up, up});
  }
  return {Joined(kRows, EncodeHitpointBlock(block))};
}

bool FuzzRadii(std::string_view bytes) {
  const auto [choice, encoded] = Split(bytes);
  const std::size_t rows = RowsOf(choice);
  if (const auto counts = DecodeEyePathCounts(encoded, rows); counts.ok()) {
    LUCERNA_CHECK(counts->size() == rows);
    for (const std::uint8_t count : *counts)
      LUCERNA_CHECK(count >= 1 && count <= kMostEyePaths);
    LUCERNA_CHECK(DecodeEyePathCounts(EncodeEyePathCounts(*counts), rows).value() == *counts);
    return true;
  }
  const auto radii = DecodeRadii(encoded, rows);
  if (!radii.ok()) return false;
  LUCERNA_CHECK(radii->size() == rows);
  for (const float radius : *radii)
    LUCERNA_CHECK(radius > 0 && std::isfinite(radius));
  LUCERNA_CHECK(DecodeRadii(EncodeRadii(*radii), rows).value() == *radii);
  return true;
}

std::vector<std::string> RadiiSeeds() {
  constexpr std::uint8_t kRows = 40;
  RadiusColumn radii;
  for (std::size_t i = 0; i < kRows; ++i)
    radii.push_back(0.25F + static_cast<float>(i));
  EyePathCounts counts(kRows, 1);
  counts[7] = kMostEyePaths;
  return {Joined(kRows, EncodeRadii(radii)), Joined(kRows, EncodeEyePathCounts(counts))};
}

bool FuzzSlice(std::string_view bytes) {
  const auto [choice, encoded] = Split(bytes);
  const SliceShape shape = ShapeOf(choice);
  auto slice = DecodeSlice(encoded, shape);
  if (!slice.ok()) return false;
  // Passes that see nothing have no photons.
  LUCERNA_CHECK(slice->tally.photons <= shape.photons_per_pass * shape.passes.size());
  LUCERNA_CHECK(slice->tally.energy.Balance() && slice->tally.LightsFit());
  const std::string again = EncodeSlice(*slice);
  const auto same = DecodeSlice(again, shape);
  LUCERNA_CHECK(same.ok() && EncodeSlice(*same) == again);
  // It may be merged with another one, or is refused as a whole.
  const SliceSums sibling = EmptySlice(SiblingOf(shape.passes), shape.pixels, shape.evidence);
  const Status merged = MergeSibling(*slice, sibling);
  LUCERNA_CHECK(merged.ok() || absl::IsOutOfRange(merged));
  return true;
}

std::vector<std::string> SliceSeeds() {
  std::vector<std::string> seeds;
  for (const std::uint8_t choice : {std::uint8_t{10}, std::uint8_t{11}}) {
    const SliceShape shape = ShapeOf(choice);
    SliceSums slice = EmptySlice(shape.passes, shape.pixels, shape.evidence);
    for (std::size_t column = 0; column < slice.columns.size(); ++column) {
      for (std::size_t pixel = 0; pixel < slice.columns[column].size(); ++pixel) {
        slice.columns[column].Set(
            pixel,
            Rounded(std::exp(8 * static_cast<double>(pixel)) * (pixel % 3 == 0 ? -1 : 1) / 1000,
                    SignificantBits(shape.passes.size(), column, shape.evidence)));
      }
    }
    slice.tally.photons = shape.photons_per_pass * shape.passes.size();
    slice.tally.dropped = 2;
    slice.dropped_photons = {{shape.passes.first, 5}, {shape.passes.first, 99}};
    seeds.push_back(Joined(choice, EncodeSlice(slice)));
  }
  return seeds;
}

bool FuzzGuide(std::string_view bytes) {
  const auto guide = DecodePhotonGuide(bytes);
  if (!guide.ok()) return false;
  LUCERNA_CHECK(DecodePhotonGuide(EncodePhotonGuide(*guide)).value() == *guide);
  for (int i = 0; i < 64; ++i) {
    PrimaryNumbers numbers;
    numbers.fill((i + 0.5) / 64);
    const double weight = guide->Draw(numbers);
    LUCERNA_CHECK(weight > 0 && weight < 2 / kUnguidedShare);
    LUCERNA_CHECK(guide->WeightAt(numbers) == weight);
    for (const double number : numbers)
      LUCERNA_CHECK(number >= 0 && number < 1);
    if (guide->scatterings() == nullptr) continue;
    const ScatterGuide& scatterings = *guide->scatterings();
    const float u = (static_cast<float>(i) + 0.5F) / 64;
    const ScatterGuide::Cell cell = scatterings.CellAt({u, -u, 2 * u - 1});
    if (cell == ScatterGuide::kNoCell) continue;
    const Vec3 wi = scatterings.Draw(cell, u, 1 - u);
    const double factor = scatterings.FluxFactor(cell, wi, 0.1);
    LUCERNA_CHECK(IsFinite(wi) && factor > 0 && factor <= 1 / (1 - kGuidedScatterings) + 1e-9);
  }
  return true;
}

std::vector<std::string> GuideSeeds() {
  using Kind = ScatterGuide::Node::Kind;
  const std::uint32_t half = std::uint32_t{1} << 31;
  return {
      EncodePhotonGuide(PhotonGuide()),
      EncodePhotonGuide(PhotonGuide::Create({{2, half / 2}, {4, half}, {}, {}, {}}, 77).value()),
      EncodePhotonGuide(
          PhotonGuide::Create({}, 77,
                              std::make_shared<const ScatterGuide>(
                                  ScatterGuide::Create({{.kind = Kind::kX, .place = 0.5F},
                                                        {.kind = Kind::kU, .low_share = 200},
                                                        {},
                                                        {},
                                                        {.kind = Kind::kV, .low_share = 1},
                                                        {},
                                                        {}})
                                      .value()))
              .value())};
}

}  // namespace lucerna
