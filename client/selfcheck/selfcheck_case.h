// What is a case of `lucerna selfcheck`, and what does it work with?
//
// A case makes a claim that needs no reference image, renders or computes what the claim is about,
// and returns one figure with the bound that it must keep. The bound is derived, never tuned.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client/job_run.h"
#include "client/local_cluster.h"
#include "proto/lucerna/v1/jobs.pb.h"
#include "render/base/status.h"
#include "render/image/image.h"
#include "render/scene/render_settings.h"

namespace lucerna {

// What came of one job.
struct SelfcheckRender {
  v1::Job job;
  Image image;
  std::vector<std::string> warnings;  // of the scene, as the coordinator said them
};

// Renders scene texts on a coordinator and workers of its own, so that a case goes the way of every
// job: over the wire, by leases and batches.
class SelfcheckBench {
 public:
  // To be called by a thread that lives as long as the bench (LocalCluster::Start).
  [[nodiscard]] static StatusOr<std::unique_ptr<SelfcheckBench>> Start(
      const std::string& program_folder);

  // The same scene and overrides are rendered once; what is returned lives as long as the bench.
  // Errors: INVALID_ARGUMENT when the coordinator finds errors in the scene or the overrides,
  // Failure(kInterrupted), and those of a job that did not succeed.
  [[nodiscard]] StatusOr<const SelfcheckRender*> Render(const std::string& scene_text,
                                                        const RenderOverrides& overrides);
  // The same by so many workers of one thread each. Nothing is remembered.
  [[nodiscard]] StatusOr<SelfcheckRender> RenderByWorkers(const std::string& scene_text,
                                                          const RenderOverrides& overrides,
                                                          int workers);

 private:
  SelfcheckBench(std::string program_folder, std::unique_ptr<LocalRuns> runs)
      : program_folder_(std::move(program_folder)), runs_(std::move(runs)) {}

  const std::string program_folder_;
  const std::unique_ptr<LocalRuns> runs_;
  std::map<std::string, std::unique_ptr<SelfcheckRender>> known_;
};

struct CaseOutcome {
  double figure = 0;
  double bound = 0;
  std::string note;  // what the figure counts or measures, and where it was worst
  bool holds = false;
};

struct SelfcheckCase {
  std::string name;   // words joined by '-'
  std::string claim;  // what was done and must hold, as half a sentence
  std::function<StatusOr<CaseOutcome>(SelfcheckBench& bench)> run;
};

// The outcome of a figure that must not exceed its bound. A figure that is not a number does.
[[nodiscard]] inline CaseOutcome AtMost(double figure, double bound, std::string note) {
  return {.figure = figure, .bound = bound, .note = std::move(note), .holds = figure <= bound};
}

}  // namespace lucerna
