// Commands that need a coordinator.
//
// One function a command. Results go to stdout, everything else to stderr; the Status says how
// the program ends (client/exit_code.h). An image is written whole or not at all.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client/commands/bake_command.h"
#include "client/image_output.h"
#include "client/local_cluster.h"
#include "client/output_options.h"
#include "client/scene_reading.h"
#include "render/base/status.h"
#include "render/scene/render_settings.h"
#include "render/wire/channel.h"

namespace lucerna {

struct RenderRequest {
  SceneSource scene;
  RenderOverrides overrides;
  std::string reference;  // EXR file to measure the true error by; empty: none
  std::string mesh;       // of `render`: .glb file whose light is drawn; empty: photons bring it
  OutputPaths outputs;
  // The image so far is written so often [s]; 0: at the end alone.
  double save_every_s = 0;
  std::string trace;              // file for the job's timeline; empty: none
  int priority = 0;               // of `submit`
  bool keeps_checkpoints = true;  // of `render`: in a folder beside the image
  bool resumes = false;           // goes on from there
};

// The requests of a command for several scenes: `request` with each of them, and with the number of
// its frame in the names of its images (client/frames.h). An image without a name is called as the
// scene when `names_images`.
// Errors: Failure(kUsage) when two would write the same file.
[[nodiscard]] StatusOr<std::vector<RenderRequest>> RequestsOf(
    const RenderRequest& request, const std::vector<std::string>& scenes, std::string_view frames,
    bool names_images);

// Renders on a coordinator and workers of its own, or draws the light of a mesh in this process,
// one after the other. An interruption writes the image so far and leaves the checkpoints. Of
// several that go on after one, those whose image is there without checkpoints are done.
[[nodiscard]] Status Render(const std::vector<RenderRequest>& requests,
                            const ClusterOptions& cluster, const OutputOptions& output_options);

// Sends the job and prints its id; with outputs it waits and fetches too. An interruption leaves
// the job running.
[[nodiscard]] Status Submit(const RenderRequest& request, const Endpoint& server,
                            const OutputOptions& output_options);

// Which jobs are listed; what is empty lets all pass.
struct JobsRequest {
  std::vector<std::string> states;  // as in the table
  std::string user;
  std::string name_contains;
};
[[nodiscard]] Status ListJobs(const JobsRequest& request, const Endpoint& server,
                              const OutputOptions& output_options);

[[nodiscard]] Status PauseJob(const std::string& job_id, const Endpoint& server,
                              const OutputOptions& output_options);
[[nodiscard]] Status ResumeJob(const std::string& job_id, const Endpoint& server,
                               const OutputOptions& output_options);
[[nodiscard]] Status SetPriority(const std::string& job_id, int priority, const Endpoint& server,
                                 const OutputOptions& output_options);

// Waits until the job has ended, with or without showing its progress.
// Errors: FAILED_PRECONDITION when it did not succeed.
[[nodiscard]] Status Follow(const std::string& job_id, bool shows_progress, const Endpoint& server,
                            const OutputOptions& output_options);

// Writes the image of a job, or what a bake made to `outputs.image`, as `of_bake` says.
[[nodiscard]] Status Fetch(const std::string& job_id, const OutputPaths& outputs,
                           BakeOutputs of_bake, const Endpoint& server,
                           const OutputOptions& output_options);

// Where a report goes; empty: not there. As JSON it goes to stdout when the output_options says so.
struct ReportPaths {
  std::string html;
  std::string csv;
};

// Tells how a job went, be it over or not: image, error, workers.
[[nodiscard]] Status Report(const std::string& job_id, const ReportPaths& paths,
                            const Endpoint& server, const OutputOptions& output_options);

// Forgets a job that has ended.
[[nodiscard]] Status DeleteJob(const std::string& job_id, const Endpoint& server,
                               const OutputOptions& output_options);

// Ends the job with the image as it is.
[[nodiscard]] Status StopJob(const std::string& job_id, const Endpoint& server,
                             const OutputOptions& output_options);

// Gives the job a new end (passes, photons, time, error) and lets it go on.
[[nodiscard]] Status Extend(const std::string& job_id, const RenderOverrides& until,
                            const Endpoint& server, const OutputOptions& output_options);

[[nodiscard]] Status Cancel(const std::string& job_id, const Endpoint& server,
                            const OutputOptions& output_options);

}  // namespace lucerna
