#include "render/report/progress_view.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "absl/strings/str_format.h"

#include "render/base/text.h"
#include "render/report/convergence.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

constexpr Duration kPlainLineEvery = std::chrono::seconds(2);

// The photons of so many passes, as far as it is known how many later ones have.
double PhotonsOfPasses(const v1::Job& job, double passes) {
  double photons = 0;
  double per_pass = static_cast<double>(SettingsOf(job).photons_per_pass);
  double first = 0;
  for (const v1::PhotonStep& step : job.photon_steps()) {
    const double from = std::min(static_cast<double>(step.first_pass()), passes);
    photons += per_pass * (from - first);
    first = from;
    per_pass = static_cast<double>(step.photons_per_pass());
  }
  return photons + per_pass * (passes - first);
}

// After how many photons the job stops, by its passes or its photons; 0: no limit.
double PhotonsInAll(const v1::Job& job) {
  const RenderSettings settings = SettingsOf(job);
  const double of_passes = PhotonsOfPasses(job, static_cast<double>(settings.passes));
  double of_photons = static_cast<double>(settings.photons);
  const int steps = job.photon_steps_size();
  const double per_pass = steps > 0
                              ? static_cast<double>(job.photon_steps(steps - 1).photons_per_pass())
                              : static_cast<double>(settings.photons_per_pass);
  // It ends with the pass that reaches them.
  if (per_pass > 0) of_photons = per_pass * std::ceil(of_photons / per_pass);
  if (of_passes > 0 && of_photons > 0) return std::min(of_passes, of_photons);
  return std::max(of_passes, of_photons);
}

std::string Bar(double share) {
  constexpr int kWidth = 20;
  const int full = static_cast<int>(share * kWidth);
  return absl::StrCat("[", std::string(static_cast<std::size_t>(full), '#'),
                      std::string(static_cast<std::size_t>(kWidth - full), '-'), "]");
}

std::string Passes(const v1::Job& job) {
  const std::int64_t passes = job.progress().passes();
  const std::int64_t wanted = SettingsOf(job).passes;
  // Of a bake, of the round that is measured now.
  const int rounds = job.bake().rounds_size();
  const std::string round =
      rounds == 0 ? ""
                  : absl::StrCat(job.bake().rounds(rounds - 1).name(), " (",
                                 job.bake().rounds(rounds - 1).points(), " points), ");
  return wanted > 0 ? absl::StrCat(round, "pass ", passes, "/", wanted)
                    : absl::StrCat(round, "pass ", passes);
}

std::string WithoutPrefix(const std::string& name, const std::string& prefix) {
  return name.starts_with(prefix) ? name.substr(prefix.size()) : name;
}

}  // namespace

std::string ShortCount(double count) {
  constexpr std::array<const char*, 5> kUnits = {"", " k", " M", " G", " T"};
  std::size_t unit = 0;
  // 999.5 would be printed as "1e+03".
  while (count >= 999.5 && unit + 1 < kUnits.size()) {
    count /= 1000;
    ++unit;
  }
  if (unit == 0) return absl::StrFormat("%.0f", count);
  const int decimals = count < 9.995 ? 2 : count < 99.95 ? 1 : 0;
  return absl::StrFormat("%.*f%s", decimals, count, kUnits[unit]);
}

std::string ShortTime(Duration duration) {
  const double seconds = Seconds(duration);
  if (seconds < 9.995) return absl::StrFormat("%.2f s", seconds);
  if (seconds < 59.95) return absl::StrFormat("%.1f s", seconds);
  const auto whole = static_cast<std::int64_t>(std::llround(seconds));
  if (whole < 3600) return absl::StrFormat("%d:%02d", whole / 60, whole % 60);
  constexpr std::int64_t kDay = 86400;
  if (whole >= 2 * kDay) return absl::StrFormat("%.1f days", seconds / kDay);
  return absl::StrFormat("%d:%02d:%02d", whole / 3600, whole / 60 % 60, whole % 60);
}

std::string NameOf(v1::JobState state) {
  return WithoutPrefix(v1::JobState_Name(state), "JOB_STATE_");
}

std::string NameOf(v1::StopReason reason) {
  return WithoutPrefix(v1::StopReason_Name(reason), "STOP_REASON_");
}

std::string StopInWords(v1::StopReason reason) {
  switch (reason) {
    case v1::STOP_REASON_PASSES:
      return "all passes done";
    case v1::STOP_REASON_TIME:
      return "stopped by its time limit";
    case v1::STOP_REASON_ERROR:
      return "its error target reached";
    case v1::STOP_REASON_PHOTONS:
      return "all photons done";
    case v1::STOP_REASON_USER:
      return "stopped by its user";
    default:
      return "done";
  }
}

bool HasEnded(v1::JobState state) {
  return state == v1::JOB_STATE_SUCCEEDED || state == v1::JOB_STATE_CANCELLED ||
         state == v1::JOB_STATE_FAILED;
}

std::optional<double> ShareDone(const v1::Job& job) {
  if (job.state() == v1::JOB_STATE_SUCCEEDED) return 1.0;
  if (!job.has_settings()) return std::nullopt;
  const RenderSettings settings = SettingsOf(job);
  double share = 0;
  if (settings.time_s > 0) {
    share = Seconds(FromProto(job.progress().running())) / settings.time_s;
  }
  if (PhotonsInAll(job) > 0) {
    share = std::max(share, static_cast<double>(job.progress().photons()) / PhotonsInAll(job));
  }
  if (const auto left = TimeToTarget(job)) {
    const double running_s = Seconds(FromProto(job.progress().running()));
    const double whole_s = running_s + Seconds(*left);
    share = std::max(share, whole_s > 0 ? running_s / whole_s : 1);
  }
  return std::clamp(share, 0.0, 1.0);
}

std::optional<Duration> TimeLeft(const v1::Job& job) {
  if (job.state() != v1::JOB_STATE_RUNNING) return std::nullopt;
  const RenderSettings settings = SettingsOf(job);
  std::optional<double> left_s;
  if (settings.time_s > 0) {
    left_s = settings.time_s - Seconds(FromProto(job.progress().running()));
  }
  const double rate = job.progress().photons_per_second();
  if (PhotonsInAll(job) > 0 && rate > 0) {
    const double photons = PhotonsInAll(job) - static_cast<double>(job.progress().photons());
    left_s = left_s ? std::min(*left_s, photons / rate) : photons / rate;
  }
  if (const auto left = TimeToTarget(job)) {
    left_s = left_s ? std::min(*left_s, Seconds(*left)) : Seconds(*left);
  }
  if (!left_s) return std::nullopt;
  // A rate near zero must not overflow the clock: ten years are as good as for ever.
  constexpr double kLongest = 10.0 * 365 * 86400;
  return std::chrono::duration_cast<Duration>(
      std::chrono::duration<double>(std::clamp(*left_s, 0.0, kLongest)));
}

std::string ProgressLine(const v1::Job& job) {
  switch (job.state()) {
    case v1::JOB_STATE_QUEUED:
      return "queued";
    case v1::JOB_STATE_PREPARING:
      return "reading the scene";
    case v1::JOB_STATE_PAUSED:
      if (job.progress().passes() == 0) return job.condition();
      break;
    case v1::JOB_STATE_SUCCEEDED:
    case v1::JOB_STATE_CANCELLED:
    case v1::JOB_STATE_FAILED:
      return SummaryLine(job);
    default:
      break;
  }
  const double share = ShareDone(job).value_or(0);
  std::string line =
      absl::StrFormat("%s %3.0f %%  %s  %s photons", Bar(share), std::floor(100 * share),
                      Passes(job), ShortCount(static_cast<double>(job.progress().photons())));
  if (!job.condition().empty()) return line + "  " + job.condition();
  if (job.no_workers()) return line + "  no worker is connected; waiting for one";
  absl::StrAppendFormat(&line, "  %s/s  %s", ShortCount(job.progress().photons_per_second()),
                        ShortTime(FromProto(job.progress().running())));
  if (const auto left = TimeLeft(job)) {
    absl::StrAppend(&line, "  ETA ", ShortTime(*left));
  } else if (const auto far = FindFarTarget(job); far && !far->left) {
    absl::StrAppend(&line, "  ETA not in sight");
  }
  return line;
}

std::string SummaryLine(const v1::Job& job) {
  const v1::Progress& progress = job.progress();
  const Duration running = FromProto(progress.running());
  const int rounds = job.bake().rounds_size();
  auto photons = static_cast<double>(progress.photons());
  // The rounds before the newest, whose photons those are.
  for (int i = 0; i + 1 < rounds; ++i)
    photons += static_cast<double>(job.bake().rounds(i).photons());
  std::string line =
      absl::StrFormat("%d %s, %s photons in %s", job.has_bake() ? rounds : progress.passes(),
                      job.has_bake() ? (rounds == 1 ? "round" : "rounds")
                                     : (progress.passes() == 1 ? "pass" : "passes"),
                      ShortCount(photons), ShortTime(running));
  switch (job.state()) {
    case v1::JOB_STATE_SUCCEEDED:
      absl::StrAppend(&line, ", ", StopInWords(job.stop_reason()));
      break;
    case v1::JOB_STATE_CANCELLED:
      return line + ", cancelled";
    case v1::JOB_STATE_FAILED:
      return line + ", failed: " + job.failure();
    default:
      break;
  }
  if (const auto error = NewestError(job)) {
    absl::StrAppend(&line, ", error about ", ErrorWithInterval(*error), ", untrimmed ",
                    ShortPercent(error->untrimmed));
    if (job.stop_reason() == v1::STOP_REASON_ERROR) {
      const std::int64_t pixels = job.convergence().rbegin()->left_out_pixels();
      absl::StrAppend(&line, "; the target leaves out the worst ", pixels,
                      pixels == 1 ? " pixel" : " pixels");
    }
    if (const auto denoised = DenoisedErrorOf(job)) {
      absl::StrAppend(&line, "; denoised, ", ErrorWithInterval(*denoised), ", untrimmed ",
                      ShortPercent(denoised->untrimmed));
    }
  } else if (FoundNothing(job)) {
    line += ", no light was found: the image is black";
  }
  return line;
}

std::string ErrorLine(const v1::Job& job) {
  if (FoundNothing(job)) return "nothing found yet: no light has reached the view";
  const auto error = NewestError(job);
  if (!error) return {};
  std::string line = Concat("error about ", ErrorWithInterval(*error), "  untrimmed ",
                            ShortPercent(error->untrimmed));
  if (const double target = SettingsOf(job).error; target > 0) {
    absl::StrAppend(&line, "  target ", ShortPercent(target));
    if (const auto far = FindFarTarget(job); far && !far->left) {
      line += " not in sight";
    } else if (const auto left = TimeToTarget(job); left && *left > Duration::zero()) {
      absl::StrAppend(&line, " in about ", ShortTime(*left));
    }
  }
  return line;
}

std::vector<std::string> ErrorNotes(const v1::Job& job) {
  std::vector<std::string> notes;
  if (std::string missing = MissingLightSentence(job); !missing.empty()) {
    notes.push_back(std::move(missing));
  }
  if (auto far = FindFarTarget(job)) notes.push_back(std::move(far->sentence));
  return notes;
}

std::string TableHead() {
  return absl::StrFormat("%-33s %-10s %5s %6s %10s %9s %9s  %-12s %s", "JOB", "STATE", "DONE",
                         "PASSES", "PHOTONS", "TIME", "ETA", "OWNER", "NAME");
}

std::string TableLine(const v1::Job& job) {
  const std::optional<double> share = ShareDone(job);
  const std::optional<Duration> left = TimeLeft(job);
  return absl::StrFormat(
      "%-33s %-10s %5s %6d %10s %9s %9s  %-12s %s", job.job_id(), NameOf(job.state()),
      share ? absl::StrFormat("%.0f %%", std::floor(100 * *share)) : "-", job.progress().passes(),
      ShortCount(static_cast<double>(job.progress().photons())),
      ShortTime(FromProto(job.progress().running())), left ? ShortTime(*left) : "-",
      job.owner().empty() ? "-" : job.owner(), job.name());
}

std::string ProgressPrinter::Update(const v1::Job& job, SteadyTime now) {
  const std::string line = ProgressLine(job);
  if (line == last_line_) return {};
  const bool is_due = job.state() != last_state_ || !last_written_.has_value() ||
                      now - *last_written_ >= kPlainLineEvery;
  if (!is_due) return {};
  last_line_ = line;
  last_written_ = now;
  last_state_ = job.state();
  std::string text = line + "\n";
  // Numbers in them change with every line: they are written when they come, and with the last.
  const std::vector<std::string> notes = ErrorNotes(job);
  if (notes.size() != last_notes_.size()) {
    for (const std::string& note : notes)
      text += note + "\n";
  }
  last_notes_ = notes;
  return text;
}

}  // namespace lucerna
