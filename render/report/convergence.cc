#include "render/report/convergence.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"

#include "render/bake/bake_rounds.h"
#include "render/base/text.h"
#include "render/estimate/missing_light.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

constexpr int kFewestFitted = 3;
// From a curve this flat no end can be predicted.
constexpr double kFlattest = -0.05;

// "350", "12000": two digits, as no trend has more.
std::string Rounded(double number) {
  const double unit = std::pow(10, std::max(0.0, std::floor(std::log10(number)) - 1));
  return absl::StrFormat("%.0f", std::round(number / unit) * unit);
}

// An estimate of a square can come out a little below zero.
double Root(double squared) {
  return std::sqrt(std::max(0.0, squared));
}

// Of an ErrorSample or a DenoisedError.
template <typename Message>
RelativeError RootsOf(const Message& message) {
  const v1::SquaredError& squared = message.relative();
  RelativeError error = {.value = Root(squared.noise() + squared.bias()),
                         .low = Root(squared.low()),
                         .high = Root(squared.high()),
                         .noise = Root(squared.noise()),
                         .bias = Root(squared.bias()),
                         .untrimmed = Root(message.relative_untrimmed())};
  if (message.has_true_relative()) error.truth = Root(message.true_relative());
  if (message.has_true_relative_untrimmed()) {
    error.true_untrimmed = Root(message.true_relative_untrimmed());
  }
  return error;
}

std::vector<ChartPoint> LaterHalf(const v1::Job& job, ErrorAgainst against,
                                  double (*value)(const v1::SquaredError&)) {
  std::vector<ChartPoint> points;
  for (int i = FirstFitted(job); i < job.convergence_size(); ++i) {
    const v1::ErrorSample& sample = job.convergence(i);
    points.push_back({Abscissa(sample, against), value(sample.relative())});
  }
  return points;
}

}  // namespace

RelativeError ErrorOf(const v1::ErrorSample& sample) {
  return RootsOf(sample);
}

std::optional<RelativeError> NewestError(const v1::Job& job) {
  if (job.convergence().empty() || FoundNothing(job)) return std::nullopt;
  return ErrorOf(*job.convergence().rbegin());
}

std::optional<RelativeError> DenoisedErrorOf(const v1::Job& job) {
  if (job.convergence().empty() || FoundNothing(job)) return std::nullopt;
  const v1::ErrorSample& newest = *job.convergence().rbegin();
  if (!newest.has_denoised()) return std::nullopt;
  return RootsOf(newest.denoised());
}

bool FoundNothing(const v1::Job& job) {
  return !job.convergence().empty() && job.convergence().rbegin()->nothing_found();
}

std::string MissingLightSentence(const v1::Job& job) {
  if (job.convergence().empty()) return {};
  // The points of other rounds of a bake are few, or on dark sides too: what they lack says nothing
  // of the mesh. Once there is one, the sample is that of this round.
  const int rounds = job.bake().rounds_size();
  if (rounds > 0 && job.bake().surfaces().empty() &&
      job.bake().rounds(rounds - 1).name() != kEvenRoundName) {
    return {};
  }
  const v1::ErrorSample& newest = *job.convergence().rbegin();
  const double target = SettingsOf(job).error;
  const bool matters = FoundNothing(job) ||
                       newest.missing_relative() > 0.01 * newest.relative().high() ||
                       (target > 0 && newest.missing_relative() > 0.25 * target * target);
  if (!matters) return {};
  std::vector<const v1::LightFinding*> lights;
  for (const v1::LightFinding& light : job.lights()) {
    if (light.missing_share() > 0) lights.push_back(&light);
  }
  std::stable_sort(lights.begin(), lights.end(), [](const auto* a, const auto* b) {
    return a->missing_share() > b->missing_share();
  });
  if (lights.empty()) return {};
  constexpr std::size_t kNamed = 2;
  std::string text;
  for (std::size_t i = 0; i < std::min(lights.size(), kNamed); ++i) {
    const v1::LightFinding& light = *lights[i];
    const std::uint64_t fewer = std::min(light.in_view_caustic(), light.in_view_other());
    const std::uint64_t more = std::max(light.in_view_caustic(), light.in_view_other());
    // Where enough came one way, it is the other that is not known.
    const bool is_one_way = more >= kEnoughPhotons;
    const std::uint64_t in_view = is_one_way ? fewer : more;
    absl::StrAppend(&text, i > 0 ? "; " : "", light.name(), ": ",
                    in_view == 0 ? std::string("no photon") : Concat("only ", in_view), " of ",
                    light.photons_sent(), in_view == 0 ? " has" : " photons have",
                    " reached the view");
    if (is_one_way) {
      absl::StrAppend(&text, light.in_view_caustic() == fewer
                                 ? " through smooth surfaces alone"
                                 : " by other ways than smooth surfaces alone");
    }
    if (!FoundNothing(job)) {
      absl::StrAppend(&text, ", light worth up to ", ShortPercent(light.missing_share()),
                      " of the image may be missing");
    }
  }
  if (lights.size() > kNamed) {
    absl::StrAppend(&text, "; and ", lights.size() - kNamed, " more lights");
  }
  return text;
}

std::optional<PowerLaw> FitPowerLaw(const std::vector<ChartPoint>& points) {
  std::vector<PowerLawPoint> fitted;
  for (const ChartPoint& point : points) {
    if (!(point.x > 0 && point.y > 0) || !std::isfinite(point.x) || !std::isfinite(point.y)) {
      continue;
    }
    fitted.push_back({point.x, point.y});
  }
  if (fitted.size() < kFewestFitted) return std::nullopt;
  return PowerLawThrough(fitted);
}

double Abscissa(const v1::ErrorSample& sample, ErrorAgainst against) {
  return against == ErrorAgainst::kTime ? Seconds(FromProto(sample.running()))
                                        : static_cast<double>(sample.photons());
}

int FirstFitted(const v1::Job& job) {
  const int count = job.convergence_size();
  return std::max(0, count - std::max(kFewestFitted, (count + 1) / 2));
}

std::optional<PowerLaw> FitOfSquaredError(const v1::Job& job, ErrorAgainst against) {
  return FitPowerLaw(LaterHalf(
      job, against, [](const v1::SquaredError& error) { return error.noise() + error.bias(); }));
}

std::optional<Duration> TimeToTarget(const v1::Job& job) {
  const double target = SettingsOf(job).error;
  if (!(target > 0) || job.convergence().empty()) return std::nullopt;
  const v1::ErrorSample& newest = *job.convergence().rbegin();
  const double high = newest.relative().high();
  if (high <= target * target) return Duration::zero();
  const auto law = FitPowerLaw(LaterHalf(
      job, ErrorAgainst::kTime, [](const v1::SquaredError& error) { return error.high(); }));
  if (!law || law->exponent > kFlattest) return std::nullopt;
  // Through the newest sample, with the slope of the law.
  const double end_s =
      Abscissa(newest, ErrorAgainst::kTime) * std::pow(target * target / high, 1 / law->exponent);
  const double left_s = end_s - Seconds(FromProto(job.progress().running()));
  constexpr double kLongest = 10.0 * 365 * 86400;
  // When the time has come and the error has not, the next sample shows more.
  return std::chrono::duration_cast<Duration>(
      std::chrono::duration<double>(std::clamp(left_s, 0.0, kLongest)));
}

std::optional<FarTarget> FindFarTarget(const v1::Job& job) {
  // With fewer samples a trend is chance.
  constexpr int kFewestJudged = 6;
  const double target = SettingsOf(job).error;
  if (!(target > 0) || job.convergence_size() < kFewestJudged || FoundNothing(job)) {
    return std::nullopt;
  }
  const v1::ErrorSample& newest = *job.convergence().rbegin();
  const v1::SquaredError& squared = newest.relative();
  if (squared.high() <= target * target) return std::nullopt;

  FarTarget far;
  far.left = TimeToTarget(job);
  const double so_far_s = Abscissa(newest, ErrorAgainst::kTime);
  const auto law_of_bias = FitPowerLaw(LaterHalf(
      job, ErrorAgainst::kTime, [](const v1::SquaredError& error) { return error.bias(); }));
  const bool bias_stands = squared.bias() > target * target && squared.bias() > squared.noise() &&
                           law_of_bias && law_of_bias->exponent > kFlattest;
  if (bias_stands) far.left.reset();
  if (far.left && Seconds(*far.left) <= kFarTimes * so_far_s) return std::nullopt;

  const std::string wanted = ShortPercent(target);
  if (bias_stands) {
    far.sentence = Concat("the target of ", wanted, " is not in sight: the bias stands still at ",
                          ShortPercent(Root(squared.bias())), "; ");
  } else if (!far.left) {
    far.sentence = Concat("the target of ", wanted, " is not in sight: the error does not fall; ");
  } else {
    far.sentence =
        Concat("the target of ", wanted, " needs ", Rounded(Seconds(*far.left) / so_far_s),
               " times the time so far by the trend; ");
  }
  const double missing = newest.missing_relative();
  if (missing > 0.5 * squared.high()) {
    far.sentence += "more photons would help: light may not have been found yet";
  } else if (squared.bias() > squared.noise()) {
    far.sentence +=
        "a smaller first radius (--initial-radius) or another --radius-controller would help";
  } else {
    far.sentence += "more photons a second (more workers) or a larger target would help";
  }
  return far;
}

std::string ShortPercent(double share) {
  const double percent = 100 * share;
  if (!std::isfinite(percent)) return "unknown";
  if (percent <= 0) return "0 %";
  const int decimals = std::clamp(2 - static_cast<int>(std::floor(std::log10(percent))), 0, 8);
  return absl::StrFormat("%.*f %%", decimals, percent);
}

std::string ErrorWithInterval(const RelativeError& error) {
  return Concat(ShortPercent(error.value), " (95 %: ", ShortPercent(error.low), " to ",
                ShortPercent(error.high), ")");
}

}  // namespace lucerna
