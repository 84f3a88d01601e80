// How fast are the parts that a render spends its time in?
//
// One thread each, so that numbers are per core. Scenes: glass-box, and water-caustic,
// cornell-box and others where they lie beside the project, or those that the command line names.
// * photon_paths: photon paths per second, tracing and keeping deposits
// * photon_rays: the same rays again, intersection only: the upper bound
// * eye_paths: eye paths per second with direct light
// * batch: photons per second of a whole batch, for each kind of evidence, with the same radii
// * gather: seconds per pair of photon and hitpoint, sorting the photons included
// * gather_whole_discs: the same without edges; with one photon only finding edges takes time
// * feature_edges: finding all edges of the scene
// * block_on_the_wire, accumulation_on_the_wire: bytes a hitpoint sent and a touched hitpoint
//   returned, and speed of their codecs
// * merge: touched hitpoints merged per second
// * slice: pixels of a slice of one and of four passes encoded, decoded and added to its sibling
//   per second, and bytes a pixel sent
//
// Run: build/release/bin/lucerna-bench --benchmark_repetitions=10
//      --benchmark_report_aggregates_only=true
#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "benchmark/benchmark.h"

#include "render/base/parallel.h"
#include "render/base/text.h"
#include "render/estimate/evidence.h"
#include "render/tracing/hitpoint_pass.h"
#include "render/transport/material_at.h"
#include "render/wire/accumulation_codec.h"
#include "render/wire/block_codec.h"
#include "render/wire/slice_codec.h"
#include "server/job_estimator.h"
#include "tests/support/gather_sums.h"
#include "tests/support/local_render.h"
#include "worker/batch_tracer.h"
#include "worker/gather.h"
#include "worker/photon_grid.h"
#include "worker/photon_path.h"

namespace lucerna {
namespace {

// Of an iteration of photon_paths; tests/bench/roofline.py reads it.
constexpr int kPathsAtOnce = 4096;

// Everything that the benchmarks of one scene share: one pass at 256 × 256 pixels.
struct Bench {
  explicit Bench(const std::string& path) : scene(LoadScene(path)) {
    RenderOverrides overrides;
    overrides.width = 256;
    overrides.height = 256;
    overrides.photons_per_pass = 1 << 20;
    overrides.initial_radius = 0;
    overrides.max_depth = 32;
    settings = SettingsFor(scene, overrides);
    needs = NeedsOf(scene, settings);
    intersector = Intersector::Create(scene, needs.rays()).value();
    lights = std::make_unique<LightSet>(scene, *intersector, needs.lights());
    estimator = JobEstimator::Create(scene, settings, needs, 1).value();
    eye = estimator->TraceEyePaths(0).value();
    radii = HitpointRadii(eye, estimator->PlanFor({0, 1}).value());
    for (std::size_t row = 0; row < radii.size(); ++row) {
      const Vec3 reach = {radii[row], radii[row], radii[row]};
      region.Add(eye.block.positions[row] - reach);
      region.Add(eye.block.positions[row] + reach);
    }
    photons = std::make_unique<PhotonPathTracer>(scene, *intersector, *lights, settings, needs,
                                                 nullptr, region);
    scale = FluxScale::ForPower(lights->TotalPower());
    features = std::make_unique<FeatureEdges>(scene);
  }

  Scene scene;
  RenderSettings settings;
  SceneNeeds needs;
  std::unique_ptr<Intersector> intersector;
  std::unique_ptr<LightSet> lights;
  std::unique_ptr<JobEstimator> estimator;
  EyePass eye;
  RadiusColumn radii;
  Bounds region;
  std::unique_ptr<PhotonPathTracer> photons;
  FluxScale scale;
  std::unique_ptr<FeatureEdges> features;
};

using Counter = benchmark::Counter;

void PhotonPaths(benchmark::State& state, const Bench& bench) {
  std::uint64_t index = 0;
  std::uint64_t deposits = 0;
  PhotonPathTracer::Landed landed;
  for (auto _ : state) {
    landed.deposits = {};
    for (int i = 0; i < kPathsAtOnce; ++i)
      bench.photons->Trace(0, index++, landed);
    deposits += landed.deposits.size();
  }
  const std::uint64_t rays = landed.rays;
  const auto paths = static_cast<double>(index);
  state.counters["photon_paths/s"] = Counter(paths, Counter::kIsRate);
  state.counters["rays/path"] = static_cast<double>(rays) / paths;
  state.counters["deposits/path"] = static_cast<double>(deposits) / paths;
}

// Rays like those of photon paths, intersection only.
void PhotonRays(benchmark::State& state, const Bench& bench) {
  std::vector<Ray> rays;
  std::uint64_t paths = 0;
  for (std::uint64_t index = 0; rays.size() < (1U << 18); ++index, ++paths) {
    KeyedRng rng(CombineKeys(7, index));
    Emission emission;
    if (!bench.lights->SampleEmission(rng.Uniform(), rng.Uniform(), rng.Uniform(), rng.Uniform(),
                                      rng.Uniform(), emission)) {
      continue;
    }
    Ray ray = emission.ray;
    Hit hit;
    for (int depth = 0; depth < 32; ++depth) {
      rays.push_back(ray);
      if (!bench.intersector->Intersect(ray, hit)) break;
      SurfacePoint surface = bench.intersector->SurfaceAt(ray, hit);
      std::optional<Material> storage;
      const Material& material = MaterialAt(bench.scene, surface, -ray.direction, storage);
      const Frame frame(surface.shading_normal);
      BsdfSample sample;
      if (!SampleBsdf(material, frame.ToLocal(-ray.direction), rng.Uniform(), rng.Uniform(),
                      rng.Uniform(), Carried::kFlux, sample) ||
          !(rng.Uniform() < MaxChannel(sample.weight))) {
        break;
      }
      const Vec3 wi = frame.ToWorld(sample.wi);
      ray = {LeavingPoint(surface, wi), wi, HUGE_VALF};
    }
  }
  std::size_t i = 0;
  std::uint64_t done = 0;
  for (auto _ : state) {
    Hit hit;
    for (int k = 0; k < 4096; ++k) {
      benchmark::DoNotOptimize(bench.intersector->Intersect(rays[i], hit));
      i = (i + 1) % rays.size();
    }
    done += 4096;
  }
  state.counters["rays/s"] = Counter(static_cast<double>(done), Counter::kIsRate);
  state.counters["paths_ceiling/s"] = Counter(
      static_cast<double>(done) * static_cast<double>(paths) / static_cast<double>(rays.size()),
      Counter::kIsRate);
}

void EyePaths(benchmark::State& state, const Bench& bench) {
  std::uint64_t pass = 1;
  std::uint64_t rays = 0;
  for (auto _ : state)
    rays += bench.estimator->TraceEyePaths(pass++).value().rays;
  const double paths = static_cast<double>(pass - 1) * 65536;
  state.counters["eye_paths/s"] = Counter(paths, Counter::kIsRate);
  state.counters["rays/path"] = static_cast<double>(rays) / paths;
}

std::vector<Deposits> TraceDeposits(const Bench& bench, std::uint64_t photons) {
  std::vector<Deposits> deposits;
  PhotonPathTracer::Landed landed;
  for (std::uint64_t index = 0; index < photons; ++index) {
    bench.photons->Trace(0, index, landed);
    if (index % 2048 == 2047 || index + 1 == photons) {
      deposits.push_back(std::exchange(landed.deposits, {}));
    }
  }
  return deposits;
}

Accumulation GatherOnce(const Bench& bench, const std::vector<Deposits>& deposits, ThreadTeam& team,
                        bool cuts = true) {
  RadiusColumn sorted = bench.radii;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                   sorted.end());
  const PhotonGrid grid(deposits, bench.region, 2 * sorted[sorted.size() / 2], team);
  GatheredPhotons photons{.grid = grid};
  if (cuts) photons.features = bench.features.get();
  return GatherSums(bench.eye.block, bench.radii, photons, bench.scene.materials,
                    Kernel{bench.settings.kernel}, bench.scale, team);
}

void GatherPairs(benchmark::State& state, const Bench& bench, bool cuts) {
  const auto deposits = TraceDeposits(bench, static_cast<std::uint64_t>(state.range(0)));
  ThreadTeam team(1);
  std::uint64_t pairs = 0;
  std::uint64_t landed = 0;
  for (auto _ : state) {
    pairs += GatherOnce(bench, deposits, team, cuts).tally.pairs;
    for (const auto& chunk : deposits)
      landed += chunk.size();
  }
  state.counters["s/pair"] =
      Counter(static_cast<double>(pairs), Counter::kIsRate | Counter::kInvert);
  state.counters["s/deposit"] =
      Counter(static_cast<double>(landed), Counter::kIsRate | Counter::kInvert);
  state.counters["pairs/hitpoint"] = static_cast<double>(pairs) /
                                     static_cast<double>(state.iterations()) /
                                     static_cast<double>(bench.eye.block.size());
  state.counters["s/hitpoint"] =
      Counter(static_cast<double>(state.iterations()) * static_cast<double>(bench.eye.block.size()),
              Counter::kIsRate | Counter::kInvert);
}

void FindFeatures(benchmark::State& state, const Bench& bench) {
  for (auto _ : state)
    benchmark::DoNotOptimize(FeatureEdges(bench.scene).segments().size());
  state.counters["segments"] = static_cast<double>(bench.features->segments().size());
  state.counters["triangles"] = static_cast<double>(bench.scene.TriangleCount());
}

// A batch as a worker runs it, up to its answer's bytes. The radii are those of the first pass for
// every controller, so all find the same pairs and differ by what their evidence costs.
void Batch(benchmark::State& state, const Bench& bench, RadiusControllerKind controller) {
  constexpr std::uint64_t kPhotons = 1 << 16;
  RenderSettings settings = bench.settings;
  settings.radius_controller = controller;
  BatchTracer tracer(bench.scene, 1);
  const SceneNeeds needs = NeedsOf(bench.scene, settings);
  const std::atomic<bool> stop = false;
  // As many passes as it takes for evidence to come round.
  const std::uint64_t passes = UsesFrequency(controller) ? kFrequencyPeriod : 1;
  std::uint64_t photons = 0;
  std::size_t size_bytes = 0;
  for (auto _ : state) {
    for (std::uint64_t pass = 0; pass < passes; ++pass) {
      const Accumulation sums =
          tracer.Run(settings, needs, pass, 0, kPhotons, bench.eye.block, bench.radii, stop)
              .value();
      size_bytes += EncodeAccumulation(sums, bench.eye.block.size()).size();
      photons += kPhotons;
    }
  }
  const auto all = static_cast<double>(photons);
  state.counters["photons/s"] = Counter(all, Counter::kIsRate);
  state.counters["bytes/photon"] = static_cast<double>(size_bytes) / all;
}

void BlockOnTheWire(benchmark::State& state, const Bench& bench) {
  std::size_t size_bytes = 0;
  for (auto _ : state) {
    size_bytes = EncodeHitpointBlock(bench.eye.block).size() + EncodeRadii(bench.radii).size();
  }
  const auto rows = static_cast<double>(bench.eye.block.size());
  state.counters["bytes/hitpoint"] = static_cast<double>(size_bytes) / rows;
  state.counters["hitpoints/s"] =
      Counter(rows * static_cast<double>(state.iterations()), Counter::kIsRate);
}

void AccumulationOnTheWire(benchmark::State& state, const Bench& bench) {
  ThreadTeam team(1);
  const Accumulation accumulation =
      GatherOnce(bench, TraceDeposits(bench, static_cast<std::uint64_t>(state.range(0))), team);
  std::size_t size_bytes = 0;
  for (auto _ : state) {
    const std::string bytes = EncodeAccumulation(accumulation, bench.eye.block.size());
    size_bytes = bytes.size();
    benchmark::DoNotOptimize(DecodeAccumulation(bytes, bench.eye.block.size()));
  }
  const auto rows = static_cast<double>(accumulation.size());
  state.counters["bytes/touched"] = static_cast<double>(size_bytes) / rows;
  state.counters["touched"] = rows;
  state.counters["touched/s"] =
      Counter(rows * static_cast<double>(state.iterations()), Counter::kIsRate);
}

void Merge(benchmark::State& state, const Bench& bench) {
  ThreadTeam team(1);
  const Accumulation accumulation = GatherOnce(bench, TraceDeposits(bench, 1 << 16), team);
  // A pass is returned in a few batches: sums of more would be larger than any are.
  constexpr int kBatches = 8;
  std::optional<PassSums> sums;
  int batches = 0;
  for (auto _ : state) {
    if (batches++ % kBatches == 0) {
      state.PauseTiming();
      sums.emplace(bench.eye.block.size(), kCommonColumns);
      state.ResumeTiming();
    }
    if (!sums->Add(accumulation).ok()) state.SkipWithError("overflow");
  }
  state.counters["touched/s"] =
      Counter(static_cast<double>(accumulation.size()) * static_cast<double>(state.iterations()),
              Counter::kIsRate);
}

// The slice of the job's passes from `first` on, and of as many behind it.
struct Siblings {
  Siblings(const Bench& bench, std::uint64_t passes) {
    BatchTracer tracer(bench.scene, 2);
    const std::atomic<bool> stop = false;
    RoundPlan plan = bench.estimator->PlanFor({0, 1}).value();
    plan.photons_per_pass = bench.eye.direct.size();
    const std::uint64_t first = kFeaturePasses;
    const auto trace = [&](const PassRange& range) {
      return tracer.RunSlice(bench.settings, bench.needs, range, plan, stop).value();
    };
    one = trace({first, first + passes});
    other = trace({first + passes, first + 2 * passes});
    shape = {.passes = one.passes,
             .pixels = one.pixels(),
             .evidence = one.evidence,
             .photons_per_pass = plan.photons_per_pass};
  }
  SliceSums one, other;
  SliceShape shape;
};

void CountPixels(benchmark::State& state, const Siblings& slices) {
  state.counters["pixels/s"] =
      Counter(static_cast<double>(slices.one.pixels()) * static_cast<double>(state.iterations()),
              Counter::kIsRate);
}

void EncodeOfSlice(benchmark::State& state, const Bench& bench) {
  const Siblings slices(bench, static_cast<std::uint64_t>(state.range(0)));
  std::size_t size_bytes = 0;
  for (auto _ : state)
    size_bytes = EncodeSlice(slices.one).size();
  CountPixels(state, slices);
  state.counters["bytes/pixel"] =
      static_cast<double>(size_bytes) / static_cast<double>(slices.one.pixels());
}

void DecodeOfSlice(benchmark::State& state, const Bench& bench) {
  const Siblings slices(bench, static_cast<std::uint64_t>(state.range(0)));
  const std::string bytes = EncodeSlice(slices.one);
  for (auto _ : state)
    benchmark::DoNotOptimize(DecodeSlice(bytes, slices.shape));
  CountPixels(state, slices);
}

void MergeOfSlices(benchmark::State& state, const Bench& bench) {
  const Siblings slices(bench, static_cast<std::uint64_t>(state.range(0)));
  for (auto _ : state) {
    state.PauseTiming();
    SliceSums sum = slices.one;
    state.ResumeTiming();
    if (!MergeSibling(sum, slices.other).ok()) state.SkipWithError("no siblings");
  }
  CountPixels(state, slices);
}

void Register(const std::string& name, const std::string& path) {
  // Lives as long as the benchmarks that refer to it.
  const auto* bench = new Bench(path);
  const auto add = [&](const char* what, auto function) {
    return benchmark::RegisterBenchmark(
        (std::string(what) + "/" + name).c_str(),
        [bench, function](benchmark::State& state) { function(state, *bench); });
  };
  add("photon_paths", PhotonPaths)->Unit(benchmark::kMillisecond);
  add("photon_rays", PhotonRays)->Unit(benchmark::kMillisecond);
  add("eye_paths", EyePaths)->Unit(benchmark::kMillisecond);
  for (const bool cuts : {true, false}) {
    add(cuts ? "gather" : "gather_whole_discs",
        [cuts](benchmark::State& s, const Bench& b) { GatherPairs(s, b, cuts); })
        ->Arg(1)
        ->Arg(1 << 16)
        ->Arg(1 << 18)
        ->Unit(benchmark::kMillisecond);
  }
  add("feature_edges", FindFeatures)->Unit(benchmark::kMillisecond);
  for (const auto controller : {RadiusControllerKind::kPpm, RadiusControllerKind::kFrequencyMse,
                                RadiusControllerKind::kAppm, RadiusControllerKind::kCppm}) {
    add(Concat("batch/", NameOf(controller)).c_str(), [controller](benchmark::State& s,
                                                                   const Bench& b) {
      Batch(s, b, controller);
    })->Unit(benchmark::kMillisecond);
  }
  add("block_on_the_wire", BlockOnTheWire)->Unit(benchmark::kMillisecond);
  add("accumulation_on_the_wire", AccumulationOnTheWire)
      ->Arg(1 << 16)
      ->Arg(1 << 20)
      ->Unit(benchmark::kMillisecond);
  add("merge", Merge)->Unit(benchmark::kMillisecond);
  add("slice/encode", EncodeOfSlice)->Arg(1)->Arg(4)->Unit(benchmark::kMillisecond);
  add("slice/decode", DecodeOfSlice)->Arg(1)->Arg(4)->Unit(benchmark::kMillisecond);
  add("slice/merge", MergeOfSlices)->Arg(1)->Arg(4)->Unit(benchmark::kMillisecond);
}

}  // namespace
}  // namespace lucerna

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  for (int i = 1; i < argc; ++i)
    lucerna::Register(std::filesystem::path(argv[i]).parent_path().filename().string(), argv[i]);
  if (argc > 1) {
    benchmark::RunSpecifiedBenchmarks();
    return 0;
  }
  lucerna::Register("glass-box", "glass-box.pbrt");
  const std::string outside = std::string(LUCERNA_SOURCE_DIR) + "/../shared/scenes/";
  for (const char* name : {"cornell-box", "water-caustic", "veach-bidir", "sphere-box"}) {
    for (const char* file : {"scene-v4.pbrt", "scene.pbrt"}) {
      const std::string path =
          std::filesystem::weakly_canonical(outside + name + "/" + file).string();
      if (std::filesystem::exists(path)) lucerna::Register(name, path);
    }
  }
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
