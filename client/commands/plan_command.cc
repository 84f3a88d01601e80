#include "client/commands/plan_command.h"

#include <array>
#include <utility>

#include "absl/strings/str_format.h"

#include "client/scene_reading.h"
#include "client/view/report.h"
#include "render/analysis/expected_cost.h"
#include "render/analysis/needs.h"
#include "render/analysis/scene_memory.h"
#include "render/base/console.h"
#include "render/base/text.h"

namespace lucerna {
namespace {

// "1.3 MB".
std::string Bytes(double bytes) {
  if (bytes >= 1e9) return absl::StrFormat("%.1f GB", bytes / 1e9);
  if (bytes >= 1e6) return absl::StrFormat("%.1f MB", bytes / 1e6);
  return absl::StrFormat("%.0f kB", bytes / 1e3);
}

}  // namespace

Status PrintPlan(const SceneSource& source, const RenderOverrides& overrides,
                 const OutputOptions& output_options) {
  Scene scene;
  LUCERNA_ASSIGN_OR_RETURN(const SceneOfJobs read,
                           ReadSceneOfJobs(source, {&overrides, 1}, output_options.quiet, &scene));
  const RenderSettings& settings = read.settings.front();
  const SceneNeeds needs = NeedsOf(scene, settings);
  const ExpectedCost cost = ExpectedCostOf(needs, settings);
  SceneMemory memory = SceneMemoryOf(scene, needs.rays());
  for (const auto& [path, file] : read.manifest.entries)
    memory.files += static_cast<double>(file.size_bytes);
  if (output_options.json) {
    PrintData(PlanReport(needs, cost, memory));
    return absl::OkStatus();
  }
  std::string text =
      absl::StrFormat("%s, %d x %d pixels, %s\n", source.path, settings.crop_width(),
                      settings.crop_height(), std::string(NameOf(settings.radius_controller)));
  for (const bool is_used : {true, false}) {
    absl::StrAppendFormat(&text, "\n%s\n", is_used ? "used" : "left out");
    for (const Part part : AllParts()) {
      if (needs.Uses(part) != is_used) continue;
      absl::StrAppendFormat(&text, "  %-18s %s\n", std::string(NameOf(part)), needs.ReasonOf(part));
    }
  }
  text += "\nmemory of the scene, predicted from its counts\n";
  const std::array<std::pair<const char*, double>, 10> rows = {
      {{"files", memory.files},
       {"shapes", memory.shapes},
       {"textures", memory.textures},
       {"ray acceleration", memory.acceleration},
       {"  of instances", memory.instances},
       {"lights", memory.lights},
       {"feature edges", memory.edges},
       {"bends of facets", memory.bends},
       {"coordinator", memory.PeakOfCoordinator()},
       {"each worker", memory.PeakOfWorker()}}};
  for (const auto& [name, bytes] : rows) {
    if (bytes > 0) absl::StrAppendFormat(&text, "  %-18s %s\n", name, Bytes(bytes));
  }
  text += "\nexpected, beside the scene itself\n";
  absl::StrAppendFormat(&text, "  %-18s %s\n", "coordinator", Bytes(cost.coordinator));
  absl::StrAppendFormat(&text, "  %-18s %s\n", "each worker", Bytes(cost.worker));
  if (cost.pass_sent < cost.first_pass_sent) {
    absl::StrAppendFormat(&text, "  %-18s %s to each worker, %s after %d passes\n", "sent a pass",
                          Bytes(cost.first_pass_sent), Bytes(cost.pass_sent),
                          needs.eye_sample_sets());
  } else {
    absl::StrAppendFormat(&text, "  %-18s %s to each worker\n", "sent a pass",
                          Bytes(cost.pass_sent));
  }
  PrintText(text);
  return absl::OkStatus();
}

}  // namespace lucerna
