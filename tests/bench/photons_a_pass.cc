// How many photons a pass give the least error for the time, and how many does the job choose?
//
// Renders a scene with several fixed numbers of photons a pixel and pass, and with the number that
// the job chooses, all in one process. The renders take turns, the one that has used the least
// processor time next, so that a machine that others use as well slows all of them alike. Errors
// are read when a render has used so much processor time for each pixel.
//
// Run: build/release/bin/lucerna-photons-check SCENE REFERENCE.exr
//          [WIDTHxHEIGHT [SEED [US_PER_PIXEL [NUMBERS]]]]
// NUMBERS are digits, 0 for the job's choice: 12480 by default. With "-" for a reference one is
// rendered first, with another seed, for eight times as long.
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "render/base/clock.h"
#include "render/base/files.h"
#include "render/estimate/evidence.h"
#include "render/estimate/photon_steps.h"
#include "render/estimate/slice_tree.h"
#include "render/math/kernel.h"
#include "tests/support/local_render.h"

namespace lucerna {
namespace {

// Processor time for each pixel at which errors are read [µs].
constexpr std::array<double, 6> kTimes = {8, 16, 32, 64, 128, 256};
const std::atomic<bool> kNeverStop = false;

class TimedRender {
 public:
  TimedRender(const Scene& scene, const RenderSettings& settings, std::string name)
      : name_(std::move(name)),
        settings_(settings),
        needs_(NeedsOf(scene, settings)),
        estimator_(*JobEstimator::Create(scene, settings, needs_, 1)),
        tracer_(scene, 1),
        pixels_(static_cast<std::size_t>(settings.crop_width()) *
                static_cast<std::size_t>(settings.crop_height())) {}

  void AddPass() {
    const Duration start = ProcessCpuTime();
    const PassRange round = RoundOf(pass_);
    if (pass_ == round.first) {
      plan_ = estimator_->PlanFor(round);
      round_.emplace(round);
    }
    SliceSums slice = *tracer_.RunSlice(settings_, needs_, {pass_, pass_ + 1}, *plan_, kNeverStop);
    const Duration traced = ProcessCpuTime();
    trace_s_ += Seconds(traced - start);
    if (pass_ < kFirstLongRound) {
      variance_.Discount(sums_.WeighBy(plan_->photons_per_pass));
      variance_.Add(slice, sums_);
      sums_.Add(slice, estimator_->team());
      if (pass_ > 0 && std::has_single_bit(pass_ + 1)) PrintSplit();
    }
    eye_rays_ += slice.eye_rays;
    tally_ += slice.tally;
    steps_.push_back(plan_->photons_per_pass);
    // What is printed is not part of the render.
    const Duration summed = ProcessCpuTime();
    LUCERNA_CHECK(round_->Add(std::move(slice)).ok());
    ++pass_;
    if (round_->IsWhole()) {
      estimator_->AddRound(round_->Whole(), *plan_);
    } else {
      estimator_->SetTail(round_->Prefix(), *plan_);
    }
    time_s_ += Seconds(traced - start) + Seconds(ProcessCpuTime() - summed);
  }

  // What the job sees of its first passes, with controller and kernel of the defaults.
  void PrintSplit() const {
    const float reach = ReachOf(EvidenceOf(settings_.radius_controller));
    const double kernel_noise = std::numbers::pi * Kernel{settings_.kernel}.Moments().roughness *
                                static_cast<double>(reach * reach);
    const PassVariance::Parts parts = variance_.Split(sums_, kernel_noise);
    std::printf("  split %s passes %llu: photons %.5f eye paths %.5f best number %.2f\n",
                name_.c_str(), static_cast<unsigned long long>(sums_.passes()), parts.photons,
                parts.eye_paths,
                variance_.BestPhotons(sums_, kernel_noise) / static_cast<double>(pixels_));
  }
  void PrintCosts() const {
    const double paths = static_cast<double>(pixels_) * static_cast<double>(pass_);
    std::printf(
        "  cost %s passes %llu us a pixel and pass %.4f traced %.4f; a pixel and pass: eye rays "
        "%.3f photons %.3f rays %.3f deposits %.3f pairs %.3f steps",
        name_.c_str(), static_cast<unsigned long long>(pass_), 1e6 * time_s_ / paths,
        1e6 * trace_s_ / paths, static_cast<double>(eye_rays_) / paths,
        static_cast<double>(tally_.photons) / paths, static_cast<double>(tally_.rays) / paths,
        static_cast<double>(tally_.deposits) / paths, static_cast<double>(tally_.pairs) / paths);
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      if (i == 0 || steps_[i] != steps_[i - 1])
        std::printf(" %zu:%.3g", i, static_cast<double>(steps_[i]) / static_cast<double>(pixels_));
    }
    std::printf("\n");
  }

  [[nodiscard]] double time_s() const { return time_s_; }
  [[nodiscard]] std::uint64_t passes() const { return pass_; }
  [[nodiscard]] std::size_t pixels() const { return pixels_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const JobEstimator& estimator() const { return *estimator_; }

 private:
  std::string name_;
  RenderSettings settings_;
  SceneNeeds needs_;
  std::unique_ptr<JobEstimator> estimator_;
  BatchTracer tracer_;
  std::size_t pixels_;
  ImageSums sums_{pixels_};  // of the first rounds
  PassVariance variance_{pixels_};
  std::uint64_t pass_ = 0;
  std::optional<RoundPlan> plan_;
  std::optional<SliceTree> round_;
  double time_s_ = 0, trace_s_ = 0;
  std::uint64_t eye_rays_ = 0;
  BatchTally tally_;
  std::vector<std::uint64_t> steps_;
};

RenderSettings SettingsOf(const Scene& scene, int width, int height, std::uint64_t seed,
                          int photons) {
  RenderOverrides overrides;
  overrides.width = width;
  overrides.height = height;
  overrides.seed = seed;
  overrides.initial_radius = 0;
  overrides.photons_per_pass = std::int64_t{width} * height * std::max(1, photons);
  overrides.adaptive_photons = photons == 0;
  return SettingsFor(scene, overrides);
}

int Main(int argc, char** argv) {
  LUCERNA_CHECK(argc >= 3);
  const Scene scene = LoadScene(argv[1]);
  int width = 256, height = 256;
  if (argc > 3) std::sscanf(argv[3], "%dx%d", &width, &height);
  const std::uint64_t seed = argc > 4 ? std::strtoull(argv[4], nullptr, 10) : 1;
  const double longest = argc > 5 ? std::strtod(argv[5], nullptr) : 128;
  std::vector<int> numbers = {1, 2, 4, 8, 0};
  if (argc > 6) {
    numbers.clear();
    for (const char* c = argv[6]; *c != 0; ++c)
      numbers.push_back(*c - '0');
  }
  std::printf("%s\n", argv[1]);
  ReferenceImage reference;
  if (std::string(argv[2]) == "-") {
    TimedRender render(scene, SettingsOf(scene, width, height, 777, 4), "reference");
    while (render.time_s() < 8 * longest * 1e-6 * static_cast<double>(render.pixels()))
      render.AddPass();
    const Image image = render.estimator().MakeImage();
    for (std::size_t i = 0; i < render.pixels(); ++i)
      reference.push_back(
          {image.Find("R")->pixels[i], image.Find("G")->pixels[i], image.Find("B")->pixels[i]});
  } else {
    const auto bytes = ReadFile(argv[2]);
    LUCERNA_CHECK(bytes.ok());
    auto read = ReadReference(*bytes, SettingsOf(scene, width, height, seed, 1));
    if (!read.ok()) std::fprintf(stderr, "%s\n", std::string(read.status().message()).c_str());
    reference = *std::move(read);
  }
  struct Entry {
    std::unique_ptr<TimedRender> render;
    std::vector<TrueError> errors = {};
    std::vector<std::uint64_t> passes = {};
    TrueError before = {};
    double before_us = 0;
  };
  std::vector<Entry> entries;
  for (const int photons : numbers) {
    entries.push_back({.render = std::make_unique<TimedRender>(
                           scene, SettingsOf(scene, width, height, seed, photons),
                           photons == 0 ? "chosen" : std::to_string(photons))});
  }
  for (;;) {
    Entry& entry =
        *std::ranges::min_element(entries, {}, [](const Entry& e) { return e.render->time_s(); });
    TimedRender& render = *entry.render;
    const double us = 1e6 * render.time_s() / static_cast<double>(render.pixels());
    if (us >= longest) break;
    render.AddPass();
    const double after = 1e6 * render.time_s() / static_cast<double>(render.pixels());
    // Between two passes errors follow a power of the time.
    if (after >= kTimes[entry.errors.size()]) {
      const TrueError now = JobEstimator::ErrorAgainst(reference, render.estimator().Snapshot());
      while (entry.errors.size() < kTimes.size() && after >= kTimes[entry.errors.size()]) {
        const double t = kTimes[entry.errors.size()];
        const double share = entry.before_us > 0
                                 ? std::log(t / entry.before_us) / std::log(after / entry.before_us)
                                 : 1;
        const auto between = [&](double a, double b) {
          return entry.before_us > 0 ? std::exp(std::log(a) * (1 - share) + std::log(b) * share)
                                     : b;
        };
        entry.errors.push_back({.relative = between(entry.before.relative, now.relative),
                                .absolute = between(entry.before.absolute, now.absolute),
                                .untrimmed = between(entry.before.untrimmed, now.untrimmed)});
        entry.passes.push_back(render.passes());
      }
      entry.before_us = 0;
    }
    if (entry.errors.size() < kTimes.size() && after >= 0.6 * kTimes[entry.errors.size()]) {
      entry.before = JobEstimator::ErrorAgainst(reference, render.estimator().Snapshot());
      entry.before_us = after;
    }
  }
  for (const Entry& entry : entries)
    entry.render->PrintCosts();
  for (Entry& entry : entries) {
    std::printf("  error %s:", entry.render->name().c_str());
    for (std::size_t i = 0; i < entry.errors.size(); ++i)
      std::printf(" %g:%llu:%.3e:%.3e", kTimes[i], static_cast<unsigned long long>(entry.passes[i]),
                  entry.errors[i].relative, entry.errors[i].untrimmed);
    std::printf("\n");
  }
  std::fflush(stdout);
  return 0;
}

}  // namespace
}  // namespace lucerna

int main(int argc, char** argv) {
  return lucerna::Main(argc, argv);
}
