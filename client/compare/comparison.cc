#include "client/compare/comparison.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "absl/strings/str_format.h"

#include "render/base/status.h"

namespace lucerna {
namespace {

// How far a curve is prolonged beyond its ends, and how far points beside the asked times count for
// the slope. A render stops at a pass, not at a time.
constexpr double kProlonged = 1.25;
constexpr double kLeastSpan = 1.5;

MeanOfRuns MeanOf(std::span<const double> values) {
  const auto count = static_cast<double>(values.size());
  MeanOfRuns mean;
  for (const double value : values)
    mean.value += value / count;
  if (values.size() < 2) return mean;
  double squares = 0;
  for (const double value : values)
    squares += (value - mean.value) * (value - mean.value);
  mean.standard_error = std::sqrt(squares / (count * (count - 1)));
  return mean;
}

// The ratio of two means whose values belong together in pairs: repetitions have the same seed, and
// ran one after the other.
MeanOfRuns RatioOf(std::span<const double> values, std::span<const double> first) {
  const double of_first = MeanOf(first).value;
  MeanOfRuns ratio = {.value = MeanOf(values).value / of_first, .standard_error = std::nullopt};
  if (values.size() < 2 || values.size() != first.size()) return ratio;
  std::vector<double> rest;
  for (std::size_t i = 0; i < values.size(); ++i)
    rest.push_back((values[i] - ratio.value * first[i]) / of_first);
  ratio.standard_error = MeanOf(rest).standard_error;
  return ratio;
}

// The points that say something, without the reference's noise in their error.
std::vector<ErrorPoint> Corrected(std::span<const ErrorPoint> points) {
  std::vector<ErrorPoint> corrected;
  for (ErrorPoint point : points) {
    point.rel_mse -= point.reference_noise;
    point.untrimmed -= point.untrimmed_reference_noise;
    const bool counts = point.rel_mse > 0 && point.seconds > 0 && point.photons > 0 &&
                        point.wall_s > 0 && std::isfinite(point.rel_mse);
    // Two estimates can fall on one tick of a clock.
    if (counts && (corrected.empty() || point.seconds > corrected.back().seconds)) {
      corrected.push_back(point);
    }
  }
  return corrected;
}

// On the line through a and b on logarithmic axes, `t` of the way.
double Between(double a, double b, double t) {
  return std::exp(std::lerp(std::log(a), std::log(b), t));
}

std::optional<double> SlopeOf(const ComparedRun& run, double ErrorPoint::*against,
                              const std::vector<double>& times) {
  std::vector<PowerLawPoint> points;
  for (const ErrorPoint& point : Corrected(run.points)) {
    if (point.seconds < times.front() / kProlonged || point.seconds > times.back() * kProlonged) {
      continue;
    }
    points.push_back({point.*against, point.rel_mse});
  }
  return FittedExponent(points);
}

// "2.10e-03 ± 5e-05", "-0.67 ± 0.02".
std::string ErrorText(const MeanOfRuns& mean) {
  std::string text = absl::StrFormat("%.2e", mean.value);
  if (mean.standard_error) absl::StrAppendFormat(&text, " ± %.0e", *mean.standard_error);
  return text;
}
std::string PlainText(const MeanOfRuns& mean) {
  std::string text = absl::StrFormat("%.2f", mean.value);
  if (mean.standard_error) absl::StrAppendFormat(&text, " ± %.2f", *mean.standard_error);
  return text;
}
std::string PlainText(const std::optional<MeanOfRuns>& mean) {
  return mean ? PlainText(*mean) : "—";
}

// Text that a cell of a table can hold.
std::string EscapedCell(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '|') escaped += '\\';
    escaped += c == '\n' ? ' ' : c;
  }
  return escaped;
}

// Points of all runs of one setting at one time; as many as runs, or none.
std::vector<ErrorPoint> PointsAt(std::span<const ComparedRun> runs, std::size_t setting,
                                 double seconds) {
  std::vector<ErrorPoint> points;
  for (const ComparedRun& run : runs) {
    if (run.setting != setting) continue;
    const std::optional<ErrorPoint> point = PointAt(run.points, seconds);
    // A mean over those that came far enough would be one over the lucky ones.
    if (!point) return {};
    points.push_back(*point);
  }
  return points;
}

std::vector<double> Column(std::span<const ErrorPoint> points, double ErrorPoint::*which) {
  std::vector<double> column;
  for (const ErrorPoint& point : points)
    column.push_back(point.*which);
  return column;
}

std::optional<ComparedCell> CellOf(const std::vector<ErrorPoint>& points,
                                   const std::vector<ErrorPoint>& of_first, double seconds) {
  if (points.empty()) return std::nullopt;
  const std::vector<double> errors = Column(points, &ErrorPoint::rel_mse);
  ComparedCell cell;
  cell.seconds = seconds;
  cell.rel_mse = MeanOf(errors);
  cell.untrimmed = MeanOf(Column(points, &ErrorPoint::untrimmed));
  // Against a first setting that never came here there is no ratio; NaN is shown as such.
  cell.ratio = of_first.empty() ? MeanOfRuns{.value = NAN, .standard_error = std::nullopt}
                                : RatioOf(errors, Column(of_first, &ErrorPoint::rel_mse));
  cell.wall_s = MeanOf(Column(points, &ErrorPoint::wall_s)).value;
  cell.photons = MeanOf(Column(points, &ErrorPoint::photons)).value;
  cell.is_mostly_reference =
      MeanOf(Column(points, &ErrorPoint::reference_noise)).value > cell.rel_mse.value;
  return cell;
}

std::optional<MeanOfRuns> MeanSlope(std::span<const ComparedRun> runs, std::size_t setting,
                                    double ErrorPoint::*against, const std::vector<double>& times) {
  std::vector<double> slopes;
  for (const ComparedRun& run : runs) {
    if (run.setting != setting) continue;
    const std::optional<double> slope = SlopeOf(run, against, times);
    if (!slope) return std::nullopt;
    slopes.push_back(*slope);
  }
  if (slopes.empty()) return std::nullopt;
  return MeanOf(slopes);
}

}  // namespace

std::optional<double> FittedExponent(std::span<const PowerLawPoint> points) {
  double least = HUGE_VAL;
  double most = 0;
  for (const PowerLawPoint& point : points) {
    if (!(point.x > 0) || !(point.y > 0)) return std::nullopt;
    least = std::min(least, point.x);
    most = std::max(most, point.x);
  }
  if (!(most >= kLeastSpan * least)) return std::nullopt;
  const std::optional<PowerLaw> law = PowerLawThrough(points);
  if (!law) return std::nullopt;
  return law->exponent;
}

std::optional<ErrorPoint> PointAt(std::span<const ErrorPoint> points, double seconds) {
  const std::vector<ErrorPoint> curve = Corrected(points);
  if (curve.size() < 2) return std::nullopt;
  if (seconds < curve.front().seconds / kProlonged || seconds > curve.back().seconds * kProlonged) {
    return std::nullopt;
  }
  const auto after = std::ranges::lower_bound(curve, seconds, {}, &ErrorPoint::seconds);
  const std::size_t last = curve.size() - 1;
  const auto right =
      std::clamp<std::size_t>(static_cast<std::size_t>(after - curve.begin()), 1, last);
  const ErrorPoint& a = curve[right - 1];
  const ErrorPoint& b = curve[right];
  const double t = std::log(seconds / a.seconds) / std::log(b.seconds / a.seconds);
  return ErrorPoint{.seconds = seconds,
                    .wall_s = Between(a.wall_s, b.wall_s, t),
                    .photons = Between(a.photons, b.photons, t),
                    .rel_mse = Between(a.rel_mse, b.rel_mse, t),
                    .reference_noise = t < 0.5 ? a.reference_noise : b.reference_noise,
                    .untrimmed = a.untrimmed > 0 && b.untrimmed > 0
                                     ? Between(a.untrimmed, b.untrimmed, t)
                                     : std::lerp(a.untrimmed, b.untrimmed, t)};
}

Comparison CompareRuns(const std::vector<SettingToCompare>& settings,
                       std::span<const ComparedRun> runs, const std::vector<double>& times) {
  LUCERNA_CHECK(std::ranges::is_sorted(times));
  Comparison comparison;
  comparison.times = times;
  for (std::size_t setting = 0; setting < settings.size(); ++setting) {
    ComparedSetting compared;
    compared.name = settings[setting].name;
    compared.theory = settings[setting].theory;
    for (const double seconds : times) {
      compared.cells.push_back(
          CellOf(PointsAt(runs, setting, seconds), PointsAt(runs, 0, seconds), seconds));
    }
    if (!times.empty()) {
      compared.slope_photons = MeanSlope(runs, setting, &ErrorPoint::photons, times);
      compared.slope_seconds = MeanSlope(runs, setting, &ErrorPoint::seconds, times);
    }
    comparison.settings.push_back(std::move(compared));
  }
  return comparison;
}

std::optional<TheorySlopes> TheoryOf(const RenderSettings& settings) {
  return MakeRadiusController(settings, 1)->Slopes();
}

std::string ComparisonTable(const Comparison& comparison, const ComparisonSubject& subject) {
  std::string text = absl::StrCat("# ", EscapedCell(subject.scene), "\n\n");
  absl::StrAppend(&text, "relMSE against ", subject.reference, subject.left_out.empty() ? "" : ", ",
                  subject.left_out, "; mean of ", subject.repetitions,
                  subject.repetitions == 1 ? " run" : " runs", " ± its standard error, seeds from ",
                  subject.first_seed, ", runs of all settings in turn.\n");
  absl::StrAppend(&text, "Time is processor time of coordinator and workers over ", subject.cores,
                  subject.cores == 1 ? " core" : " cores",
                  "; the ratio is to the first setting. Untrimmed is relMSE of all pixels.\n");
  if (subject.reference_noise) {
    absl::StrAppendFormat(
        &text,
        "The reference's own noise (relMSE %.2e of the whole image) is taken off; "
        "† where it was more than half of what was measured.\n",
        *subject.reference_noise);
  } else {
    absl::StrAppend(&text,
                    "The reference does not state its own noise: errors hold it, and none can be "
                    "smaller.\n");
  }
  absl::StrAppend(&text, "— where a run did not come near the time, or no error was left.\n\n");

  absl::StrAppend(&text,
                  "| s | setting | relMSE | untrimmed | ratio | wall s | photons |\n"
                  "|---|---|---|---|---|---|---|\n");
  for (std::size_t i = 0; i < comparison.times.size(); ++i) {
    for (const ComparedSetting& setting : comparison.settings) {
      absl::StrAppendFormat(&text, "| %g | %s | ", comparison.times[i], EscapedCell(setting.name));
      const std::optional<ComparedCell>& cell = setting.cells[i];
      if (!cell) {
        absl::StrAppend(&text, "— | — | — | — | — |\n");
        continue;
      }
      absl::StrAppend(&text, ErrorText(cell->rel_mse), cell->is_mostly_reference ? " †" : "", " | ",
                      ErrorText(cell->untrimmed), " | ",
                      std::isfinite(cell->ratio.value) ? PlainText(cell->ratio) : "—");
      absl::StrAppendFormat(&text, " | %.2f | %.3g |\n", cell->wall_s, cell->photons);
    }
  }

  absl::StrAppend(&text,
                  "\nExponents of relMSE, fitted from the first to the last time. Theory: of the "
                  "noise / of the squared bias of light\nfrom photons; noise of eye paths falls "
                  "with -1.\n\n"
                  "| setting | flags | against photons | against time | theory |\n"
                  "|---|---|---|---|---|\n");
  for (std::size_t i = 0; i < comparison.settings.size(); ++i) {
    const ComparedSetting& setting = comparison.settings[i];
    const std::string flags = i < subject.flags.size() ? EscapedCell(subject.flags[i]) : "";
    absl::StrAppend(&text, "| ", EscapedCell(setting.name), " | ",
                    flags.empty() ? "" : absl::StrCat("`", flags, "`"), " | ",
                    PlainText(setting.slope_photons), " | ", PlainText(setting.slope_seconds),
                    " | ");
    if (setting.theory) {
      absl::StrAppendFormat(&text, "%.2f / %.2f |\n", setting.theory->noise,
                            setting.theory->squared_bias);
    } else {
      absl::StrAppend(&text, "— |\n");
    }
  }
  return text;
}

}  // namespace lucerna
