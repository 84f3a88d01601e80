#include "client/commands/bake_command.h"

#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"

#include "client/bake/irradiance_plan.h"
#include "client/checkpoints.h"
#include "client/exit_code.h"
#include "client/job_run.h"
#include "client/view/report.h"
#include "render/bake/mesh_file.h"
#include "render/bake/surface_figures.h"
#include "render/base/console.h"
#include "render/base/files.h"
#include "render/report/convergence.h"
#include "render/report/progress_view.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

bool IsPly(const std::string& path) {
  return path.ends_with(".ply");
}
bool IsLightMap(const std::string& path) {
  return path.ends_with(".exr");
}

// Without a path only the job is submitted.
Status CheckRequest(const BakeRequest& request, bool is_on_server) {
  const BakeOutputs& outputs = request.outputs;
  if (outputs.path.empty()) {
    if (!is_on_server) {
      return Failure(ExitCode::kUsage, "name the file to write with -o");
    }
    if (!outputs.plan.empty() || !outputs.uv_mesh.empty() || outputs.is_ascii) {
      return Failure(ExitCode::kUsage,
                     "--plan, --uv-mesh and --ascii are of what is written; name it with -o");
    }
  } else {
    LUCERNA_RETURN_IF_ERROR(CheckBakeOutputs(outputs));
    if (request.settings.is_light_map && !IsLightMap(outputs.path)) {
      return Failure(ExitCode::kUsage, "a light map is an .exr file; give -o one");
    }
  }
  if (IsSameFile(outputs.path, request.scene.path)) {
    return Failure(ExitCode::kUsage,
                   absl::StrCat(outputs.path, " is the scene; name another file with -o"));
  }
  if (request.resumes && is_on_server) {
    return Failure(ExitCode::kUsage,
                   "--resume is for bakes on this machine; a job on a coordinator goes on there");
  }
  return absl::OkStatus();
}

// As it is printed, after the figures.
void PrintFigures(const v1::Job& job, bool in_lux, const std::string& path) {
  const v1::Bake& bake = job.bake();
  std::vector<SurfaceFigures> figures;
  for (const v1::SurfaceFigures& message : bake.surfaces())
    figures.push_back(FromProto(message));
  std::string text = FiguresTable(figures, in_lux);
  if (const auto error = NewestError(job)) {
    absl::StrAppendFormat(&text, "estimated error %.2g %% (95 %%: %.2g %% to %.2g %%)",
                          100 * error->value, 100 * error->low, 100 * error->high);
  } else {
    text += "no estimate of the error";
  }
  if (bake.has_interpolation_error()) {
    absl::StrAppendFormat(&text, "; between vertices the mesh differs by %.2g %% of the mean",
                          100 * bake.interpolation_error());
  }
  PrintText(absl::StrCat(text, ": ", path, "\n"));
}

// Says when a round begins.
class RoundLines {
 public:
  explicit RoundLines(bool is_quiet) : is_quiet_(is_quiet) {}
  void Show(const v1::Job& job) {
    // A bake that begins anew.
    if (job.bake().rounds_size() < shown_) shown_ = 0;
    for (; shown_ < job.bake().rounds_size(); ++shown_) {
      const v1::BakeRound& round = job.bake().rounds(shown_);
      if (!is_quiet_) {
        PrintError(absl::StrCat(round.name(), ": ", round.points(),
                                round.points() == 1 ? " point\n" : " points\n"));
      }
    }
  }

 private:
  const bool is_quiet_;
  int shown_ = 0;
};

Status BakeOnServer(const BakeRequest& request, SceneFiles& files, const JobToSend& job,
                    const Endpoint& server, const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  LUCERNA_ASSIGN_OR_RETURN(const v1::SubmitResponse submitted, SendJob(*connection, files, job));
  LUCERNA_ASSIGN_OR_RETURN(const v1::Job begun, connection->Get(submitted.job_id()));
  if (!begun.has_bake()) {
    connection->Cancel(submitted.job_id()).IgnoreError();
    return absl::FailedPreconditionError(
        "the coordinator is of an earlier version of Lucerna, whose jobs are images alone");
  }
  if (request.outputs.path.empty()) {
    PrintData(output_options.json ? SubmittedReport(submitted) : submitted.job_id() + "\n");
    return absl::OkStatus();
  }
  RoundLines lines(output_options.quiet);
  const StatusOr<v1::Job> ended = FollowToEnd(*connection, submitted.job_id(), true, output_options,
                                              [&](const v1::Job& newest) {
                                                lines.Show(newest);
                                                return absl::OkStatus();
                                              });
  if (ExitCodeOf(ended.status()) == ExitCode::kInterrupted) {
    return Failure(ExitCode::kInterrupted,
                   absl::StrCat("interrupted; job ", submitted.job_id(),
                                " goes on, see lucerna watch, fetch and cancel"));
  }
  LUCERNA_RETURN_IF_ERROR(ended.status());
  return SaveBake(*connection, *ended, request.outputs, output_options);
}

Status BakeHere(const BakeRequest& request, SceneFiles& files, const JobToSend& job,
                ClusterOptions cluster, const OutputOptions& output_options) {
  cluster.state_folder = CheckpointFolderOf(request.outputs.path);
  LUCERNA_RETURN_IF_ERROR(OpenCheckpoints(cluster.state_folder, request.resumes, "bake"));
  Status status;
  {
    LUCERNA_ASSIGN_OR_RETURN(const auto runs, LocalRuns::Start(cluster));
    RoundLines lines(output_options.quiet);
    runs->WhileItRuns([&](const v1::Job& newest) { lines.Show(newest); });
    const StatusOr<v1::Job> ended =
        request.resumes ? runs->Resume(job, output_options) : runs->Run(files, job, output_options);
    if (ExitCodeOf(ended.status()) == ExitCode::kInterrupted) {
      return Failure(ExitCode::kInterrupted, "interrupted; the same command with --resume goes on");
    }
    status = ended.ok() ? SaveBake(runs->connection(), *ended, request.outputs, output_options)
                        : ended.status();
    // What was measured is still there.
    if (ended.ok() && !status.ok()) return status;
  }
  return CloseCheckpoints(cluster.state_folder, request.resumes, status);
}

}  // namespace

Status CheckBakeOutputs(const BakeOutputs& outputs) {
  const bool is_light_map = IsLightMap(outputs.path);
  if (!IsPly(outputs.path) && !outputs.path.ends_with(".glb") && !is_light_map) {
    return Failure(ExitCode::kUsage,
                   absl::StrCat("-o ", outputs.path,
                                ": the name must end with .ply or .glb, or .exr for a light map"));
  }
  if (!outputs.uv_mesh.empty()) {
    if (!is_light_map) {
      return Failure(ExitCode::kUsage, "--uv-mesh is for light maps; give -o an .exr file");
    }
    if (!outputs.uv_mesh.ends_with(".glb")) {
      return Failure(ExitCode::kUsage,
                     absl::StrCat("--uv-mesh ", outputs.uv_mesh, ": the name must end with .glb"));
    }
    LUCERNA_RETURN_IF_ERROR(CheckWritable(outputs.uv_mesh));
  }
  if (outputs.is_ascii && !IsPly(outputs.path)) {
    return Failure(ExitCode::kUsage, "--ascii is for .ply files");
  }
  if (!outputs.plan.empty()) {
    if (is_light_map) {
      return Failure(ExitCode::kUsage, "--plan draws meshes; give -o a .glb or .ply file");
    }
    if (!outputs.plan.ends_with(".svg")) {
      return Failure(ExitCode::kUsage,
                     absl::StrCat("--plan ", outputs.plan, ": the name must end with .svg"));
    }
    LUCERNA_RETURN_IF_ERROR(CheckWritable(outputs.plan));
  }
  return CheckWritable(outputs.path);
}

Status SaveBake(ClientConnection& connection, const v1::Job& job, const BakeOutputs& outputs,
                const OutputOptions& output_options) {
  if (!HasEnded(job.state())) {
    return absl::FailedPreconditionError(absl::StrCat(
        "job ", job.job_id(), " has not ended, and a bake has nothing to show before"));
  }
  LUCERNA_RETURN_IF_ERROR(CheckSucceeded(job));
  if (job.bake().settings().is_light_map() != IsLightMap(outputs.path)) {
    return absl::FailedPreconditionError(absl::StrCat("job ", job.job_id(), " made a ",
                                                      job.bake().settings().is_light_map()
                                                          ? "light map; give -o an .exr file"
                                                          : "mesh; give -o a .glb or .ply file"));
  }
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, connection.GetImage(job.job_id()));
  if (!outputs.uv_mesh.empty()) {
    LUCERNA_ASSIGN_OR_RETURN(const std::string uv_mesh, connection.GetUvMesh(job.job_id()));
    LUCERNA_RETURN_IF_ERROR(WriteFile(outputs.uv_mesh, uv_mesh));
  }
  if (IsPly(outputs.path) || !outputs.plan.empty()) {
    LUCERNA_ASSIGN_OR_RETURN(const BakedMesh mesh, ReadMeshGlb(job.job_id(), bytes));
    if (!outputs.plan.empty()) {
      LUCERNA_RETURN_IF_ERROR(WriteFile(outputs.plan, IrradiancePlan(mesh, outputs.in_lux)));
    }
    if (IsPly(outputs.path)) {
      LUCERNA_RETURN_IF_ERROR(WriteFile(outputs.path, MeshPly(mesh, outputs.is_ascii)));
    }
  }
  if (!IsPly(outputs.path)) LUCERNA_RETURN_IF_ERROR(WriteFile(outputs.path, bytes));
  if (output_options.json) {
    PrintData(BakeReport(job, outputs.path));
  } else if (!output_options.quiet) {
    PrintFigures(job, outputs.in_lux, outputs.path);
  }
  return absl::OkStatus();
}

Status Bake(BakeRequest request, const ClusterOptions& cluster,
            const std::optional<Endpoint>& server, const OutputOptions& output_options) {
  LUCERNA_RETURN_IF_ERROR(CheckRequest(request, server.has_value()));
  if (!request.outputs.path.empty()) {
    request.settings.is_light_map = IsLightMap(request.outputs.path);
  }
  if (const Status checked = CheckBake(request.settings, request.overrides); !checked.ok()) {
    return Failure(ExitCode::kUsage, std::string(checked.message()));
  }
  LUCERNA_ASSIGN_OR_RETURN(const SceneManifest manifest,
                           ReadScene(request.scene, request.overrides, output_options.quiet));
  DirectoryFiles files = FilesOf(request.scene);
  const JobToSend job = {.manifest = manifest,
                         .overrides = request.overrides,
                         .priority = request.priority,
                         .bake = request.settings};
  OutputOptions shown = output_options;
  shown.previews = false;  // there is no image
  return server ? BakeOnServer(request, files, job, *server, shown)
                : BakeHere(request, files, job, cluster, shown);
}

}  // namespace lucerna
