// How does a job's progress read?
//
// Pure: a Job and a time in, text out. Plain lines, few enough to be kept in a log;
// client/live_view.h makes more of them on a terminal.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "proto/lucerna/v1/jobs.pb.h"
#include "render/base/clock.h"

namespace lucerna {

// "13.9 M", "512", "2.05 k".
[[nodiscard]] std::string ShortCount(double count);

// "0.35 s", "12.5 s", "4:05", "1:02:03", from two days on "3.5 days".
[[nodiscard]] std::string ShortTime(Duration duration);

// "RUNNING", "PASSES": the names of the protocol without their prefix.
[[nodiscard]] std::string NameOf(v1::JobState state);
[[nodiscard]] std::string NameOf(v1::StopReason reason);
// Like "stopped by its time limit"; "done" for a reason that is not known.
[[nodiscard]] std::string StopInWords(v1::StopReason reason);

[[nodiscard]] bool HasEnded(v1::JobState state);

// How much of the job is done, in [0, 1], by photons, time or the time that the error target is
// expected to take, whichever stops it first; absent before the job runs.
[[nodiscard]] std::optional<double> ShareDone(const v1::Job& job);

// How long until it stops at its present rate; absent when it is unknown.
[[nodiscard]] std::optional<Duration> TimeLeft(const v1::Job& job);

// One line without its end: "[#####-----]  50 %  pass 8/16  4.2 M photons  1.1 M/s  4.1 s  ETA 4
// s".
[[nodiscard]] std::string ProgressLine(const v1::Job& job);

// One line without its end, about a job that has ended.
[[nodiscard]] std::string SummaryLine(const v1::Job& job);

// One line without its end: "error about 1.83 % (95 %: 1.52 % to 2.11 %)  untrimmed 2.40 %
// target 1.00 % in about 4:05". Empty while nothing is known of the error, and "nothing found yet:
// ..." while the image is black.
[[nodiscard]] std::string ErrorLine(const v1::Job& job);

// What stands between the job and its target, or may be missing, a sentence each: light that was
// not found, a target that is far away. Often none.
[[nodiscard]] std::vector<std::string> ErrorNotes(const v1::Job& job);

// The job on one line of a table; TableHead is the line above.
[[nodiscard]] std::string TableHead();
[[nodiscard]] std::string TableLine(const v1::Job& job);

// What to write as a job moves on, where nothing can be redrawn.
class ProgressPrinter {
 public:
  // What to write now; often nothing.
  [[nodiscard]] std::string Update(const v1::Job& job, SteadyTime now);

 private:
  std::string last_line_;
  std::vector<std::string> last_notes_;
  std::optional<SteadyTime> last_written_;
  v1::JobState last_state_ = v1::JOB_STATE_UNSPECIFIED;
};

}  // namespace lucerna
