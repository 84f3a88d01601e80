#include "client/job_commands.h"

#include <cstdio>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_join.h"
#include <unistd.h>

#include "client/connection.h"
#include "client/exit_code.h"
#include "client/progress_view.h"
#include "client/report.h"
#include "client/scene_reading.h"
#include "render/base/clock.h"
#include "render/base/files.h"
#include "render/film/png_file.h"
#include "render/image/exr_file.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

void Print(const std::string& text) {
  std::fputs(text.c_str(), stdout);
}

Status CheckOutputs(const OutputPaths& outputs) {
  if (!outputs.exr.empty() && !outputs.png.empty() && IsSameFile(outputs.exr, outputs.png)) {
    return Failure(ExitCode::kUsage,
                   absl::StrCat("-o and --png both name ", outputs.exr,
                                "; give the EXR and the PNG a file of its own each"));
  }
  for (const std::string& path : {outputs.exr, outputs.png}) {
    if (!path.empty()) LUCERNA_RETURN_IF_ERROR(CheckWritable(path));
  }
  return absl::OkStatus();
}

// Unlike any other submission's, so that only a retry of this one finds its job.
std::string NewRequestId(const SceneManifest& manifest) {
  char host[65] = {};
  ::gethostname(host, sizeof(host) - 1);
  const Digest digest = Sha256(absl::StrCat(manifest.SceneDigest().Hex(), host, "/", ::getpid(),
                                            "/", SystemClock().Wall().time_since_epoch().count()));
  return digest.Hex();
}

StatusOr<v1::SubmitResponse> SendJob(ClientConnection& connection, const std::string& scene_path,
                                     const SceneManifest& manifest,
                                     const RenderOverrides& overrides) {
  DirectoryFiles files(SplitScenePath(scene_path).folder);
  LUCERNA_RETURN_IF_ERROR(connection.Upload(manifest, files));
  v1::SubmitRequest request;
  request.set_request_id(NewRequestId(manifest));
  *request.mutable_scene() = ToProto(manifest);
  *request.mutable_overrides() = ToProto(overrides);
  return connection.Submit(request);
}

// Follows the job to its end. `check` is asked several times a second.
StatusOr<v1::Job> FollowToEnd(ClientConnection& connection, const std::string& job_id,
                              bool shows_progress, const std::function<Status()>& check) {
  ProgressPrinter printer(::isatty(STDERR_FILENO) == 1);
  const auto write = [&](const std::string& text) {
    if (!shows_progress) return;
    std::fputs(text.c_str(), stderr);
    std::fflush(stderr);
  };
  auto job = connection.Watch(job_id, [&](const v1::Job& newest) {
    // Of the end tells the summary.
    if (newest.state() != v1::JOB_STATE_UNSPECIFIED && !HasEnded(newest.state())) {
      write(printer.Update(newest, SystemClock().Steady()));
    }
    return check();
  });
  write(printer.Finish());
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

// Fetches the image, makes sure that it is one, and writes it.
StatusOr<SavedImage> Save(ClientConnection& connection, const std::string& job_id,
                          const OutputPaths& outputs) {
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, connection.GetImage(job_id));
  const StatusOr<Image> image = DecodeExr(bytes);
  if (!image.ok()) {
    return absl::DataLossError(
        absl::StrCat("the image of job ", job_id,
                     " arrived damaged; fetch it again: ", image.status().message()));
  }
  SavedImage saved;
  saved.digest = image->PixelDigest();
  if (!outputs.exr.empty()) {
    LUCERNA_RETURN_IF_ERROR(WriteFile(outputs.exr, bytes));
    saved.paths.push_back(outputs.exr);
  }
  if (!outputs.png.empty()) {
    LUCERNA_ASSIGN_OR_RETURN(const std::string png, EncodePng(*image));
    LUCERNA_RETURN_IF_ERROR(WriteFile(outputs.png, png));
    saved.paths.push_back(outputs.png);
  }
  return saved;
}

Status SaveAndReport(ClientConnection& connection, const v1::Job& job, const OutputPaths& outputs,
                     const Voice& voice) {
  LUCERNA_RETURN_IF_ERROR(CheckSucceeded(job));
  LUCERNA_ASSIGN_OR_RETURN(const SavedImage saved, Save(connection, job.job_id(), outputs));
  if (voice.json) {
    Print(JobReport(job, saved));
  } else if (!voice.quiet) {
    Print(absl::StrCat(SummaryLine(job), ": ", absl::StrJoin(saved.paths, ", "), "\n"));
  }
  return absl::OkStatus();
}

Status Nothing() {
  return absl::OkStatus();
}

}  // namespace

Status Render(const RenderRequest& request, const ClusterOptions& cluster_options,
              const Voice& voice) {
  LUCERNA_ASSIGN_OR_RETURN(const RenderOverrides overrides, ToOverrides(request.flags));
  LUCERNA_RETURN_IF_ERROR(CheckOutputs(request.outputs));
  LUCERNA_ASSIGN_OR_RETURN(const SceneManifest manifest,
                           ReadScene(request.scene_path, overrides, voice.quiet));
  LUCERNA_ASSIGN_OR_RETURN(const auto cluster, LocalCluster::Start(cluster_options));
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(cluster->address()));
  LUCERNA_ASSIGN_OR_RETURN(const v1::SubmitResponse submitted,
                           SendJob(*connection, request.scene_path, manifest, overrides));
  const auto job =
      FollowToEnd(*connection, submitted.job_id(), !voice.quiet, [&] { return cluster->Check(); });
  if (!job.ok()) {
    // The coordinator ends with us; cancelling first lets the workers leave at once. Whether it
    // still hears that makes no difference to the user.
    if (ExitCodeOf(job.status()) == ExitCode::kInterrupted) {
      connection->Cancel(submitted.job_id()).IgnoreError();
    }
    return job.status();
  }
  return SaveAndReport(*connection, *job, request.outputs, voice);
}

Status Submit(const RenderRequest& request, const std::string& server, const Voice& voice) {
  LUCERNA_ASSIGN_OR_RETURN(const RenderOverrides overrides, ToOverrides(request.flags));
  LUCERNA_RETURN_IF_ERROR(CheckOutputs(request.outputs));
  LUCERNA_ASSIGN_OR_RETURN(const SceneManifest manifest,
                           ReadScene(request.scene_path, overrides, voice.quiet));
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  LUCERNA_ASSIGN_OR_RETURN(const v1::SubmitResponse submitted,
                           SendJob(*connection, request.scene_path, manifest, overrides));
  if (request.outputs.empty()) {
    Print(voice.json ? SubmittedReport(submitted) : submitted.job_id() + "\n");
    return absl::OkStatus();
  }
  const auto job = FollowToEnd(*connection, submitted.job_id(), !voice.quiet, Nothing);
  if (!job.ok()) {
    if (ExitCodeOf(job.status()) != ExitCode::kInterrupted) return job.status();
    return Failure(ExitCode::kInterrupted,
                   absl::StrCat("interrupted; job ", submitted.job_id(),
                                " goes on, see lucerna watch and lucerna cancel"));
  }
  return SaveAndReport(*connection, *job, request.outputs, voice);
}

Status ListJobs(const std::string& server, const Voice& voice) {
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  LUCERNA_ASSIGN_OR_RETURN(const std::vector<v1::Job> jobs, connection->List());
  if (voice.json) {
    Print(JobsReport(jobs));
    return absl::OkStatus();
  }
  Print(TableHead() + "\n");
  for (const v1::Job& job : jobs)
    Print(TableLine(job) + "\n");
  return absl::OkStatus();
}

Status Follow(const std::string& job_id, bool shows_progress, const std::string& server,
              const Voice& voice) {
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  LUCERNA_ASSIGN_OR_RETURN(
      const v1::Job job, FollowToEnd(*connection, job_id, shows_progress && !voice.quiet, Nothing));
  if (voice.json) {
    Print(JobReport(job));
  } else if (!voice.quiet) {
    Print(SummaryLine(job) + "\n");
  }
  return CheckSucceeded(job);
}

Status Fetch(const std::string& job_id, const OutputPaths& outputs, const std::string& server,
             const Voice& voice) {
  LUCERNA_RETURN_IF_ERROR(CheckOutputs(outputs));
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  LUCERNA_ASSIGN_OR_RETURN(const SavedImage saved, Save(*connection, job_id, outputs));
  if (voice.json) {
    Print(SavedReport(job_id, saved));
  } else if (!voice.quiet) {
    Print(absl::StrJoin(saved.paths, "\n") + "\n");
  }
  return absl::OkStatus();
}

Status Cancel(const std::string& job_id, const std::string& server, const Voice& voice) {
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  LUCERNA_ASSIGN_OR_RETURN(const v1::Job job, connection->Cancel(job_id));
  if (voice.json) {
    Print(JobReport(job));
  } else if (!voice.quiet) {
    Print(absl::StrCat("job ", job.job_id(), " ", NameOf(job.state()), "\n"));
  }
  return absl::OkStatus();
}

}  // namespace lucerna
