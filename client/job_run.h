// How does one job go from files on this machine to its end?
//
// `render` and `submit` run one job, `compare`, `reference` and `selfcheck` several on one local
// cluster.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "client/connection.h"
#include "client/local_cluster.h"
#include "client/output_options.h"
#include "render/bake/bake_settings.h"
#include "render/base/status.h"
#include "render/image/image.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene_files.h"

namespace lucerna {

// What is asked of a coordinator.
struct JobToSend {
  const SceneManifest& manifest;
  const RenderOverrides& overrides;
  std::string reference_path = {};        // empty: none
  int priority = 0;                       // that of Job
  bool is_traced = false;                 // the coordinator keeps a timeline
  std::optional<BakeSettings> bake = {};  // what is measured in place of an image
};

// Uploads what the coordinator does not have and submits. `files` reads those of the manifest.
[[nodiscard]] StatusOr<v1::SubmitResponse> SendJob(ClientConnection& connection, SceneFiles& files,
                                                   const JobToSend& job);

// Follows the job to its end, and shows its progress unless that is off. `check` is asked several
// times a second; before the first news, of an empty job.
[[nodiscard]] StatusOr<v1::Job> FollowToEnd(ClientConnection& connection, const std::string& job_id,
                                            bool shows_progress,
                                            const OutputOptions& output_options,
                                            const std::function<Status(const v1::Job&)>& check);

// Errors: FAILED_PRECONDITION that says what became of the job instead.
[[nodiscard]] Status CheckSucceeded(const v1::Job& job);

// The bytes of an EXR file as an image.
// Errors: DATA_LOSS when they are none.
[[nodiscard]] StatusOr<Image> DecodeImageOf(const std::string& job_id, const std::string& bytes);

// Jobs, one after the other, on a coordinator and workers of their own.
class LocalRuns {
 public:
  // To be called by a thread that lives as long as the runs (LocalCluster::Start).
  [[nodiscard]] static StatusOr<std::unique_ptr<LocalRuns>> Start(const ClusterOptions& options);

  // Renders to the end. An interruption cancels the job, unless the cluster has a state, in which
  // it stays. Returns a job that succeeded.
  [[nodiscard]] StatusOr<v1::Job> Run(SceneFiles& files, JobToSend job,
                                      const OutputOptions& output_options);
  // The same for the scene of a file on this machine.
  [[nodiscard]] StatusOr<v1::Job> Run(const std::string& scene_path, const SceneManifest& manifest,
                                      const RenderOverrides& overrides,
                                      const std::string& reference_path,
                                      const OutputOptions& output_options);
  // Goes on, to the end that the overrides give if they give one, with a job that is in the
  // cluster's state: number `index` of those, from the first one submitted.
  // Errors: also FAILED_PRECONDITION when there is none, or its scene or settings are others.
  [[nodiscard]] StatusOr<v1::Job> Resume(const JobToSend& wanted,
                                         const OutputOptions& output_options,
                                         std::size_t index = 0);
  // How many jobs are in the cluster's state.
  [[nodiscard]] StatusOr<std::size_t> CountJobs();
  // The image of a job that succeeded.
  [[nodiscard]] StatusOr<Image> ImageOf(const v1::Job& job);
  // Of the jobs that are run from now on timelines are kept.
  void TraceJobs() { is_tracing_ = true; }
  // Called several times a second while a job runs, with the newest news of it; the job goes on.
  void WhileItRuns(std::function<void(const v1::Job&)> on_news) { on_news_ = std::move(on_news); }
  // Of the job that was run last; empty before.
  [[nodiscard]] const std::string& job_id() const { return job_id_; }

  [[nodiscard]] ClientConnection& connection() { return *connection_; }

 private:
  LocalRuns() = default;
  StatusOr<v1::Job> FollowOwn(const OutputOptions& output_options);

  bool has_state_ = false;
  bool is_tracing_ = false;
  std::function<void(const v1::Job&)> on_news_;
  std::string job_id_;
  std::unique_ptr<LocalCluster> cluster_;
  std::unique_ptr<ClientConnection> connection_;
};

}  // namespace lucerna
