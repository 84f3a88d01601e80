#include "tests/support/error_study.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "render/estimate/error_estimate.h"
#include "render/film/image_metrics.h"
#include "render/film/reference.h"
#include "tests/support/local_render.h"

namespace lucerna {
namespace {

RenderSettings SettingsOf(const Scene& scene, int side, std::uint64_t seed,
                          int photons_per_pixel = 1) {
  RenderOverrides overrides;
  overrides.width = side;
  overrides.height = side;
  overrides.photons_per_pass = photons_per_pixel * side * side;
  overrides.initial_radius = 0;
  overrides.max_depth = 12;
  overrides.seed = seed;
  return SettingsFor(scene, overrides);
}

// After how many passes a render's true error is at `square` or below for good, between estimates
// by the power law through them.
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

// Parts the true error of many renders: what differs between them is noise, the rest bias.
class PartsOfError {
 public:
  explicit PartsOfError(const Image& reference)
      : reference_(reference),
        sum_(3 * reference.channels[0].pixels.size()),
        square_sum_(sum_.size()),
        bias_sum_(sum_.size() / 3),
        bias_square_sum_(bias_sum_.size()),
        floor_(Compare(reference, reference).value().floor) {}

  void Add(const Image& image, const SquaredError& estimate) {
    ForEachValue(image, [&](std::size_t i, double value) {
      sum_[i] += value;
      square_sum_[i] += value * value;
    });
    const std::vector<float>& bias = image.Find("bias")->pixels;
    for (std::size_t i = 0; i < bias.size(); ++i) {
      const auto value = static_cast<double>(bias[i]);
      bias_sum_[i] += value;
      bias_square_sum_[i] += value * value;
    }
    estimated_.estimated_noise += estimate.noise;
    estimated_.estimated_bias += estimate.bias;
    ++renders_;
  }

  [[nodiscard]] StudiedParts Mean() const {
    StudiedParts parts = estimated_;
    const double n = renders_;
    parts.estimated_noise /= n;
    parts.estimated_bias /= n;
    if (renders_ < 2) return parts;
    ForEachValue(reference_, [&](std::size_t i, double right) {
      const double mean = sum_[i] / n;
      const double noise = (square_sum_[i] / n - mean * mean) * n / (n - 1);
      const double own_noise = NoiseOfReference(i);
      const double bias = (mean - right) * (mean - right) - noise / n - own_noise * own_noise;
      const double weight = 1 / (right * right + floor_);
      parts.true_noise += weight * noise / static_cast<double>(sum_.size());
      parts.true_bias += weight * bias / static_cast<double>(sum_.size());
    });
    AddKernelBias(parts);
    return parts;
  }

 private:
  template <typename F>
  static void ForEachValue(const Image& image, const F& f) {
    constexpr std::array<const char*, 3> kColour = {"R", "G", "B"};
    std::size_t i = 0;
    for (const char* name : kColour) {
      for (const float value : image.Find(name)->pixels)
        f(i++, static_cast<double>(value));
    }
  }

  [[nodiscard]] double NoiseOfReference(std::size_t i) const {
    if (!TellsItsNoise(reference_)) return 0;
    const std::size_t pixels = sum_.size() / 3;
    return static_cast<double>(reference_.Find(kNoiseLayer[i / pixels])->pixels[i % pixels]);
  }

  void AddKernelBias(StudiedParts& parts) const {
    const double n = renders_;
    const std::size_t pixels = bias_sum_.size();
    const auto luminance = [&](const auto& at) { return LuminanceOf({at(0), at(1), at(2)}); };
    for (std::size_t i = 0; i < pixels; ++i) {
      const double right = luminance([&](std::size_t c) { return ReferenceValue(c * pixels + i); });
      const double mean = luminance([&](std::size_t c) { return sum_[c * pixels + i] / n; });
      const double weight = 1 / (right * right + floor_) / static_cast<double>(pixels);
      // Noise of colours that is alike in all channels.
      const double noise = luminance([&](std::size_t c) {
        const double m = sum_[c * pixels + i] / n;
        return std::sqrt(std::max(0.0, square_sum_[c * pixels + i] / n - m * m) / (n - 1));
      });
      const double own_noise =
          luminance([&](std::size_t c) { return NoiseOfReference(c * pixels + i); });
      parts.true_luminance_bias +=
          weight * ((mean - right) * (mean - right) - noise * noise - own_noise * own_noise);
      const double kernel = bias_sum_[i] / n;
      parts.kernel_bias +=
          weight * (kernel * kernel - (bias_square_sum_[i] / n - kernel * kernel) / (n - 1));
    }
  }

  [[nodiscard]] double ReferenceValue(std::size_t i) const {
    constexpr std::array<const char*, 3> kColour = {"R", "G", "B"};
    const std::size_t pixels = bias_sum_.size();
    return static_cast<double>(reference_.Find(kColour[i / pixels])->pixels[i % pixels]);
  }

  const Image& reference_;
  std::vector<double> sum_, square_sum_;
  std::vector<double> bias_sum_, bias_square_sum_;  // of the layer
  double floor_;                                    // of relative errors
  StudiedParts estimated_;
  int renders_ = 0;
};

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
  PartsOfError parts(reference);
  for (int i = 0; i < size.renders; ++i) {
    LocalRender render(scene,
                       SettingsOf(scene, size.side, size.first_seed + static_cast<std::uint64_t>(i),
                                  size.photons_per_pixel));
    std::vector<StudiedLook>& looks = study.renders.emplace_back();
    std::int64_t next = kFirstCheckpoint;
    for (int pass = 1; pass <= size.passes; ++pass) {
      render.AddPass();
      if (pass != next && pass != size.passes) continue;
      // As often as near a target: the more estimates there are, the harder for all to hold.
      next = NextCheckpoint(pass, true);
      const SquaredError e = render.EstimateError(static_cast<int>(looks.size()) + 1).relative;
      const Image image = render.MakeImage();
      const ImageMetrics metrics = Compare(image, reference, {.trim_share = kTrimmedShare}).value();
      const double truth = metrics.rel_mse - metrics.reference_rel_mse.value_or(0);
      looks.push_back({pass, truth, e.total(), e.low, e.high});
      if (pass == size.passes) parts.Add(image, e);
    }
  }
  study.parts = parts.Mean();
  return study;
}

Image HalvedReference(const Scene& scene, int side, int passes, int photons_per_pixel) {
  std::array<Image, 2> halves;
  for (std::size_t half = 0; half < halves.size(); ++half) {
    RenderSettings settings = SettingsOf(scene, side, 90001 + half, photons_per_pixel);
    settings.radius_controller = RadiusControllerKind::kPppm;
    settings.initial_footprints = 1;
    LocalRender render(scene, settings);
    for (int pass = 0; pass < passes; ++pass)
      render.AddPass();
    halves[half] = render.MakeImage();
  }
  return MakeReference(halves[0], halves[1]).value();
}

}  // namespace lucerna
