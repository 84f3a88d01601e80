#include "client/job_run.h"

#include <cstdio>
#include <optional>
#include <utility>

#include <unistd.h>

#include "client/exit_code.h"
#include "client/scene_reading.h"
#include "client/view/live_view.h"
#include "client/view/preview_source.h"
#include "client/view/terminal.h"
#include "client/view/tev_view.h"
#include "render/base/clock.h"
#include "render/base/console.h"
#include "render/base/files.h"
#include "render/base/random_id.h"
#include "render/image/exr_file.h"
#include "render/report/photon_view.h"
#include "render/report/progress_view.h"
#include "render/scene/setting_table.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

constexpr const char* kAnew = "; leave --resume away to begin anew";

Status OtherValue(const Setting& setting) {
  return absl::FailedPreconditionError(absl::StrCat(
      "the job that was interrupted has another value of ", NameInMessage(setting), kAnew));
}

// Whether a bake was asked for with these settings.
Status CheckSameBake(const v1::Job& job, const JobToSend& wanted) {
  LUCERNA_ASSIGN_OR_RETURN(const BakeSettings settings, FromProto(job.bake().settings()));
  if (settings != *wanted.bake) {
    return absl::FailedPreconditionError(
        absl::StrCat("the bake that was interrupted was asked for in another way", kAnew));
  }
  LUCERNA_ASSIGN_OR_RETURN(const RenderOverrides overrides, FromProto(job.bake().overrides()));
  for (const Setting& setting : AllSettings()) {
    if (setting.role == SettingRole::kStopsJob) continue;
    if (SettingText(setting, overrides) != SettingText(setting, wanted.overrides)) {
      return OtherValue(setting);
    }
  }
  return absl::OkStatus();
}

// Whether a job is of this scene, and of all settings that are given and decide its pixels.
Status CheckSameJob(const v1::Job& job, const JobToSend& wanted) {
  if (job.scene_digest() != wanted.manifest.SceneDigest().Bytes()) {
    return absl::FailedPreconditionError(
        absl::StrCat("the scene is not the one of the job that was interrupted", kAnew));
  }
  if (job.has_bake() != wanted.bake.has_value()) {
    return absl::FailedPreconditionError(
        absl::StrCat("what was interrupted is ", job.has_bake() ? "a bake" : "no bake", kAnew));
  }
  if (wanted.bake) return CheckSameBake(job, wanted);
  const RenderSettings settings = SettingsOf(job);
  for (const Setting& setting : AllSettings()) {
    if (setting.role == SettingRole::kStopsJob || !IsGiven(setting, wanted.overrides)) continue;
    RenderSettings given = settings;
    ResolveSetting(setting, wanted.overrides, nullptr, given);
    if (given != settings) return OtherValue(setting);
  }
  return absl::OkStatus();
}

// Whether the job ends as `until` says, which gives at least one stop criterion.
StatusOr<bool> EndsAs(const v1::Job& job, const RenderOverrides& until) {
  if (job.has_bake()) {
    LUCERNA_ASSIGN_OR_RETURN(const RenderOverrides overrides, FromProto(job.bake().overrides()));
    return overrides.passes == until.passes && overrides.photons == until.photons &&
           overrides.time_s == until.time_s && overrides.error == until.error;
  }
  const RenderSettings settings = SettingsOf(job);
  RenderSettings changed = settings;
  LUCERNA_RETURN_IF_ERROR(SetStopCriteria(until, changed));
  return changed == settings;
}

// Shows a job as it moves on: redrawn in place on a terminal, else as plain lines, on stderr.
class Progress {
 public:
  Progress(ClientConnection& connection, const std::string& job_id,
           const OutputOptions& output_options)
      : redraws_(output_options.redraws && SizeOfTerminal(STDERR_FILENO).has_value()),
        display_(output_options.display) {
    if (!redraws_ || !output_options.previews) return;
    previews_.emplace([&connection, job_id](const std::function<bool()>& gives_up) {
      return connection.GetImage(job_id, gives_up);
    });
  }

  void Show(const v1::Job& job) {
    if (!redraws_) return Write(lines_.Update(job, SystemClock().Steady()));
    // The window may have a new size, or be gone.
    const TerminalSize size = SizeOfTerminal(STDERR_FILENO).value_or(TerminalSize());
    std::shared_ptr<const Image> image;
    // There is none before the first pass.
    if (previews_ && job.progress().passes() > 0) image = previews_->Newest();
    Write(frames_.Paint(LiveLines(job, image.get(), size, LocaleCharset(), display_), size));
  }
  void Finish() { Write(frames_.Finish()); }

 private:
  static void Write(const std::string& text) {
    PrintError(text);
    std::fflush(stderr);
  }

  bool redraws_;
  Display display_;
  ProgressPrinter lines_;
  FramePainter frames_;
  std::optional<PreviewSource> previews_;
};

// Shows a job's image in a viewer each time that there is a newer one.
class ViewerFeed {
 public:
  ViewerFeed(ClientConnection& connection, const std::string& job_id, TevView& viewer)
      : connection_(connection),
        job_id_(job_id),
        viewer_(viewer),
        source_([&connection, job_id](const std::function<bool()>& gives_up) {
          return connection.GetImage(job_id, gives_up);
        }) {}

  void Show(const v1::Job& job) {
    if (job.progress().passes() == 0) return;
    const std::shared_ptr<const Image> newest = source_.Newest();
    if (newest == nullptr || newest == shown_) return;
    shown_ = newest;
    viewer_.Show(NameOf(job), *newest);
  }
  void Finish(const v1::Job& job) {
    const StatusOr<std::string> bytes = connection_.GetImage(job_id_);
    if (!bytes.ok()) return;
    if (const StatusOr<Image> image = DecodeExr(*bytes); image.ok())
      viewer_.Show(NameOf(job), *image);
  }

 private:
  static std::string NameOf(const v1::Job& job) {
    return absl::StrCat(job.name(), " (", job.job_id(), ")");
  }

  ClientConnection& connection_;
  const std::string job_id_;
  TevView& viewer_;
  PreviewSource source_;
  std::shared_ptr<const Image> shown_;
};

}  // namespace

StatusOr<v1::SubmitResponse> SendJob(ClientConnection& connection, SceneFiles& files,
                                     const JobToSend& job) {
  LUCERNA_RETURN_IF_ERROR(connection.Upload(job.manifest, files));
  v1::SubmitRequest request;
  if (!job.reference_path.empty()) {
    LUCERNA_ASSIGN_OR_RETURN(const std::string reference, ReadFile(job.reference_path));
    LUCERNA_ASSIGN_OR_RETURN(const Digest digest, connection.UploadBytes(reference));
    request.set_reference_digest(std::string(digest.Bytes()));
  }
  // Only a retry of this submission has it, and finds its job.
  request.set_request_id(RandomId());
  *request.mutable_scene() = ToProto(job.manifest);
  *request.mutable_overrides() = ToProto(job.overrides);
  request.set_priority(job.priority);
  request.set_is_traced(job.is_traced);
  if (job.bake) *request.mutable_bake() = ToProto(*job.bake);
  return connection.Submit(request);
}

StatusOr<v1::Job> FollowToEnd(ClientConnection& connection, const std::string& job_id,
                              bool shows_progress, const OutputOptions& output_options,
                              const std::function<Status(const v1::Job&)>& check) {
  std::optional<Progress> progress;
  if (shows_progress && !output_options.quiet) progress.emplace(connection, job_id, output_options);
  std::optional<ViewerFeed> viewer;
  if (output_options.tev) viewer.emplace(connection, job_id, *output_options.tev);
  auto job = connection.Watch(job_id, [&](const v1::Job& newest) {
    if (viewer) viewer->Show(newest);
    // The summary reports the end.
    if (progress && newest.state() != v1::JOB_STATE_UNSPECIFIED && !HasEnded(newest.state())) {
      progress->Show(newest);
    }
    return check(newest);
  });
  if (progress) progress->Finish();
  if (viewer && job.ok()) viewer->Finish(*job);
  if (job.ok() && !output_options.quiet) {
    const std::string dropped = DroppedLine(*job);
    if (!dropped.empty()) PrintError(absl::StrCat("lucerna: warning: ", dropped, "\n"));
    // Warnings of the scene's files have a place and came when the scene was read.
    for (const std::string& warning : job->warnings()) {
      if (warning.starts_with("warning: ")) PrintError(absl::StrCat("lucerna: ", warning, "\n"));
    }
    for (const std::string& note : ErrorNotes(*job))
      PrintError(absl::StrCat("lucerna: ", note, "\n"));
  }
  return job;
}

Status CheckSucceeded(const v1::Job& job) {
  if (job.state() == v1::JOB_STATE_SUCCEEDED) return absl::OkStatus();
  if (job.state() == v1::JOB_STATE_CANCELLED) {
    return absl::FailedPreconditionError(absl::StrCat("job ", job.job_id(), " was cancelled"));
  }
  return absl::FailedPreconditionError(
      absl::StrCat("job ", job.job_id(), " failed: ", job.failure()));
}

StatusOr<Image> DecodeImageOf(const std::string& job_id, const std::string& bytes) {
  StatusOr<Image> image = DecodeExr(bytes);
  if (image.ok()) return image;
  return absl::DataLossError(absl::StrCat(
      "the image of job ", job_id, " arrived damaged; fetch it again: ", image.status().message()));
}

StatusOr<std::unique_ptr<LocalRuns>> LocalRuns::Start(const ClusterOptions& options) {
  auto runs = std::unique_ptr<LocalRuns>(new LocalRuns());
  runs->has_state_ = !options.state_folder.empty();
  LUCERNA_ASSIGN_OR_RETURN(runs->cluster_, LocalCluster::Start(options));
  LUCERNA_ASSIGN_OR_RETURN(runs->connection_,
                           ClientConnection::Open(Endpoint{runs->cluster_->address()}));
  return runs;
}

StatusOr<v1::Job> LocalRuns::Run(SceneFiles& files, JobToSend job,
                                 const OutputOptions& output_options) {
  job.is_traced = is_tracing_;
  LUCERNA_ASSIGN_OR_RETURN(const v1::SubmitResponse submitted, SendJob(*connection_, files, job));
  job_id_ = submitted.job_id();
  return FollowOwn(output_options);
}

StatusOr<v1::Job> LocalRuns::FollowOwn(const OutputOptions& output_options) {
  auto job =
      FollowToEnd(*connection_, job_id_, true, output_options, [this](const v1::Job& newest) {
        // No other client and no other worker knows of it, so that it would stay paused.
        if (newest.pause_cause() == v1::PAUSE_CAUSE_FAILED_BATCH ||
            newest.pause_cause() == v1::PAUSE_CAUSE_DISPUTE) {
          return absl::AbortedError(newest.condition());
        }
        if (on_news_) on_news_(newest);
        return cluster_->Check();
      });
  if (!job.ok()) {
    // The coordinator ends with us; cancelling first lets the workers leave at once. Whether it
    // still hears that makes no difference to the user.
    if (ExitCodeOf(job.status()) == ExitCode::kInterrupted && !has_state_) {
      connection_->Cancel(job_id_).IgnoreError();
    }
    return job;
  }
  LUCERNA_RETURN_IF_ERROR(CheckSucceeded(*job));
  return job;
}

StatusOr<std::size_t> LocalRuns::CountJobs() {
  LUCERNA_ASSIGN_OR_RETURN(const std::vector<v1::Job> jobs, connection_->List());
  return jobs.size();
}

StatusOr<v1::Job> LocalRuns::Resume(const JobToSend& wanted, const OutputOptions& output_options,
                                    std::size_t index) {
  // Newest first.
  LUCERNA_ASSIGN_OR_RETURN(const std::vector<v1::Job> jobs, connection_->List());
  if (index >= jobs.size())
    return absl::FailedPreconditionError("there is no render to go on with");
  const v1::Job& job = jobs[jobs.size() - 1 - index];
  LUCERNA_RETURN_IF_ERROR(CheckSameJob(job, wanted));
  job_id_ = job.job_id();
  RenderOverrides until;
  bool has_end = false;
  for (const Setting& setting : AllSettings()) {
    if (setting.role != SettingRole::kStopsJob || !IsGiven(setting, wanted.overrides)) continue;
    LUCERNA_RETURN_IF_ERROR(ParseSetting(setting, *SettingText(setting, wanted.overrides), until));
    has_end = true;
  }
  if (has_end) {
    // With another end a bake begins anew, and of a job that is over the photons may be gone.
    LUCERNA_ASSIGN_OR_RETURN(const bool ends_so, EndsAs(job, until));
    if (!ends_so) {
      const Status extended = connection_->Extend(job_id_, until).status();
      if (absl::IsFailedPrecondition(extended)) {
        return absl::FailedPreconditionError(absl::StrCat(
            "the job that was interrupted has ended, with other stop criteria", kAnew));
      }
      LUCERNA_RETURN_IF_ERROR(extended);
    }
  }
  if (job.state() == v1::JOB_STATE_PAUSED) {
    LUCERNA_RETURN_IF_ERROR(connection_->Resume(job_id_).status());
  }
  return FollowOwn(output_options);
}

StatusOr<v1::Job> LocalRuns::Run(const std::string& scene_path, const SceneManifest& manifest,
                                 const RenderOverrides& overrides,
                                 const std::string& reference_path,
                                 const OutputOptions& output_options) {
  DirectoryFiles files(SplitScenePath(scene_path).folder);
  return Run(files, {manifest, overrides, reference_path}, output_options);
}

StatusOr<Image> LocalRuns::ImageOf(const v1::Job& job) {
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, connection_->GetImage(job.job_id()));
  return DecodeImageOf(job.job_id(), bytes);
}

}  // namespace lucerna
