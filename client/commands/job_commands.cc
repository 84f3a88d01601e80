#include "client/commands/job_commands.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <map>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"

#include "client/bake/mesh_render.h"
#include "client/checkpoints.h"
#include "client/connection.h"
#include "client/exit_code.h"
#include "client/frames.h"
#include "client/image_output.h"
#include "client/interruption.h"
#include "client/job_run.h"
#include "client/render_flags.h"
#include "client/scene_reading.h"
#include "client/usage.h"
#include "client/view/report.h"
#include "render/bake/mesh_file.h"
#include "render/base/clock.h"
#include "render/base/console.h"
#include "render/base/escape.h"
#include "render/base/files.h"
#include "render/film/png_file.h"
#include "render/image/exr_file.h"
#include "render/report/progress_view.h"
#include "render/report/report_page.h"

namespace lucerna {
namespace {

// Fetches the image, makes sure that it is one, and writes it.
StatusOr<SavedImage> Save(ClientConnection& connection, const std::string& job_id,
                          const OutputPaths& outputs, const Display& display) {
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, connection.GetImage(job_id));
  LUCERNA_ASSIGN_OR_RETURN(const Image image, DecodeImageOf(job_id, bytes));
  return WriteOutputs(image, bytes, outputs, display);
}

// Writes the image so far from time to time. What fails is said once, and tried again.
class PeriodicSave {
 public:
  PeriodicSave(const RenderRequest& request, const Display& display)
      : request_(request), display_(display), last_(SystemClock().Steady()) {}

  void Consider(ClientConnection& connection, const v1::Job& job) {
    const std::chrono::duration<double> since = SystemClock().Steady() - last_;
    if (!(request_.save_every_s > 0) || since.count() < request_.save_every_s) return;
    if (job.progress().passes() == 0 || HasEnded(job.state())) return;
    const Status status = Save(connection, job.job_id(), request_.outputs, display_).status();
    // From here, so that a slow disk does not take all of the time.
    last_ = SystemClock().Steady();
    if (!status.ok() && !has_warned_) {
      PrintError(absl::StrCat("lucerna: warning: the image so far was not saved: ",
                              EscapedLines(std::string(status.message())), "\n"));
    }
    has_warned_ = !status.ok();
  }

 private:
  const RenderRequest& request_;
  const Display& display_;
  SteadyTime last_;
  bool has_warned_ = false;
};

Status SaveAndReport(ClientConnection& connection, const v1::Job& job, const OutputPaths& outputs,
                     const OutputOptions& output_options) {
  LUCERNA_RETURN_IF_ERROR(CheckSucceeded(job));
  LUCERNA_ASSIGN_OR_RETURN(const SavedImage saved,
                           Save(connection, job.job_id(), outputs, output_options.display));
  if (output_options.json) {
    PrintData(JobReport(job, saved, output_options.detail));
  } else if (!output_options.quiet) {
    PrintText(absl::StrCat(SummaryLine(job), ": ", absl::StrJoin(saved.paths, ", "), "\n"));
  }
  return absl::OkStatus();
}

Status Nothing(const v1::Job& /*job*/) {
  return absl::OkStatus();
}

// Writes the timeline of a job that has ended, however that was.
Status SaveTrace(ClientConnection& connection, const std::string& job_id, const std::string& path) {
  if (path.empty()) return absl::OkStatus();
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, connection.GetTrace(job_id));
  return WriteFile(path, bytes);
}

Status CheckTrace(const RenderRequest& request) {
  if (request.trace.empty()) return absl::OkStatus();
  if (!request.trace.ends_with(".json")) {
    return Failure(ExitCode::kUsage, absl::StrCat("--trace ", request.trace,
                                                  ": a timeline is a .json file; name one"));
  }
  return CheckMayWrite(request.trace, "traceEvents");
}

// Empty when none are wanted.
std::string CheckpointFolder(const RenderRequest& request) {
  if (!request.keeps_checkpoints) return "";
  const OutputPaths& outputs = request.outputs;
  return CheckpointFolderOf(outputs.image.empty() ? outputs.png : outputs.image);
}

// After an interruption: the image so far, and how to go on.
Status EndInterrupted(LocalRuns& runs, const RenderRequest& request, bool has_checkpoints,
                      const Display& display) {
  if (!has_checkpoints) return Failure(ExitCode::kInterrupted, "interrupted");
  ClearInterruption();
  std::string message = "interrupted before the first image";
  if (!runs.job_id().empty()) {
    // A large one takes a minute.
    PrintError("lucerna: interrupted; saving the image so far (interrupt again to leave it)\n");
    if (const auto saved = Save(runs.connection(), runs.job_id(), request.outputs, display);
        saved.ok()) {
      message = absl::StrCat("interrupted; the image so far is in ",
                             absl::StrJoin(saved->paths, " and "));
    } else if (!absl::IsFailedPrecondition(saved.status())) {
      message = absl::StrCat("interrupted; the image so far cannot be had: ",
                             std::string(saved.status().message()));
    }
  }
  return Failure(ExitCode::kInterrupted,
                 absl::StrCat(message, "; the same command with --resume goes on"));
}

}  // namespace

StatusOr<std::vector<RenderRequest>> RequestsOf(const RenderRequest& request,
                                                const std::vector<std::string>& scenes,
                                                std::string_view frames, bool names_images) {
  LUCERNA_ASSIGN_OR_RETURN(const std::vector<SceneFrame> found, FramesOf(scenes, frames));
  std::vector<RenderRequest> requests;
  std::map<std::string, std::size_t> images;  // and which request writes them
  for (const SceneFrame& frame : found) {
    RenderRequest& one = requests.emplace_back(request);
    one.scene.path = frame.scene;
    one.outputs.image = WithFrameNumber(request.outputs.image, frame.number);
    one.outputs.png = WithFrameNumber(request.outputs.png, frame.number);
    one.mesh = WithFrameNumber(request.mesh, frame.number);
    one.trace = WithFrameNumber(request.trace, frame.number);
    if (names_images && one.outputs.empty()) one.outputs.image = ImageNameOf(frame.scene);
    for (const std::string& image : {one.outputs.image, one.outputs.png, one.trace}) {
      // Both images of one request: CheckOutputs.
      const auto known = images.emplace(image, requests.size()).first;
      if (image.empty() || known->second == requests.size()) continue;
      return Failure(
          ExitCode::kUsage,
          absl::StrCat("two scenes would be written to ", image,
                       "; put #### in its name, which the number of the frame replaces"));
    }
  }
  return requests;
}

namespace {

// Of a render without photons, most settings mean nothing.
Status CheckRequestOfMesh(const RenderRequest& request) {
  constexpr std::array<std::string_view, 5> kMeaningful = {"size", "crop", "passes", "seed",
                                                           "max_depth"};
  for (const Setting& setting : AllSettings()) {
    if (!IsGiven(setting, request.overrides)) continue;
    if (std::ranges::count(kMeaningful, setting.name) > 0) continue;
    return Failure(ExitCode::kUsage, absl::StrCat(FlagOf(setting),
                                                  " has no meaning with --from-mesh, which traces "
                                                  "no photons; leave it away"));
  }
  if (request.save_every_s > 0) {
    return Failure(ExitCode::kUsage,
                   "--save-every has no meaning with --from-mesh, which writes its image at once; "
                   "leave it away");
  }
  if (!request.trace.empty()) {
    return Failure(ExitCode::kUsage,
                   "--trace has no meaning with --from-mesh, which starts no job; leave it away");
  }
  if (!request.reference.empty() || request.resumes) {
    return Failure(ExitCode::kUsage, absl::StrCat(request.resumes ? "--resume" : "--reference",
                                                  " has no meaning with --from-mesh; leave it "
                                                  "away, and compare with lucerna diff"));
  }
  return absl::OkStatus();
}

Status DrawMesh(const RenderRequest& request, int threads, const OutputOptions& output_options) {
  LUCERNA_RETURN_IF_ERROR(CheckRequestOfMesh(request));
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, ReadFile(request.mesh));
  LUCERNA_ASSIGN_OR_RETURN(const BakedMesh mesh, ReadMeshGlb(request.mesh, bytes));
  Scene scene;
  LUCERNA_ASSIGN_OR_RETURN(
      const SceneOfJobs read,
      ReadSceneOfJobs(request.scene, {&request.overrides, 1}, output_options.quiet, &scene));
  LUCERNA_ASSIGN_OR_RETURN(MeshRender render,
                           RenderFromMesh(scene, read.settings.front(), mesh, threads));
  render.image.metadata["lucerna.scene_digest"] = read.manifest.SceneDigest().Hex();
  render.image.metadata["lucerna.mesh_digest"] = Sha256(bytes).Hex();
  LUCERNA_ASSIGN_OR_RETURN(const std::string exr, EncodeExr(render.image));
  LUCERNA_ASSIGN_OR_RETURN(const SavedImage saved, WriteOutputs(render.image, exr, request.outputs,
                                                                output_options.display));
  if (render.share_unknown > 0 && !output_options.quiet) {
    PrintError(absl::StrFormat(
        "lucerna: warning: for %.2g %% of what is seen the mesh has no light, which is black; bake "
        "all surfaces, with --sides both where both are seen\n",
        100 * render.share_unknown));
  }
  if (output_options.json) {
    PrintData(MeshRenderReport(read.settings.front().passes, render.share_unknown, saved));
  } else if (!output_options.quiet) {
    PrintText(absl::StrCat(read.settings.front().passes,
                           " passes without photons: ", absl::StrJoin(saved.paths, ", "), "\n"));
  }
  return absl::OkStatus();
}

Status RenderOne(const RenderRequest& request, const ClusterOptions& cluster_options,
                 const OutputOptions& output_options) {
  LUCERNA_RETURN_IF_ERROR(CheckOutputs(request.outputs));
  LUCERNA_RETURN_IF_ERROR(CheckTrace(request));
  if (!request.trace.empty() && request.resumes) {
    return Failure(ExitCode::kUsage,
                   "--trace has no meaning with --resume: what was done before the interruption is "
                   "not known any more; leave it away");
  }
  if (!request.mesh.empty()) return DrawMesh(request, cluster_options.threads, output_options);
  LUCERNA_ASSIGN_OR_RETURN(const SceneManifest manifest,
                           ReadScene(request.scene, request.overrides, output_options.quiet));
  ClusterOptions options = cluster_options;
  options.state_folder = CheckpointFolder(request);
  const std::string& folder = options.state_folder;
  LUCERNA_RETURN_IF_ERROR(OpenCheckpoints(folder, request.resumes, "render"));
  StatusOr<v1::Job> job;
  Status traced;
  {
    LUCERNA_ASSIGN_OR_RETURN(const auto runs, LocalRuns::Start(options));
    DirectoryFiles files = FilesOf(request.scene);
    PeriodicSave periodic(request, output_options.display);
    if (!request.trace.empty()) runs->TraceJobs();
    runs->WhileItRuns(
        [&](const v1::Job& newest) { periodic.Consider(runs->connection(), newest); });
    job = request.resumes
              ? runs->Resume({manifest, request.overrides}, output_options)
              : runs->Run(files, {manifest, request.overrides, request.reference}, output_options);
    if (ExitCodeOf(job.status()) == ExitCode::kInterrupted) {
      return EndInterrupted(*runs, request, !folder.empty(), output_options.display);
    }
    // Of a job that failed too.
    if (!runs->job_id().empty())
      traced = SaveTrace(runs->connection(), runs->job_id(), request.trace);
    if (job.ok()) {
      // What cannot be written now is still in the folder.
      LUCERNA_RETURN_IF_ERROR(
          SaveAndReport(runs->connection(), *job, request.outputs, output_options));
    }
  }
  const Status status = CloseCheckpoints(folder, request.resumes, job.status());
  return status.ok() ? traced : status;
}

}  // namespace

Status Render(const std::vector<RenderRequest>& requests, const ClusterOptions& cluster,
              const OutputOptions& output_options) {
  for (RenderRequest request : requests) {
    std::error_code ignored;
    if (request.resumes && requests.size() > 1 && !HasCheckpoints(CheckpointFolder(request))) {
      const OutputPaths& outputs = request.outputs;
      if (std::filesystem::exists(outputs.image.empty() ? outputs.png : outputs.image, ignored))
        continue;
      request.resumes = false;
    }
    LUCERNA_RETURN_IF_ERROR(RenderOne(request, cluster, output_options));
  }
  return absl::OkStatus();
}

Status Submit(const RenderRequest& request, const Endpoint& server,
              const OutputOptions& output_options) {
  LUCERNA_RETURN_IF_ERROR(CheckOutputs(request.outputs));
  if (request.save_every_s > 0 && request.outputs.empty()) {
    return Failure(ExitCode::kUsage, "--save-every needs a file to write to; give one with -o");
  }
  LUCERNA_RETURN_IF_ERROR(CheckTrace(request));
  if (!request.trace.empty() && request.outputs.empty()) {
    return Failure(
        ExitCode::kUsage,
        "--trace is written when the job has ended, so submit must wait for it; name its "
        "image with -o");
  }
  LUCERNA_ASSIGN_OR_RETURN(const SceneManifest manifest,
                           ReadScene(request.scene, request.overrides, output_options.quiet));
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  DirectoryFiles files = FilesOf(request.scene);
  LUCERNA_ASSIGN_OR_RETURN(const v1::SubmitResponse submitted,
                           SendJob(*connection, files,
                                   {manifest, request.overrides, request.reference,
                                    request.priority, !request.trace.empty()}));
  if (request.outputs.empty()) {
    PrintData(output_options.json ? SubmittedReport(submitted) : submitted.job_id() + "\n");
    return absl::OkStatus();
  }
  PeriodicSave periodic(request, output_options.display);
  const auto job = FollowToEnd(*connection, submitted.job_id(), true, output_options,
                               [&](const v1::Job& newest) {
                                 periodic.Consider(*connection, newest);
                                 return absl::OkStatus();
                               });
  if (!job.ok()) {
    if (ExitCodeOf(job.status()) != ExitCode::kInterrupted) return job.status();
    return Failure(ExitCode::kInterrupted,
                   absl::StrCat("interrupted; job ", submitted.job_id(),
                                " goes on, see lucerna watch and lucerna cancel"));
  }
  const Status traced = SaveTrace(*connection, submitted.job_id(), request.trace);
  LUCERNA_RETURN_IF_ERROR(SaveAndReport(*connection, *job, request.outputs, output_options));
  return traced;
}

namespace {

// Of a name as NameOf gives it, in any case.
StatusOr<v1::JobState> StateNamed(const std::string& name) {
  v1::JobState state{};
  if (v1::JobState_Parse("JOB_STATE_" + absl::AsciiStrToUpper(name), &state) &&
      state != v1::JOB_STATE_UNSPECIFIED) {
    return state;
  }
  return Failure(ExitCode::kUsage,
                 absl::StrCat("--state ", name,
                              ": give queued, preparing, running, paused, succeeded, cancelled or "
                              "failed"));
}

}  // namespace

Status ListJobs(const JobsRequest& request, const Endpoint& server,
                const OutputOptions& output_options) {
  v1::ListJobsRequest filter;
  for (const std::string& name : request.states) {
    LUCERNA_ASSIGN_OR_RETURN(const v1::JobState state, StateNamed(name));
    filter.add_states(state);
  }
  filter.set_owner(request.user);
  filter.set_name_contains(request.name_contains);
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  LUCERNA_ASSIGN_OR_RETURN(const std::vector<v1::Job> jobs, connection->List(filter));
  if (output_options.json) {
    PrintData(JobsReport(jobs, output_options.detail));
    return absl::OkStatus();
  }
  PrintText(TableHead() + "\n");
  for (const v1::Job& job : jobs)
    PrintText(TableLine(job) + "\n");
  return absl::OkStatus();
}

Status Follow(const std::string& job_id, bool shows_progress, const Endpoint& server,
              const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  LUCERNA_ASSIGN_OR_RETURN(
      const v1::Job job, FollowToEnd(*connection, job_id, shows_progress, output_options, Nothing));
  if (output_options.json) {
    PrintData(JobReport(job, output_options.detail));
  } else if (!output_options.quiet) {
    PrintText(SummaryLine(job) + "\n");
  }
  return CheckSucceeded(job);
}

Status Fetch(const std::string& job_id, const OutputPaths& outputs, BakeOutputs of_bake,
             const Endpoint& server, const OutputOptions& output_options) {
  of_bake.path = outputs.image;
  const bool names_mesh = of_bake.path.ends_with(".glb") || of_bake.path.ends_with(".ply");
  if (!names_mesh) LUCERNA_RETURN_IF_ERROR(CheckOutputs(outputs));
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  LUCERNA_ASSIGN_OR_RETURN(const v1::Job job, connection->Get(job_id));
  if (job.has_bake()) {
    if (!outputs.png.empty()) {
      return Failure(ExitCode::kUsage, "--png is of images, and a bake has none; leave it away");
    }
    LUCERNA_RETURN_IF_ERROR(CheckBakeOutputs(of_bake));
    return SaveBake(*connection, job, of_bake, output_options);
  }
  if (names_mesh || of_bake.is_ascii || !of_bake.plan.empty() || !of_bake.uv_mesh.empty()) {
    return Failure(ExitCode::kUsage,
                   absl::StrCat("job ", job_id,
                                " renders an image and no mesh; give -o an image's name, and leave "
                                "--ascii, --plan and --uv-mesh away"));
  }
  LUCERNA_ASSIGN_OR_RETURN(const SavedImage saved,
                           Save(*connection, job_id, outputs, output_options.display));
  if (output_options.json) {
    PrintData(SavedReport(job_id, saved));
  } else if (!output_options.quiet) {
    PrintData(absl::StrJoin(saved.paths, "\n") + "\n");
  }
  return absl::OkStatus();
}

namespace {

// The job's image for a page; absent when it has none.
StatusOr<std::optional<PageImage>> ImageOf(ClientConnection& connection, const std::string& job_id,
                                           const Display& display) {
  const StatusOr<std::string> bytes = connection.GetImage(job_id);
  // No pass is merged yet, or the image was dropped: the rest of the report is worth having.
  if (absl::IsFailedPrecondition(bytes.status())) return std::optional<PageImage>();
  LUCERNA_RETURN_IF_ERROR(bytes.status());
  LUCERNA_ASSIGN_OR_RETURN(const Image image, DecodeExr(*bytes));
  LUCERNA_ASSIGN_OR_RETURN(std::string png, EncodePng(image, display));
  return std::optional<PageImage>({std::move(png), image.PixelDigest()});
}

}  // namespace

Status Report(const std::string& job_id, const ReportPaths& paths, const Endpoint& server,
              const OutputOptions& output_options) {
  if (!paths.html.empty() && !paths.csv.empty() && IsSameFile(paths.html, paths.csv)) {
    return Failure(ExitCode::kUsage,
                   absl::StrCat("-o and --csv both name ", paths.html,
                                "; give the page and the table a file of its own each"));
  }
  for (const std::string& path : {paths.html, paths.csv}) {
    if (!path.empty()) LUCERNA_RETURN_IF_ERROR(CheckWritable(path));
  }
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  LUCERNA_ASSIGN_OR_RETURN(const v1::Job job, connection->Get(job_id));
  std::vector<std::string> written;
  if (!paths.html.empty()) {
    std::optional<PageImage> image;
    if (!job.has_bake()) {
      LUCERNA_ASSIGN_OR_RETURN(image, ImageOf(*connection, job_id, output_options.display));
    }
    LUCERNA_RETURN_IF_ERROR(WriteFile(paths.html, ReportPage(job, image)));
    written.push_back(paths.html);
  }
  if (!paths.csv.empty()) {
    LUCERNA_RETURN_IF_ERROR(WriteFile(paths.csv, ConvergenceCsv(job)));
    written.push_back(paths.csv);
  }
  if (output_options.json) {
    PrintData(ConvergenceReport(job));
  } else if (!output_options.quiet) {
    PrintData(absl::StrJoin(written, "\n") + "\n");
  }
  return absl::OkStatus();
}

namespace {

// Prints the state of a job after a command changed it.
Status Acknowledge(const StatusOr<v1::Job>& job, const OutputOptions& output_options) {
  if (!job.ok()) return job.status();
  if (output_options.json) {
    PrintData(JobReport(*job, output_options.detail));
  } else if (!output_options.quiet) {
    PrintText(absl::StrCat("job ", job->job_id(), " ", NameOf(job->state()), "\n"));
  }
  return absl::OkStatus();
}

}  // namespace

Status PauseJob(const std::string& job_id, const Endpoint& server,
                const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  return Acknowledge(connection->Pause(job_id), output_options);
}

Status ResumeJob(const std::string& job_id, const Endpoint& server,
                 const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  return Acknowledge(connection->Resume(job_id), output_options);
}

Status SetPriority(const std::string& job_id, int priority, const Endpoint& server,
                   const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  return Acknowledge(connection->SetPriority(job_id, priority), output_options);
}

Status Cancel(const std::string& job_id, const Endpoint& server,
              const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  return Acknowledge(connection->Cancel(job_id), output_options);
}

Status DeleteJob(const std::string& job_id, const Endpoint& server,
                 const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  LUCERNA_RETURN_IF_ERROR(connection->Delete(job_id));
  if (!output_options.quiet) PrintText(absl::StrCat("job ", job_id, " is deleted\n"));
  return absl::OkStatus();
}

Status StopJob(const std::string& job_id, const Endpoint& server,
               const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  return Acknowledge(connection->Stop(job_id), output_options);
}

Status Extend(const std::string& job_id, const RenderOverrides& until, const Endpoint& server,
              const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  return Acknowledge(connection->Extend(job_id, until), output_options);
}

}  // namespace lucerna
