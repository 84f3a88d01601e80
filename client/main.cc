// What did the user type, and which command answers it?
//
// Only wires: flags in, one command called, its Status out as a message and an exit code.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <new>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_join.h"
#include <CLI/CLI.hpp>

#include "client/commands/bake_command.h"
#include "client/commands/compare_command.h"
#include "client/commands/file_commands.h"
#include "client/commands/job_commands.h"
#include "client/commands/photon_command.h"
#include "client/commands/plan_command.h"
#include "client/commands/reference_command.h"
#include "client/commands/token_command.h"
#include "client/commands/worker_commands.h"
#include "client/exit_code.h"
#include "client/interruption.h"
#include "client/local_cluster.h"
#include "client/manual.h"
#include "client/render_flags.h"
#include "client/selfcheck/selfcheck.h"
#include "client/usage.h"
#include "client/view/preview.h"
#include "client/view/tev_view.h"
#include "client/view_flags.h"
#include "render/base/console.h"
#include "render/base/escape.h"
#include "render/base/open_ssl.h"
#include "render/base/text.h"
#include "render/base/version.h"
#include "render/wire/channel.h"
#include "render/wire/grpc_process.h"
#include "render/wire/security_flags.h"

namespace lucerna {
namespace {

int End(ExitCode code) {
  return static_cast<int>(code);
}

// [stops]; absent for auto. Errors: CLI::ValidationError.
std::optional<double> StopsOf(const std::string& text) {
  if (text == "auto") return std::nullopt;
  double stops = 0;
  if (!absl::SimpleAtod(text, &stops) || !(std::abs(stops) <= 1000)) {
    throw CLI::ValidationError(
        absl::StrCat("--exposure must be a number of stops, or auto, not \"", text, "\""));
  }
  return stops;
}

// [s]. Errors: CLI::ValidationError.
double SecondsOf(const char* flag, const std::string& text) {
  const Setting& time = *FindSetting("time_s");
  RenderOverrides parsed;
  const Status status = ParseSetting(time, text, parsed);
  if (!status.ok() || !(*parsed.time_s > 0)) {
    throw CLI::ValidationError(
        absl::StrCat(flag, " must be a time above 0, like 90s, 5m or 1.5h, not \"", text, "\""));
  }
  return *parsed.time_s;
}

// Errors: CLI::ValidationError.
std::pair<double, double> RangeOf(const std::string& text) {
  const std::size_t comma = text.find(',');
  std::pair<double, double> range;
  if (comma == std::string::npos || !absl::SimpleAtod(text.substr(0, comma), &range.first) ||
      !absl::SimpleAtod(text.substr(comma + 1), &range.second)) {
    throw CLI::ValidationError(
        absl::StrCat("--range must be two numbers, like 0.01,0.5, not \"", text, "\""));
  }
  return range;
}

// The library's own texts about the values show their numbers, as bytes.
template <typename Value>
CLI::Validator OneOf(const std::map<std::string, Value>& values) {
  std::vector<std::string> names;
  for (const auto& [name, value] : values)
    names.push_back(name);
  return CLI::Validator(
      [values, names, numbers = CLI::Transformer(values)](std::string& text) -> std::string {
        if (values.contains(text)) return numbers(text);
        return absl::StrCat("must be ", Listed(names, " or "), ", not ", text);
      },
      absl::StrCat("{", absl::StrJoin(names, ","), "}"));
}

ToneCurve CurveOf(const std::string& name) {
  const StatusOr<ToneCurve> curve = ParseToneCurve(name);
  if (!curve.ok()) {
    throw CLI::ValidationError(
        absl::StrCat("--tonemap ", name, ": ", std::string(curve.status().message())));
  }
  return *curve;
}

int Run(int argc, char** argv) {
  CLI::App app(
      "Lucerna renders light that path tracers do not find, by progressive photon mapping.",
      "lucerna");
  app.require_subcommand(1);
  app.set_version_flag("--version", absl::StrCat("lucerna ", Version()));
  app.footer(
      "Exit codes: 0 done, 1 failed, 2 wrong usage, 3 coordinator unreachable, 130 interrupted.");

  app.set_config("--config", ConfigPath(std::getenv("XDG_CONFIG_HOME"), std::getenv("HOME")),
                 "file of flags, as [render] and size = \"640x480\"");
  app.allow_config_extras(CLI::config_extras_mode::error);

  OutputOptions output_options;
  RenderRequest request;
  std::vector<std::string> scenes;
  std::string frames;
  ClusterOptions cluster;
  OutputPaths fetched;
  BakeOutputs fetched_bake;
  ReportPaths report_paths;
  RenderOverrides until;
  PhotonRequest photon;
  RenderOverrides planned;
  Endpoint server{"127.0.0.1:7400"};
  std::string token_file;
  std::string tev;
  std::string token_name;
  std::string token_roles = "submit";
  std::string job_id;
  std::string worker_id;
  std::optional<WorkerOrder> worker_order;
  JobsRequest listed;
  int priority = 0;
  SceneSource scene;
  std::string image_path;
  std::string reference_path;
  std::string mask_path;
  MetricsOptions metrics;
  CompareRequest comparison;
  ReferenceRequest to_refer;
  BakeRequest baked;
  bool bakes_on_server = false;
  std::string only;
  std::string topic;
  PictureRequest to_convert;
  std::vector<std::string> job_ids;
  bool hides_preview = false;
  bool keeps_no_checkpoints = false;
  bool strict = false;
  bool crops = false;
  bool scales = false;
  std::function<Status()> chosen;

  const auto command = [&](const char* name, const char* description,
                           std::function<Status()> answer) {
    CLI::App* added = app.add_subcommand(name, description);
    added->callback([&chosen, answer = std::move(answer)] { chosen = answer; });
    return added;
  };
  const auto add_json = [&](CLI::App* to) {
    return to->add_flag("--json", output_options.json, "print the result as one JSON value");
  };
  const auto add_full = [&](CLI::App* to, CLI::Option* json) {
    to->add_flag_callback(
          "--full", [&] { output_options.detail = JsonDetail::kFull; },
          "with --json: all that is known, not only what scripts need most")
        ->needs(json);
  };
  const auto add_json_and_full = [&](CLI::App* to) { add_full(to, add_json(to)); };
  const auto add_quiet = [&](CLI::App* to) {
    to->add_flag("--quiet", output_options.quiet, "print nothing but errors and the result");
  };
  const auto add_no_preview = [&](CLI::App* to) {
    to->add_flag("--no-preview", hides_preview, "do not show the image on a terminal with colours");
  };
  const auto add_server = [&](CLI::App* to) {
    to->add_option("--server", server.address, "the coordinator, as host:port")
        ->envname("LUCERNA_SERVER")
        ->capture_default_str();
    AddTlsFlags(*to, server.tls, /*reads_environment=*/true);
    to->add_option("--token-file", token_file,
                   "file that holds your token (default: what LUCERNA_TOKEN says)");
  };
  const auto add_allowed = [](CLI::App* to, SceneSource& source) {
    to->add_option("--allow-path", source.allowed_folders,
                   "the scene may name files below this folder by absolute paths and by ..")
        ->allow_extra_args(false);
  };
  const auto add_scene = [&](CLI::App* to, SceneSource& source) {
    to->add_option("SCENE", source.path, "scene file: pbrt-v4, glTF 2.0, Mitsuba or .view.json")
        ->required();
    add_allowed(to, source);
    AddEnvironmentFlags(*to, source.view);
  };
  const auto add_display = [&](CLI::App* to) {
    to->add_option_function<std::string>(
          "--exposure",
          [&](const std::string& text) { output_options.display.exposure_stops = StopsOf(text); },
          "stops by which pictures and previews are brighter, or auto: 0 unless that would be "
          "mostly white or black (default: auto)")
        ->type_name("STOPS|auto");
    to->add_option_function<std::string>(
          "--tonemap",
          [&](const std::string& name) { output_options.display.curve = CurveOf(name); },
          "what becomes of light brighter than white: clip, reinhard, filmic or aces (default: "
          "clip)")
        ->type_name("CURVE");
  };
  const auto add_outputs = [&](CLI::App* to, OutputPaths& outputs) {
    to->add_option("-o,--output", outputs.image, "image to write: .exr, .png, .pfm or .hdr");
    to->add_option("--png", outputs.png, "PNG file to write beside it");
    to->add_flag("--force", outputs.replaces, "replace files that lucerna has not written");
    add_display(to);
  };
  const auto add_bake_outputs = [](CLI::App* to, BakeOutputs& outputs) {
    to->add_option("--uv-mesh", outputs.uv_mesh,
                   ".glb file to write beside a light map: the surfaces with their places in it");
    to->add_flag("--ascii", outputs.is_ascii, "write a PLY file as text");
    to->add_option("--plan", outputs.plan,
                   "SVG file to write: the largest surface, and what faces the same way, in false "
                   "colours");
    to->add_flag("--lux", outputs.in_lux, "print illuminance: 683 lm/W times the luminance");
  };
  const auto add_tev = [&](CLI::App* to) {
    to->add_option("--tev", tev, "show the image so far in the viewer tev, at host:port");
  };
  const auto add_image_flags = [](CLI::App* to, RenderOverrides& overrides) {
    AddSettingFlags(*to, SettingRole::kDecidesPixels, overrides);
  };
  const auto add_render_flags = [&](CLI::App* to) {
    to->add_option("SCENE", scenes,
                   "scene files: pbrt-v4, glTF 2.0 or Mitsuba; #### stands for the number of a "
                   "frame")
        ->required();
    add_allowed(to, request.scene);
    AddCameraFlags(*to, request.scene.view);
    AddEnvironmentFlags(*to, request.scene.view);
    to->add_option("--frames", frames, "numbers of frames, like 1-24 or 1,5,8-10");
    add_outputs(to, request.outputs);
    to->add_option_function<std::string>(
          "--save-every",
          [&](const std::string& text) { request.save_every_s = SecondsOf("--save-every", text); },
          "write the image so far so often, like 10m")
        ->type_name("TIME");
    add_image_flags(to, request.overrides);
    AddSettingFlags(*to, SettingRole::kStopsJob, request.overrides);
    to->add_option("--reference", request.reference, "EXR file to measure the true error by");
    to->add_option("--trace", request.trace,
                   "file for the job's timeline, in Chrome's trace format (.json)");
    add_tev(to);
  };

  const auto add_workers = [&](CLI::App* to) {
    to->add_option("--workers", cluster.workers, "worker processes")
        ->check(CLI::Range(1, 256))
        ->capture_default_str();
    to->add_option("--threads", cluster.threads, "threads of each worker (default: all in all)")
        ->check(CLI::Range(1, 4096));
  };

  const auto add_checkpoints = [&](CLI::App* to, bool& resumes, const std::string& what) {
    CLI::Option* none =
        to->add_flag("--no-checkpoints", keeps_no_checkpoints,
                     "keep nothing beside the image to go on from after an interruption");
    to->add_flag("--resume", resumes, absl::StrCat("go on with a ", what, " that was interrupted"))
        ->excludes(none);
  };
  const auto find_programs = [&] {
    StatusOr<std::string> folder = ProgramFolder();
    if (folder.ok()) cluster.program_folder = *folder;
    return folder.status();
  };
  CLI::App* render = command("render", "render a scene on this machine", [&]() -> Status {
    LUCERNA_RETURN_IF_ERROR(find_programs());
    request.keeps_checkpoints = !keeps_no_checkpoints;
    LUCERNA_ASSIGN_OR_RETURN(const std::vector<RenderRequest> requests,
                             RequestsOf(request, scenes, frames, /*names_images=*/true));
    return Render(requests, cluster, output_options);
  });
  add_render_flags(render);
  render->add_option("--from-mesh", request.mesh,
                     ".glb file of lucerna bake whose light is drawn, without photons");
  add_checkpoints(render, request.resumes, "render");
  add_workers(render);
  add_json_and_full(render);
  add_quiet(render);
  add_no_preview(render);

  CLI::App* submit = command("submit", "send scenes to a coordinator", [&]() -> Status {
    LUCERNA_ASSIGN_OR_RETURN(const std::vector<RenderRequest> requests,
                             RequestsOf(request, scenes, frames, /*names_images=*/false));
    for (const RenderRequest& one : requests)
      LUCERNA_RETURN_IF_ERROR(Submit(one, server, output_options));
    return absl::OkStatus();
  });
  add_render_flags(submit);
  submit
      ->add_option("--priority", request.priority,
                   "jobs of higher priority come first; -100 to 100")
      ->check(CLI::Range(-100, 100))
      ->capture_default_str();
  add_server(submit);
  add_json_and_full(submit);
  add_quiet(submit);
  add_no_preview(submit);

  CLI::App* jobs = command("jobs", "list the jobs of a coordinator",
                           [&] { return ListJobs(listed, server, output_options); });
  jobs->add_option("--state", listed.states,
                   "only jobs in this state, such as running or paused; may be repeated")
      ->allow_extra_args(false);
  jobs->add_option("--user", listed.user, "only jobs of this user");
  jobs->add_option("--name", listed.name_contains, "only jobs whose names contain this");
  add_server(jobs);
  add_json_and_full(jobs);

  CLI::App* workers = command("workers", "list the workers of a coordinator", [&] {
    if (!worker_order) return ListWorkers(server, output_options);
    return OrderWorker(*worker_order, worker_id, server, output_options);
  });
  add_server(workers);
  add_json(workers);
  add_quiet(workers);
  const auto add_worker_order = [&](const char* name, const char* description, WorkerOrder order) {
    CLI::App* added = workers->add_subcommand(name, description);
    added->add_option("WORKER", worker_id, "the worker's id, as in the list")->required();
    added->fallthrough();
    added->parse_complete_callback([&worker_order, order] { worker_order = order; });
  };
  add_worker_order("drain", "lend it nothing more; what it holds is finished", WorkerOrder::kDrain);
  add_worker_order("quarantine", "lend it nothing more and refuse its results",
                   WorkerOrder::kQuarantine);
  add_worker_order("release", "lend to it again", WorkerOrder::kRelease);

  CLI::App* watch = command("watch", "show a job's progress until it has ended",
                            [&] { return Follow(job_id, true, server, output_options); });
  CLI::App* wait = command("wait", "wait until a job has ended",
                           [&] { return Follow(job_id, false, server, output_options); });
  CLI::App* fetch =
      command("fetch", "fetch a job's image, also of one that still runs, or what a bake made",
              [&] { return Fetch(job_id, fetched, fetched_bake, server, output_options); });
  add_outputs(fetch, fetched);
  add_bake_outputs(fetch, fetched_bake);
  const auto for_each_job = [&](auto change) {
    return [&, change] {
      Status status;
      for (const std::string& job : job_ids)
        status.Update(change(job));
      return status;
    };
  };
  CLI::App* cancel = command(
      "cancel", "end jobs and drop their images",
      for_each_job([&](const std::string& job) { return Cancel(job, server, output_options); }));
  add_no_preview(watch);
  add_tev(watch);
  add_display(watch);
  CLI::App* report =
      command("report", "write a page about a job: image, error against time, workers",
              [&] { return Report(job_id, report_paths, server, output_options); });
  report->add_option("-o,--output", report_paths.html, "HTML file to write");
  add_display(report);
  report->add_option("--csv", report_paths.csv, "file to write samples and workers to, as a table");
  for (CLI::App* about_job : {watch, wait, fetch, report}) {
    about_job->add_option("JOB", job_id, "the job's id")->required();
    add_server(about_job);
    add_quiet(about_job);
  }
  for (CLI::App* of_job : {watch, wait})
    add_json_and_full(of_job);
  add_json(fetch);
  add_json(report);

  CLI::App* trace_photon =
      command("trace-photon", "trace photons of a job again and show their ways", [&]() -> Status {
        LUCERNA_RETURN_IF_ERROR(find_programs());
        photon.job_id = job_id;
        photon.program_folder = cluster.program_folder;
        photon.token_file = token_file;
        return TracePhoton(photon, server, output_options);
      });
  trace_photon->add_option("JOB", job_id, "the job's id; it may have ended")->required();
  trace_photon
      ->add_option("PHOTON", photon.photon,
                   "PASS:INDEX, both from 0, or INDEX; several are PASS:FIRST-LAST")
      ->required();
  trace_photon->add_option("-o,--output", photon.output,
                           "file to write: .ply for the places where photons left light, .obj for "
                           "their ways");
  trace_photon->add_option("--pass", photon.pass,
                           "the pass, where PHOTON is an INDEX (default: 0)");
  add_server(trace_photon);
  add_json(trace_photon);

  CLI::App* stop = command(
      "stop", "end jobs and keep their images",
      for_each_job([&](const std::string& job) { return StopJob(job, server, output_options); }));
  CLI::App* extend = command("extend", "go on with a job, from all its photons, to a new end",
                             [&] { return Extend(job_id, until, server, output_options); });
  for (const Setting& setting : AllSettings()) {
    // The defaults of a new job do not count here.
    if (setting.role != SettingRole::kStopsJob) continue;
    AddSettingFlag(*extend, setting.name, until, std::string(setting.meaning));
  }
  CLI::App* pause = command(
      "pause", "let other jobs have the place of these until they are resumed",
      for_each_job([&](const std::string& job) { return PauseJob(job, server, output_options); }));
  CLI::App* resume = command(
      "resume", "go on with jobs that are paused",
      for_each_job([&](const std::string& job) { return ResumeJob(job, server, output_options); }));
  CLI::App* prioritize =
      command("priority", "change the priority of a job that has not ended",
              [&] { return SetPriority(job_id, priority, server, output_options); });
  CLI::App* remove = command(
      "delete", "forget jobs that have ended, and their images",
      for_each_job([&](const std::string& job) { return DeleteJob(job, server, output_options); }));
  remove->add_option("JOB", job_ids, "ids of jobs")->required();
  add_server(remove);
  add_quiet(remove);
  for (CLI::App* about_jobs : {cancel, stop, pause, resume}) {
    about_jobs->add_option("JOB", job_ids, "ids of jobs")->required();
    add_server(about_jobs);
    add_full(about_jobs, about_jobs->add_flag("--json", output_options.json,
                                              "print one JSON value for each job"));
    add_quiet(about_jobs);
  }
  for (CLI::App* about_job : {extend, prioritize}) {
    about_job->add_option("JOB", job_id, "the job's id")->required();
    add_server(about_job);
    add_json_and_full(about_job);
    add_quiet(about_job);
  }
  prioritize->add_option("PRIORITY", priority, "jobs of higher priority come first; -100 to 100")
      ->required()
      ->check(CLI::Range(-100, 100));

  CLI::App* validate = command("validate", "say what is wrong with a scene",
                               [&] { return Validate(scene, strict, output_options); });
  add_scene(validate, scene);
  AddCameraFlags(*validate, scene.view);
  validate->add_flag("--strict", strict, "warnings are errors");
  add_json(validate);
  add_quiet(validate);

  CLI::App* plan = command("plan", "say what a job will use, what is left out, and why",
                           [&] { return PrintPlan(scene, planned, output_options); });
  add_scene(plan, scene);
  AddCameraFlags(*plan, scene.view);
  add_image_flags(plan, planned);
  add_json(plan);
  add_quiet(plan);

  CLI::App* diff = command("diff", "say how far an image is from a reference", [&] {
    if (crops) metrics.fit = MetricsOptions::Fit::kCrop;
    if (scales) metrics.fit = MetricsOptions::Fit::kScale;
    return Diff(image_path, reference_path, mask_path, metrics, output_options);
  });
  diff->add_option("A", image_path, "EXR file")->required();
  diff->add_option("B", reference_path, "EXR file to compare with")->required();
  CLI::Option* crop = diff->add_flag("--crop", crops, "compare the common top-left part");
  diff->add_flag("--scale", scales, "average both to the smaller size")->excludes(crop);
  diff->add_option("--clip", metrics.clip, "clip every channel of both at this value first")
      ->check(CLI::PositiveNumber);
  diff->add_option("--trim", metrics.trim_share, "leave out this share of the worst pixels");
  diff->add_option("--floor", metrics.floor,
                   "floor of relMSE (default: 0.01 times B's squared mean luminance without its "
                   "brightest 1 %)")
      ->check(CLI::NonNegativeNumber);
  diff->add_option("--mask", mask_path, "EXR file; pixels that are 0 in it are left out");
  add_json(diff);

  CLI::App* compare =
      command("compare", "say which settings are ahead after equal time", [&]() -> Status {
        LUCERNA_RETURN_IF_ERROR(find_programs());
        return CompareSettings(comparison, cluster, output_options);
      });
  compare->add_option("SCENE", comparison.scene_paths, "scene files: pbrt-v4, glTF 2.0 or Mitsuba")
      ->required();
  compare
      ->add_option("--reference", comparison.reference_paths,
                   "EXR file to measure errors by, once for each scene, in their order")
      ->required()
      ->allow_extra_args(false);
  compare->add_option("--mask", comparison.mask_path,
                      "EXR file; pixels that are 0 in it are left out");
  compare->add_option("--trim", comparison.trim_share, "leave out this share of the worst pixels")
      ->capture_default_str();
  compare->add_option("--times", comparison.times, "processor seconds over cores, like 1,2,5,10")
      ->capture_default_str();
  compare->add_option("--repetitions", comparison.repetitions, "runs of each setting")
      ->capture_default_str();
  compare
      ->add_option("--settings", comparison.settings,
                   "\"NAME: flags\", once for each (default: one for each radius controller)")
      ->allow_extra_args(false);
  compare->add_option("-o,--output", comparison.table_path, "table to write, as Markdown");
  compare->add_option("--plot", comparison.plot_path,
                      "plot to write, as SVG; #### stands for the number of the scene");
  compare->add_option("--csv", comparison.csv_path,
                      "file for all points that were measured, as a table");
  add_image_flags(compare, comparison.common);
  add_json_and_full(compare);
  add_quiet(compare);

  CLI::App* reference =
      command("reference", "render an image to measure others by", [&]() -> Status {
        LUCERNA_RETURN_IF_ERROR(find_programs());
        to_refer.keeps_checkpoints = !keeps_no_checkpoints;
        return RenderReference(to_refer, cluster, output_options);
      });
  reference->add_option("SCENE", to_refer.scene_path, "scene file: pbrt-v4 or glTF 2.0")
      ->required();
  reference->add_option("-o,--output", to_refer.output_path, "EXR file to write")->required();
  AddSettingFlag(*reference, "time_s", to_refer.overrides, "seconds, of both halves together");
  AddSettingFlag(*reference, "passes", to_refer.overrides, "passes, of both halves together");
  add_image_flags(reference, to_refer.overrides);
  ShowDefault(*reference, "radius_controller", std::string(NameOf(kReferenceController)));
  ShowDefault(*reference, "initial_radius", absl::StrCat(kReferenceFootprints, "px"));
  ShowDefault(*reference, "photons_per_pass",
              absl::StrCat(kReferencePhotonsPerPixel, " for each pixel"));
  add_checkpoints(reference, to_refer.resumes, "reference");
  add_no_preview(reference);
  add_json(reference);
  add_quiet(reference);

  CLI::App* bake =
      command("bake", "measure the irradiance of a scene's surfaces, as a mesh", [&]() -> Status {
        LUCERNA_RETURN_IF_ERROR(find_programs());
        return Bake(baked, cluster, bakes_on_server ? std::optional(server) : std::nullopt,
                    output_options);
      });
  add_scene(bake, baked.scene);
  bake->add_option("-o,--output", baked.outputs.path,
                   "file to write: .ply or .glb for a mesh, .exr for a light map; with --on-server "
                   "the job is submitted alone when it is not given (lucerna fetch)");
  add_bake_outputs(bake, baked.outputs);
  bake->add_flag("--light-map", baked.settings.is_light_map,
                 "make a light map; not needed where -o names an .exr file");
  bake->add_option("--spacing", baked.settings.spacing,
                   "distance of neighbouring points where the mesh is finest, in scene units "
                   "(default: a 512th of the scene's diagonal)")
      ->check(CLI::PositiveNumber);
  bake->add_option("--tolerance", baked.settings.tolerance,
                   "refine where linear interpolation is wrong by more than this share; 0: "
                   "everywhere")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  const std::map<std::string, MeshElements> elements = {{"linear", MeshElements::kLinear},
                                                        {"quadratic", MeshElements::kQuadratic}};
  bake->add_option("--elements", baked.settings.elements,
                   "linear or quadratic: how irradiance is interpolated on a triangle")
      ->transform(OneOf(elements))
      ->default_str("linear");
  bake->add_flag("!--no-decimation", baked.settings.decimates,
                 "keep vertices where the mesh is right without them");
  bake->add_option("--material", baked.settings.materials,
                   "measure surfaces of this material alone; may be repeated")
      ->allow_extra_args(false);
  const std::map<std::string, BakeEstimator> estimators = {
      {"kernel", BakeEstimator::kKernel},
      {"nearest", BakeEstimator::kNearest},
      {"histogram", BakeEstimator::kHistogram}};
  bake->add_option("--estimator", baked.settings.estimator,
                   "kernel, nearest (about the k nearest photons of each vertex) or histogram (the "
                   "photons on each triangle of an even mesh)")
      ->transform(OneOf(estimators))
      ->default_str("kernel");
  const std::map<std::string, MeasuredSides> sides = {{"brighter", MeasuredSides::kBrighter},
                                                      {"front", MeasuredSides::kFront},
                                                      {"back", MeasuredSides::kBack},
                                                      {"both", MeasuredSides::kBoth}};
  bake->add_option("--sides", baked.settings.sides,
                   "brighter, front, back or both sides of each shape")
      ->transform(OneOf(sides))
      ->default_str("brighter");
  bake->add_flag("--indirect-only", baked.settings.indirect_only,
                 "leave out light that comes straight from lights");
  add_image_flags(bake, baked.overrides);
  AddSettingFlags(*bake, SettingRole::kStopsJob, baked.overrides);
  add_workers(bake);
  bake->add_flag("--resume", baked.resumes,
                 "go on with a bake on this machine that was interrupted");
  bake->add_option("--priority", baked.priority,
                   "with --on-server: jobs of higher priority come first; -100 to 100")
      ->check(CLI::Range(-100, 100))
      ->capture_default_str();
  bake->add_flag("--on-server", bakes_on_server, "run it as a job of the coordinator of --server");
  add_server(bake);
  add_no_preview(bake);
  add_json(bake);
  add_quiet(bake);

  CLI::App* selfcheck =
      command("selfcheck", "say whether the numbers are right on this machine", [&]() -> Status {
        LUCERNA_RETURN_IF_ERROR(find_programs());
        return Selfcheck(only, cluster.program_folder, output_options);
      });
  selfcheck->add_option("--only", only, "run the cases whose names begin so");
  add_json(selfcheck);
  add_quiet(selfcheck);

  CLI::App* tokens = app.add_subcommand("token", "tokens of users and workers");
  tokens->require_subcommand(1);
  CLI::App* new_token = tokens->add_subcommand("new", "make a token, and the line that accepts it");
  new_token->callback(
      [&] { chosen = [&] { return NewToken(token_name, token_roles, output_options); }; });
  new_token->add_option("NAME", token_name, "whose it is")->required();
  new_token->add_option("--roles", token_roles, "submit, work or admin, with commas between them")
      ->capture_default_str();
  add_json(new_token);

  CLI::App* help = command("help", "explain a command, or all settings of a job", [&]() -> Status {
    if (topic == "settings") {
      PrintText(SettingsTable());
      return absl::OkStatus();
    }
    if (topic == "man") {
      PrintData(ManualOf(app));
      return absl::OkStatus();
    }
    if (topic.empty()) {
      // Not app.help(), which explains the command that was given: this one.
      PrintText(app.get_formatter()->make_help(&app, app.get_name(), CLI::AppFormatMode::Normal));
      return absl::OkStatus();
    }
    const CLI::App* about = FindCommand(app, topic);
    if (about == nullptr) {
      return Failure(ExitCode::kUsage,
                     absl::StrCat("there is no command ", topic, "; lucerna help lists them"));
    }
    PrintText(about->help(app.get_name()));
    return absl::OkStatus();
  });
  help->add_option("TOPIC", topic, "a command, settings, or man for the manual page");

  Shell shell = Shell::kBash;
  CLI::App* completion =
      command("completion", "print a script that completes commands in a shell", [&]() -> Status {
        PrintData(CompletionScript(app, shell));
        return absl::OkStatus();
      });
  const std::map<std::string, Shell> shells = {
      {"bash", Shell::kBash}, {"zsh", Shell::kZsh}, {"fish", Shell::kFish}};
  completion->add_option("SHELL", shell, "bash, zsh or fish")->required()->transform(OneOf(shells));

  CLI::App* digest = command("digest", "print the digest of an image's pixels and settings",
                             [&] { return PrintDigest(image_path, output_options); });
  digest->add_option("FILE", image_path, "EXR file")->required();
  add_json(digest);

  CLI::App* png =
      command("png", "turn an EXR file, or a layer of it, into a PNG file",
              [&]() -> Status { return ConvertToPicture(to_convert, output_options.display); });
  png->add_option("FILE", to_convert.exr_path, "EXR file")->required();
  png->add_option("OUT", to_convert.path, "file to write: .png, .pfm or .hdr")->required();
  png->add_option("--layer", to_convert.layer, "a layer, such as direct, albedo, N or noise");
  CLI::Option* false_color =
      png->add_flag("--false-color", to_convert.is_false_color,
                    "the layer's numbers as colours, such as those of radius, bandwidth or density "
                    "(of photons; the default)");
  png->add_option_function<std::string>(
         "--range", [&](const std::string& text) { to_convert.range = RangeOf(text); },
         "numbers that are dark blue and white (default: by the layer)")
      ->type_name("LOW,HIGH")
      ->needs(false_color);
  add_display(png);

  std::vector<std::string> words(argv + 1, argv + argc);
  if (!words.empty() && FindCommand(app, words.front()) == nullptr &&
      LooksLikeScene(words.front())) {
    words.insert(words.begin(), "render");
  }
  try {
    std::vector<std::string> last_first(words.rbegin(), words.rend());
    app.parse(std::move(last_first));
  } catch (const CLI::ParseError& error) {
    // Help is asked for by an exception too, with code 0.
    std::ostringstream out;
    std::ostringstream wrong;
    const bool is_done = app.exit(error, out, wrong) == 0;
    PrintText(out.str());
    PrintError(wrong.str());
    if (!is_done) PrintError(Suggestion(app, words));
    return End(is_done ? ExitCode::kDone : ExitCode::kUsage);
  }
  if (*fetch && fetched.empty()) {
    PrintError(
        "lucerna: say where the image goes, with -o FILE.exr or --png FILE.png, or with "
        "-o FILE.glb what a bake made\n");
    return End(ExitCode::kUsage);
  }

  if (*report && report_paths.html.empty() && report_paths.csv.empty() && !output_options.json) {
    PrintError("lucerna: say where the report goes, with -o PAGE.html, --csv FILE or --json\n");
    return End(ExitCode::kUsage);
  }
  const char* term = std::getenv("TERM");
  output_options.redraws = term != nullptr && std::string(term) != "dumb";
  output_options.previews =
      !hides_preview && HasColors(std::getenv("COLORTERM"), term, std::getenv("NO_COLOR"));

  StatusOr<std::string> token = ReadToken(token_file, std::getenv("LUCERNA_TOKEN"));
  if (!token.ok()) {
    PrintError(absl::StrCat("lucerna: --token-file ", token.status().message(), "\n"));
    return End(ExitCode::kUsage);
  }
  server.token = *std::move(token);

  if (!tev.empty()) {
    StatusOr<std::shared_ptr<TevView>> viewer = TevView::Open(tev);
    if (!viewer.ok()) {
      PrintError(absl::StrCat("lucerna: ", viewer.status().message(), "\n"));
      return End(ExitCode::kFailed);
    }
    output_options.tev = *std::move(viewer);
  }

  // These commands start no job and no process, so a signal may end them at once.
  const bool has_no_job = *validate || *plan || *diff || *digest || *png || *completion;
  if (!has_no_job) CatchInterruptions();
  IgnoreGrpcLog();
  Status status;
  try {
    status = chosen();
  } catch (const std::bad_alloc&) {
    status = absl::ResourceExhaustedError(
        "there is not enough memory for this; give the process more, or make the image or the "
        "scene "
        "smaller");
  }
  if (std::fflush(stdout) != 0 && status.ok()) {
    status = absl::ResourceExhaustedError("cannot write to the standard output");
  }
  if (!status.ok()) {
    PrintError(absl::StrCat("lucerna: ", EscapedLines(WithFlagNames(std::string(status.message()))),
                            "\n"));
  }
  return End(ExitCodeOf(status));
}

}  // namespace
}  // namespace lucerna

int main(int argc, char** argv) {
  lucerna::ReadLocale();
  lucerna::KeepOpenSsl();
  return lucerna::Run(argc, argv);
}
