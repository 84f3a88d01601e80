// How fast does a job's error fall, and when will it be small enough?
//
// Pure: from the convergence record of a Job. Errors here are relative errors, the root of relMSE
// without the worst 0.1 % of pixels, as shares: 0.02 is 2 %.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "proto/lucerna/v1/jobs.pb.h"
#include "render/base/clock.h"
#include "render/math/power_law.h"
#include "render/report/chart.h"

namespace lucerna {

// The error at one moment. Squared, noise and bias add up to value².
struct RelativeError {
  double value = 0;
  double low = 0, high = 0;  // ends of the 95 % interval
  double noise = 0, bias = 0;
  std::optional<double> truth = std::nullopt;  // against the job's reference
  // The same of all pixels.
  double untrimmed = 0;
  std::optional<double> true_untrimmed = std::nullopt;
};

[[nodiscard]] RelativeError ErrorOf(const v1::ErrorSample& sample);

// Of the newest sample; absent before the first and while nothing has been found.
[[nodiscard]] std::optional<RelativeError> NewestError(const v1::Job& job);
// The same of the denoised image; absent where the newest sample has none.
[[nodiscard]] std::optional<RelativeError> DenoisedErrorOf(const v1::Job& job);

// Whether the scene has lights and the image was still black at the newest sample: then nothing is
// known of its error.
[[nodiscard]] bool FoundNothing(const v1::Job& job);

// One sentence that names the lights of which too few photons have come into view, worst first, and
// how much of the image they may be; empty while that is no matter: below a tenth of the interval's
// upper end and, if there is a target, below half of it.
[[nodiscard]] std::string MissingLightSentence(const v1::Job& job);

// Points that are not finite and above 0 are left out; absent when fewer than three are left or all
// have the same x.
[[nodiscard]] std::optional<PowerLaw> FitPowerLaw(const std::vector<ChartPoint>& points);

// What the error is set against: wall time [s] or photons.
enum class ErrorAgainst : std::uint8_t { kTime, kPhotons };

[[nodiscard]] double Abscissa(const v1::ErrorSample& sample, ErrorAgainst against);

// Index of the first sample of the later half, but of the last three at least: what is fitted.
[[nodiscard]] int FirstFitted(const v1::Job& job);

// The law of the expected squared error (noise + bias) over the later half of the samples.
[[nodiscard]] std::optional<PowerLaw> FitOfSquaredError(const v1::Job& job, ErrorAgainst against);

// How long until the upper end of the interval is at the job's error target, by the law that this
// end followed lately; zero when it is there. Absent without a target, or when the error does not
// fall.
[[nodiscard]] std::optional<Duration> TimeToTarget(const v1::Job& job);

// An error target that is out of sight.
struct FarTarget {
  std::optional<Duration> left;  // by the trend; absent when the error does not fall
  std::string sentence;          // why, and what would help
};
// Absent without a target, when it is reached, while there are too few samples for a trend, and
// when the trend says that it will be reached within kFarTimes times the time so far.
[[nodiscard]] std::optional<FarTarget> FindFarTarget(const v1::Job& job);
inline constexpr double kFarTimes = 100;

// "1.83 %", "0.0512 %": three digits.
[[nodiscard]] std::string ShortPercent(double share);

// "1.83 % (95 %: 1.52 % to 2.11 %)".
[[nodiscard]] std::string ErrorWithInterval(const RelativeError& error);

}  // namespace lucerna
