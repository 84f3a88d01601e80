// Which settings are ahead, by how much, and how fast does each converge?
//
// Pure: what runs measured goes in, mean errors at asked times, ratios and slopes come out, and
// their table as text.
//
// A run is a curve of relMSE against time. Between its points it is taken to be a power law, as
// progressive photon mapping converges by one: lines on logarithmic axes. Noise of the reference is
// taken off each point first; a point at which nothing is left then is left out.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "render/estimate/radius_controller.h"
#include "render/math/power_law.h"
#include "render/scene/render_settings.h"

namespace lucerna {

// One moment of a run. All but `reference_noise` are above 0 in a point that counts.
struct ErrorPoint {
  double seconds = 0;  // processor seconds of coordinator and workers over the cores used [s]
  double wall_s = 0;
  double photons = 0;
  double rel_mse = 0;          // as measured
  double reference_noise = 0;  // the part of it that is noise of the reference; 0: not known
  // relMSE of all pixels, as measured, and the reference's part of it. Need not be above 0.
  double untrimmed = 0, untrimmed_reference_noise = 0;
};

struct ComparedRun {
  std::size_t setting = 0;  // which one it is a run of
  std::uint64_t seed = 0;
  std::vector<ErrorPoint> points;  // by growing time
};

// A mean over repetitions; without a standard error when there was one only.
struct MeanOfRuns {
  double value = 0;
  std::optional<double> standard_error;
};

// One setting at one of the asked times.
struct ComparedCell {
  double seconds = 0;
  MeanOfRuns rel_mse;    // without the reference's noise
  MeanOfRuns untrimmed;  // the same of all pixels
  MeanOfRuns ratio;      // to the first setting's
  double wall_s = 0;     // means of the runs
  double photons = 0;
  // More than half of what was measured was the reference's noise.
  bool is_mostly_reference = false;
};

struct ComparedSetting {
  std::string name;
  // Absent where a run did not come near the time, or nothing was left beside the reference's
  // noise.
  std::vector<std::optional<ComparedCell>> cells;  // [times]
  // Fitted exponents of relMSE against photons and against seconds, from the first to the last
  // time.
  std::optional<MeanOfRuns> slope_photons, slope_seconds;
  std::optional<TheorySlopes> theory;
};

struct Comparison {
  std::vector<double> times;  // [s]
  std::vector<ComparedSetting> settings;
};

// What is compared: name and theory of each setting.
struct SettingToCompare {
  std::string name;
  std::optional<TheorySlopes> theory;
};

// Requires times that grow, and runs of settings that there are.
[[nodiscard]] Comparison CompareRuns(const std::vector<SettingToCompare>& settings,
                                     std::span<const ComparedRun> runs,
                                     const std::vector<double>& times);

// Where the curve of `points` is at `seconds`, without the reference's noise (reference_noise stays
// as it was). Up to a quarter beyond its ends it is prolonged; nothing beyond.
[[nodiscard]] std::optional<ErrorPoint> PointAt(std::span<const ErrorPoint> points, double seconds);

// The exponent of the power law through the points; nothing when they do not span a factor of 1.5
// or are not above 0.
[[nodiscard]] std::optional<double> FittedExponent(std::span<const PowerLawPoint> points);

// What theory says of light from photons (RadiusController::Slopes); eye paths' noise always falls
// as 1/passes.
[[nodiscard]] std::optional<TheorySlopes> TheoryOf(const RenderSettings& settings);

// What the table's head holds.
struct ComparisonSubject {
  std::string scene, reference;
  std::optional<double> reference_noise;  // relMSE of the whole reference
  int cores = 1;
  int repetitions = 1;
  std::uint64_t first_seed = 0;
  // "" or what was left out of the error, like "without the worst 0.1 % of pixels".
  std::string left_out;
  std::vector<std::string> flags;  // as typed, of each setting
};

// Markdown: the head, errors at the times, and slopes.
[[nodiscard]] std::string ComparisonTable(const Comparison& comparison,
                                          const ComparisonSubject& subject);

}  // namespace lucerna
