#include "tests/support/error_study.h"

#include <algorithm>
#include <cmath>

#include "render/estimate/error_estimate.h"
#include "render/film/image_metrics.h"
#include "tests/support/local_render.h"

namespace lucerna {
namespace {

RenderSettings SettingsOf(const Scene& scene, int side, std::uint64_t seed) {
  RenderOverrides overrides;
  overrides.width = side;
  overrides.height = side;
  overrides.photons_per_pass = side * side;
  overrides.initial_radius = 0;
  overrides.max_depth = 12;
  overrides.seed = seed;
  return SettingsFor(scene, overrides);
}

// After how many passes a render's true error is at `square` or below for good, between looks by
// the power law through them.
double PassesNeeded(const std::vector<StudiedLook>& looks, double square) {
  std::size_t last = looks.size();
  while (last > 0 && looks[last - 1].truth <= square)
    --last;
  if (last == 0) return looks.front().passes;
  if (last == looks.size()) return HUGE_VAL;
  const StudiedLook& above = looks[last - 1];
  const StudiedLook& below = looks[last];
  const double share = std::log(above.truth / square) / std::log(above.truth / below.truth);
  return above.passes * std::pow(static_cast<double>(below.passes) / above.passes, share);
}

}  // namespace

int ErrorStudy::Covered() const {
  return static_cast<int>(std::ranges::count_if(renders, [](const auto& looks) {
    return std::ranges::all_of(looks, [](const StudiedLook& look) {
      return look.truth >= look.low && look.truth <= look.high;
    });
  }));
}

std::vector<double> ErrorStudy::Ratios() const {
  std::vector<double> ratios;
  for (std::size_t look = 0; look < renders.front().size(); ++look) {
    double estimate = 0;
    double truth = 0;
    for (const std::vector<StudiedLook>& looks : renders) {
      estimate += looks[look].estimate;
      truth += looks[look].truth;
    }
    ratios.push_back(std::sqrt(estimate / truth));
  }
  return ratios;
}

StopOutcome StopAt(const ErrorStudy& study, double target) {
  StopOutcome outcome{.target = target};
  const double square = target * target;
  for (const std::vector<StudiedLook>& looks : study.renders) {
    const auto stop =
        std::ranges::find_if(looks, [&](const StudiedLook& look) { return look.high <= square; });
    if (stop == looks.end()) continue;
    ++outcome.stopped;
    if (stop->truth > square) continue;
    ++outcome.kept;
    const double spent = stop->passes / PassesNeeded(looks, square);
    outcome.mean_spent += spent;
    if (spent <= 2) ++outcome.within_two;
  }
  if (outcome.kept > 0) outcome.mean_spent /= outcome.kept;
  return outcome;
}

ErrorStudy StudyErrors(const Scene& scene, const Image& reference, const StudySize& size) {
  ErrorStudy study;
  for (int i = 0; i < size.renders; ++i) {
    LocalRender render(scene, SettingsOf(scene, size.side, 1000 + static_cast<std::uint64_t>(i)));
    std::vector<StudiedLook>& looks = study.renders.emplace_back();
    std::int64_t next = kFirstLook;
    for (int pass = 1; pass <= size.passes; ++pass) {
      render.AddPass();
      if (pass != next && pass != size.passes) continue;
      next = NextLook(pass);
      const SquaredError e = render.EstimateError(static_cast<int>(looks.size()) + 1).relative;
      const double truth =
          Compare(render.MakeImage(), reference, {.trim_share = kTrimmedShare}).value().rel_mse;
      looks.push_back({pass, truth, e.total(), e.low, e.high});
    }
  }
  return study;
}

Image StudyReference(const Scene& scene, int side) {
  RenderSettings settings = SettingsOf(scene, side, 12345);
  settings.radius_controller = RadiusControllerKind::kPppm;
  settings.alpha = 0.2;
  settings.photons_per_pass = 64 * side * side;
  LocalRender render(scene, settings);
  for (int pass = 0; pass < 150; ++pass)
    render.AddPass();
  return render.MakeImage();
}

}  // namespace lucerna
