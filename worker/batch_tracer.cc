#include "worker/batch_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "render/analysis/pass_time.h"
#include "render/analysis/prepared_scene.h"
#include "render/base/memory.h"
#include "render/base/parallel.h"
#include "render/estimate/evidence.h"
#include "render/geometry/feature_edges.h"
#include "render/math/fixed_point.h"
#include "worker/gather.h"
#include "worker/gather_segments.h"
#include "worker/photon_grid.h"
#include "worker/photon_path.h"

namespace lucerna {
namespace {

// A range is worked off in parts: large enough for the sort to pay, and no larger, because a
// deposit takes about 100 bytes. In a closed white room every photon lands max_depth times, so
// what is counted is the deposits as well: as many as two for each photon of a whole part.
constexpr std::uint64_t kPhotonsPerPart = std::uint64_t{1} << DepositSource::kNumberBits;
constexpr std::uint64_t kDepositsPerPart = std::uint64_t{1} << 21;
constexpr std::uint64_t kPhotonsPerChunk = 2048;
constexpr std::uint64_t kMostDepositsPerChunk = std::uint64_t{1} << 20;
constexpr std::uint64_t kChunksPerThread = 8;  // traced before deposits are counted again

Status CheckBlock(const HitpointBlock& block, const RadiusColumn& radii, const Scene& scene,
                  const SceneNeeds& needs) {
  if (block.caustic_rows > 0 && !needs.Uses(Part::kCausticHitpoints)) {
    return absl::InvalidArgumentError("there are caustic hitpoints, but the job needs none");
  }
  if (block.glossy.size() > block.caustic_rows && !needs.Uses(Part::kPhotonDirections)) {
    return absl::InvalidArgumentError("there are glossy hitpoints, but the job needs none");
  }
  if (block.normals_oct.size() != block.size() || radii.size() != block.size()) {
    return absl::InvalidArgumentError("hitpoint columns and radii differ in length");
  }
  for (const float radius : radii) {
    if (!(radius > 0) || !std::isfinite(radius)) {
      return absl::InvalidArgumentError("a hitpoint's radius is not a positive number");
    }
  }
  if (!block.segments.empty() && !needs.Uses(Part::kMedia)) {
    return absl::InvalidArgumentError("there are segments in media, but the job needs none");
  }
  for (const MediumSegment& segment : block.segments) {
    if (segment.medium >= scene.media.size()) {
      return absl::InvalidArgumentError("a segment names a medium that is not there");
    }
  }
  std::int64_t previous = -1;
  for (const GlossyHitpoint& glossy : block.glossy) {
    if (glossy.hitpoint >= block.size() || static_cast<std::int64_t>(glossy.hitpoint) <= previous ||
        glossy.material >= scene.materials.size()) {
      return absl::InvalidArgumentError("a glossy hitpoint is out of order or out of range");
    }
    previous = glossy.hitpoint;
  }
  return absl::OkStatus();
}

// Rows that a thread takes at once where little is done with each.
constexpr std::size_t kRowsAtOnce = std::size_t{1} << 14;

// The sum of what body(begin, end) gives for the pieces of [0, count), by `add`, in their order.
template <typename Sum, typename Body, typename Add>
Sum SumOfPieces(ThreadTeam& team, std::size_t count, const Body& body, const Add& add) {
  std::vector<Sum> pieces((count + kRowsAtOnce - 1) / kRowsAtOnce);
  team.For(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t piece = begin; piece < end; ++piece) {
      pieces[piece] = body(piece * kRowsAtOnce, std::min(count, (piece + 1) * kRowsAtOnce));
    }
  });
  Sum sum = {};
  for (Sum& piece : pieces)
    add(sum, piece);
  return sum;
}

// The box around what region_of(begin, end) gives for the pieces of [0, count).
template <typename RegionOfPiece>
Bounds RegionOfPieces(ThreadTeam& team, std::size_t count, const RegionOfPiece& region_of) {
  return SumOfPieces<Bounds>(team, count, region_of, [](Bounds& region, const Bounds& piece) {
    if (piece.empty()) return;
    region.Add(piece.low);
    region.Add(piece.high);
  });
}

// The box in which a photon can be found by some hitpoint.
Bounds RegionOf(const HitpointBlock& block, const RadiusColumn& radii, float radii_reach,
                ThreadTeam& team) {
  return RegionOfPieces(team, block.first_segment(), [&](std::size_t begin, std::size_t end) {
    Bounds region;
    for (std::size_t row = begin; row < end; ++row) {
      const float r = radii_reach * radii[row];
      const Vec3 reach = {r, r, r};
      region.Add(block.positions[row] - reach);
      region.Add(block.positions[row] + reach);
    }
    return region;
  });
}

// The box in which a photon that a medium scattered can be found by some segment.
Bounds MediaRegionOf(const HitpointBlock& block, const RadiusColumn& radii, ThreadTeam& team) {
  return RegionOfPieces(team, block.segments.size(), [&](std::size_t begin, std::size_t end) {
    Bounds region;
    for (std::size_t i = begin; i < end; ++i) {
      const float radius = radii[block.first_segment() + i];
      const Vec3 around = {radius, radius, radius};
      const PhotonTree::Cone cone = SegmentReach(block, i, radius).cone;
      for (const Vec3 at : {cone.origin, cone.origin + cone.direction * cone.length}) {
        region.Add(at - around);
        region.Add(at + around);
      }
    }
    return region;
  });
}

// Cells twice as wide as the middle radius: a hitpoint meets two to three of them along an axis,
// and a few very large or small radii do not spoil the grid for the others. Some thousands of the
// hitpoints tell: what is found does not depend on the width.
float CellWidth(std::span<const float> of_hitpoints) {
  if (of_hitpoints.empty()) return 0;
  constexpr std::size_t kSample = std::size_t{1} << 13;
  const std::size_t step = 1 + of_hitpoints.size() / kSample;
  RadiusColumn radii;
  for (std::size_t row = step / 2; row < of_hitpoints.size(); row += step)
    radii.push_back(of_hitpoints[row]);
  const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
  std::nth_element(radii.begin(), middle, radii.end());
  return 2 * *middle;
}

// The photons of a part by light, of those that stand for photons drawn without a guide: those that
// each has sent, and those that hitpoints found.
std::vector<LightTally> TallyLights(
    const std::vector<std::array<std::uint64_t, kMaxLightGroups>>& sent,
    const GatheredPhotons& photons) {
  std::vector<LightTally> lights(kMaxLightTallies);
  for (const auto& of_chunk : sent) {
    for (std::size_t light = 0; light < kMaxLightGroups; ++light)
      lights[light].sent += of_chunk[light];
  }
  // [photons of the part × classes] whether the photon has been counted. By one thread: bits that
  // several set would go from core to core, which takes twice as long already with two.
  std::vector<bool> is_counted(kPathClasses << DepositSource::kNumberBits);
  const auto count = [&](const auto& grid, std::span<const std::uint32_t> found_by) {
    for (std::size_t i = 0; i < found_by.size(); ++i) {
      if (found_by[i] == kNotFound) continue;
      const DepositSource source = grid.source(i);
      if (!source.is_unguided) continue;
      const auto path = static_cast<std::size_t>(source.path);
      const std::size_t entry = kPathClasses * source.number + path;
      if (is_counted[entry]) continue;
      is_counted[entry] = true;
      ++lights[source.light].in_view[path];
    }
  };
  count(photons.grid, photons.found_by);
  if (photons.caustics != nullptr) count(*photons.caustics, photons.caustic_found_by);
  if (photons.scattered != nullptr) count(*photons.scattered, photons.scattered_found_by);
  while (!lights.empty() && lights.back().sent == 0)
    lights.pop_back();
  return lights;
}

// Those found of the photons of a part from `first` on that the guide asks to be reported.
std::vector<FoundPhoton> ReportFound(const PhotonPathTracer& tracer, std::uint64_t pass,
                                     std::uint64_t first, const GatheredPhotons& photons,
                                     ThreadTeam& team) {
  using Found = std::vector<FoundPhoton>;
  Found found;
  const auto append = [](Found& all, const Found& of_piece) {
    all.insert(all.end(), of_piece.begin(), of_piece.end());
  };
  const auto add = [&](const auto& grid, std::span<const std::uint32_t> found_by) {
    const auto of_deposits = [&](std::size_t begin, std::size_t end) {
      Found of_piece;
      for (std::size_t i = begin; i < end; ++i) {
        if (found_by[i] == kNotFound) continue;
        const DepositSource source = grid.source(i);
        if (!source.is_reportable) continue;
        const std::uint64_t index = tracer.IndexOf(pass, first, source.number);
        if (const auto numbers = tracer.ReportOf(pass, index))
          of_piece.push_back({index, *numbers, found_by[i]});
      }
      return of_piece;
    };
    append(found, SumOfPieces<Found>(team, found_by.size(), of_deposits, append));
  };
  add(photons.grid, photons.found_by);
  if (photons.caustics != nullptr) add(*photons.caustics, photons.caustic_found_by);
  if (photons.scattered != nullptr) add(*photons.scattered, photons.scattered_found_by);
  std::ranges::sort(found, {},
                    [](const FoundPhoton& photon) { return std::pair(photon.index, photon.row); });
  // A photon may have left several deposits.
  const auto repeated = std::ranges::unique(found, {}, &FoundPhoton::index);
  found.erase(repeated.begin(), repeated.end());
  return found;
}

// A photon path that leaves as many deposits as its greatest depth leaves few for others.
Status CheckDeposits(const std::vector<BatchTally>& tallies) {
  std::uint64_t deposits = 0;
  for (const BatchTally& tally : tallies)
    deposits += tally.deposits;
  if (deposits <= kMostTerms) return absl::OkStatus();
  return absl::OutOfRangeError(absl::StrCat("a batch has ", deposits, " deposits, more than the ",
                                            kMostTerms,
                                            " that sums have room for; give a lower maxdepth"));
}

}  // namespace

struct BatchTracer::State {
  State(Scene s, int threads)
      : prepared(std::move(s), threads),
        features(std::in_place, prepared.scene(), threads),
        time_of_features(prepared.time()),
        team(threads) {}

  // Builds what a pass of a job with these needs uses; what the one before it used too is kept.
  Status PrepareFor(const RenderSettings& settings, const SceneNeeds& needs, std::uint64_t pass) {
    const double time = TimeOfPass(prepared.scene().motion, settings.seed, pass);
    if (prepared.IsPreparedFor(needs, time)) return absl::OkStatus();
    spectra.reset();
    eye_paths.reset();
    LUCERNA_RETURN_IF_ERROR(prepared.PrepareFor(needs, time));
    if (time_of_features != time) features.emplace(prepared.scene(), team.threads());
    time_of_features = time;
    return absl::OkStatus();
  }

  // Requires PrepareFor. Keeps the first hits that it found while the settings stay.
  void PrepareEyePaths(const RenderSettings& settings) {
    if (eye_paths != nullptr && eye_settings == settings) return;
    eye_settings = settings;
    eye_paths =
        std::make_unique<EyePathTracer>(prepared.scene(), eye_settings, prepared.needs(),
                                        prepared.intersector(), prepared.lights(), team.threads());
    film_spread.emplace(*eye_paths);
    if (prepared.needs().Uses(Part::kSpectra)) film_spread->Prepare(team);
    first_hits.emplace(prepared.needs().eye_sample_sets(),
                       static_cast<std::size_t>(settings.crop_width()) *
                           static_cast<std::size_t>(settings.crop_height()));
  }

  // Requires PrepareFor.
  Status PrepareSpectra(const RenderSettings& settings, std::uint64_t pass) {
    if (EvidenceOf(settings.radius_controller, pass) != Evidence::kFrequency) {
      return absl::OkStatus();
    }
    if (spectra != nullptr && spectra->Suits(settings)) return absl::OkStatus();
    LUCERNA_ASSIGN_OR_RETURN(spectra,
                             SpectrumTracer::Create(prepared.scene(), settings, prepared.needs(),
                                                    prepared.intersector(), prepared.lights()));
    return absl::OkStatus();
  }

  PreparedScene prepared;
  std::optional<FeatureEdges> features;
  double time_of_features;
  ThreadTeam team;
  // Made when a job uses it.
  std::unique_ptr<SpectrumTracer> spectra;
  RenderSettings eye_settings;
  std::unique_ptr<EyePathTracer> eye_paths;
  std::optional<FilmSpread> film_spread;
  std::optional<FirstHits> first_hits;
};

BatchTracer::BatchTracer(Scene scene, int threads)
    : state_(std::make_unique<State>(std::move(scene), threads)) {}
BatchTracer::~BatchTracer() = default;

StatusOr<Accumulation> BatchTracer::Run(const RenderSettings& settings, const SceneNeeds& needs,
                                        std::uint64_t pass, std::uint64_t first, std::uint64_t last,
                                        const HitpointBlock& block, const RadiusColumn& radii,
                                        const std::atomic<bool>& stop,
                                        std::uint64_t photons_per_pass, const PhotonGuide* guide) {
  LUCERNA_RETURN_IF_ERROR(CheckBlock(block, radii, state_->prepared.scene(), needs));
  const std::size_t columns = EvidenceColumns(EvidenceOf(settings.radius_controller, pass));
  if (block.size() == 0 || first >= last) {
    Accumulation none;
    none.tally.photons = last > first ? last - first : 0;
    none.evidence.resize(columns);
    return none;
  }
  std::vector<std::uint64_t> dropped;
  const PhotonRange photons = {pass, first, last, photons_per_pass, guide};
  LUCERNA_RETURN_IF_ERROR(state_->PrepareFor(settings, needs, pass));
  LUCERNA_RETURN_IF_ERROR(state_->PrepareSpectra(settings, pass));
  const PreparedScene::AtPass at_pass(state_->prepared, settings.seed, pass);
  LUCERNA_ASSIGN_OR_RETURN(const PassSums sums,
                           GatherPhotons(settings, needs, photons, block, radii, stop, dropped));
  LUCERNA_ASSIGN_OR_RETURN(Accumulation accumulation, sums.ToAccumulation());
  accumulation.dropped_photons = std::move(dropped);
  return accumulation;
}

StatusOr<PassSums> BatchTracer::GatherPhotons(const RenderSettings& settings,
                                              const SceneNeeds& needs, const PhotonRange& range,
                                              const HitpointBlock& block, const RadiusColumn& radii,
                                              const std::atomic<bool>& stop,
                                              std::vector<std::uint64_t>& dropped_photons) {
  const std::uint64_t pass = range.pass;
  const std::uint64_t last = range.last;
  const PhotonGuide* const guide = range.guide;
  const Evidence evidence = EvidenceOf(settings.radius_controller, pass);
  const PreparedScene& prepared = state_->prepared;
  const Bounds region = RegionOf(block, radii, ReachOf(evidence), state_->team);
  const Bounds media_region = MediaRegionOf(block, radii, state_->team);
  const std::size_t first_caustic = block.first_caustic();
  const float cell = CellWidth(std::span(radii).first(first_caustic));
  const float caustic_cell = CellWidth(std::span(radii).subspan(first_caustic, block.caustic_rows));
  const CausticWeight caustic_weight(prepared.scene(), settings, prepared.intersector().bounds());
  const SpectrumTracer* spectra =
      evidence == Evidence::kFrequency ? state_->spectra.get() : nullptr;
  const PhotonPathTracer tracer(prepared.scene(), prepared.intersector(), prepared.lights(),
                                settings, needs, spectra, region, range.photons_per_pass,
                                media_region, guide);
  const std::uint64_t per_chunk =
      std::clamp(kMostDepositsPerChunk / static_cast<std::uint64_t>(settings.max_depth),
                 std::uint64_t{1}, kPhotonsPerChunk);
  const std::uint64_t per_round = per_chunk * kChunksPerThread *
                                  static_cast<std::uint64_t>(std::max(1, state_->team.threads()));
  const Status given_up = absl::CancelledError("the batch was given up");
  const std::size_t columns = EvidenceColumns(evidence);
  // Made when deposits have been sorted: the memory that sorting takes is free by then.
  std::optional<PassSums> sums;
  for (std::uint64_t next = range.first; next < last;) {
    const std::uint64_t part = next;
    const std::uint64_t part_end = std::min(last, part + kPhotonsPerPart);
    std::vector<Deposits> deposits;
    std::vector<Deposits> caustics;
    std::vector<Deposits> scattered;
    std::vector<BatchTally> tallies;
    std::vector<std::vector<std::uint64_t>> dropped;
    std::vector<std::array<std::uint64_t, kMaxLightGroups>> sent;
    std::uint64_t found = 0;
    while (next < part_end && found < kDepositsPerPart && !stop) {
      const std::uint64_t round_end = std::min(part_end, next + per_round);
      const std::size_t before = tallies.size();
      // As many deposits as the chunks so far had, and some more.
      const std::uint64_t expected = next > part ? per_chunk * found * 9 / (8 * (next - part)) : 0;
      const auto chunks = static_cast<std::size_t>((round_end - next + per_chunk - 1) / per_chunk);
      deposits.resize(before + chunks);
      caustics.resize(before + chunks);
      scattered.resize(before + chunks);
      tallies.resize(before + chunks);
      dropped.resize(before + chunks);
      sent.resize(before + chunks);
      state_->team.For(chunks, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t chunk = begin; chunk < end && !stop.load(std::memory_order_relaxed);
             ++chunk) {
          const std::uint64_t chunk_first = next + chunk * per_chunk;
          const std::uint64_t chunk_last = std::min(round_end, chunk_first + per_chunk);
          PhotonPathTracer::Landed landed;
          landed.deposits.rows.reserve(expected);
          for (std::uint64_t index = chunk_first; index < chunk_last; ++index) {
            tracer.Trace(pass, index, landed);
          }
          BatchTally& tally = tallies[before + chunk];
          tally.photons = chunk_last - chunk_first;
          tally.rays = landed.rays;
          tally.dropped = landed.dropped;
          tally.deposits =
              landed.deposits.size() + landed.caustics.size() + landed.scattered.size();
          tally.excess = landed.excess;
          tally.energy = landed.energy;
          dropped[before + chunk] = std::move(landed.dropped_photons);
          sent[before + chunk] = landed.sent;
          deposits[before + chunk] = std::move(landed.deposits);
          caustics[before + chunk] = std::move(landed.caustics);
          scattered[before + chunk] = std::move(landed.scattered);
        }
      });
      for (std::size_t chunk = before; chunk < tallies.size(); ++chunk)
        found += tallies[chunk].deposits;
      next = round_end;
    }
    if (stop) return given_up;
    LUCERNA_RETURN_IF_ERROR(CheckDeposits(tallies));
    // Sorted deposits are copies: those they were made of go.
    const PhotonGrid grid(deposits, region, cell, state_->team);
    FreeMemoryOf(deposits);
    if (stop) return given_up;
    std::vector<std::uint32_t> found_by(grid.size(), kNotFound);
    std::optional<PhotonGrid> caustic_grid;
    std::vector<std::uint32_t> caustic_found_by;
    GatheredPhotons photons{.grid = grid, .features = &*state_->features, .found_by = found_by};
    if (block.caustic_rows > 0) {
      caustic_grid.emplace(caustics, region, caustic_cell, state_->team);
      FreeMemoryOf(caustics);
      if (stop) return given_up;
      caustic_found_by.assign(caustic_grid->size(), kNotFound);
      photons.caustics = &*caustic_grid;
      photons.caustic_found_by = caustic_found_by;
      photons.caustic_weight = &caustic_weight;
    }
    std::optional<PhotonTree> tree;
    std::vector<std::uint32_t> scattered_found_by;
    if (!block.segments.empty()) {
      tree.emplace(scattered, state_->team);
      FreeMemoryOf(scattered);
      if (stop) return given_up;
      scattered_found_by.assign(tree->size(), kNotFound);
      photons.scattered = &*tree;
      photons.scattered_found_by = scattered_found_by;
      photons.media = &prepared.scene().media;
    }
    Accumulation counted;
    counted.evidence.resize(columns);
    if (!sums) sums.emplace(block.size(), columns, &state_->team);
    LUCERNA_ASSIGN_OR_RETURN(
        counted.tally,
        Gather(block, radii, photons, prepared.scene().materials, Kernel{settings.kernel},
               prepared.flux_scale(), state_->team, stop, evidence, *sums));
    if (stop) return given_up;
    for (const BatchTally& tally : tallies)
      counted.tally += tally;
    counted.tally.lights = TallyLights(sent, photons);
    if (guide != nullptr && guide->reported() > 0)
      counted.found = ReportFound(tracer, pass, part, photons, state_->team);
    LUCERNA_RETURN_IF_ERROR(sums->Add(counted));
    for (const std::vector<std::uint64_t>& named : dropped) {
      for (const std::uint64_t index : named) {
        if (dropped_photons.size() == kDroppedNamed) break;
        dropped_photons.push_back(index);
      }
    }
  }
  return sums ? *std::move(sums) : PassSums(block.size(), columns);
}

StatusOr<SliceSums> BatchTracer::RunPass(const RenderSettings& settings, const SceneNeeds& needs,
                                         std::uint64_t pass, const RoundPlan& plan,
                                         const std::atomic<bool>& stop) {
  State& state = *state_;
  LUCERNA_RETURN_IF_ERROR(state.PrepareSpectra(settings, pass));
  const PreparedScene::AtPass at_pass(state.prepared, settings.seed, pass);
  EyePass eye = TraceHitpointPass(
      *state.eye_paths, pass, state.first_hits->Of(pass), *state.film_spread, state.team,
      [&stop] { return stop.load(std::memory_order_relaxed); }, plan.eye_paths.get());
  if (stop || !eye.is_whole) return absl::CancelledError("the slice was given up");
  // Before photons are gathered, for which the most memory is needed: the slice holds in fewer
  // bytes what eye paths brought.
  SliceSums slice = BeginSlice(eye, settings);
  AddEyePaths(slice, eye, settings, needs, state.team);
  RadiusColumn radii = TakeHitpointRadii(eye, plan, &state.team);
  std::optional<PassSums> sums;
  // A camera that sees nothing needs no photons, and without light there are none.
  if (eye.block.size() > 0 && needs.Uses(Part::kPhotons)) {
    std::vector<std::uint64_t> named;
    const PhotonRange photons = {pass, 0, plan.photons_per_pass, plan.photons_per_pass,
                                 plan.guide.get()};
    LUCERNA_ASSIGN_OR_RETURN(
        sums, GatherPhotons(settings, needs, photons, eye.block, radii, stop, named));
    for (const std::uint64_t index : named)
      slice.dropped_photons.push_back({pass, index});
  }
  if (!sums) {
    sums.emplace(eye.block.size(), EvidenceColumns(EvidenceOf(settings.radius_controller, pass)));
  }
  AddPhotons(slice, eye, plan, std::move(radii), *std::move(sums), settings, needs,
             state.prepared.flux_scale(), state.team);
  return slice;
}

StatusOr<SliceSums> BatchTracer::RunSlice(const RenderSettings& settings, const SceneNeeds& needs,
                                          const PassRange& passes, const RoundPlan& plan,
                                          const std::atomic<bool>& stop) {
  const std::size_t pixels = static_cast<std::size_t>(settings.crop_width()) *
                             static_cast<std::size_t>(settings.crop_height());
  if (!IsSlice(passes) || plan.radii == nullptr || plan.radii->size() != pixels ||
      (plan.eye_paths != nullptr && plan.eye_paths->size() != pixels)) {
    return absl::InvalidArgumentError("a slice's passes, radii or eye paths do not fit its job");
  }
  if (passes.size() == 1) {
    LUCERNA_RETURN_IF_ERROR(state_->PrepareFor(settings, needs, passes.first));
    state_->PrepareEyePaths(settings);
    return RunPass(settings, needs, passes.first, plan, stop);
  }
  const std::uint64_t middle = passes.first + passes.size() / 2;
  LUCERNA_ASSIGN_OR_RETURN(SliceSums sums,
                           RunSlice(settings, needs, {passes.first, middle}, plan, stop));
  LUCERNA_ASSIGN_OR_RETURN(const SliceSums second,
                           RunSlice(settings, needs, {middle, passes.last}, plan, stop));
  LUCERNA_RETURN_IF_ERROR(MergeSibling(sums, second, &state_->team));
  return sums;
}

ThreadTeam& BatchTracer::team() {
  return state_->team;
}

}  // namespace lucerna
