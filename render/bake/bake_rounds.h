// Which points of a scene's surfaces are measured next, and what comes of it in the end?
//
// A bake is a row of rounds. Each measures irradiance at a set of sensors, as a job does whose
// camera they are (render/formats/sensors/sensors_reader.h): a survey measures means over the faces
// of a coarse mesh; the first round measures at its vertices and in the middle of its edges, each
// further one where the mesh was refined (render/bake/surface_mesh.h). A histogram is one round
// over its triangles, a light map one round at its texels (render/bake/chart_atlas.h).
//
// A function of the scene, the settings and what was measured alone: whoever takes in the same
// images again asks for the same rounds. Threads: one at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/bake/bake_settings.h"
#include "render/bake/chart_atlas.h"
#include "render/bake/surface_figures.h"
#include "render/bake/surface_mesh.h"
#include "render/base/status.h"
#include "render/formats/sensors/sensors_reader.h"
#include "render/image/image.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"

namespace lucerna {

// The main file of a round, beside the scene's own in its manifest. A file of the scene that has
// this name is not seen.
inline constexpr const char* kSensorsPath = "lucerna-sensors.ply";

inline constexpr const char* kSurveyName = "survey";
// The first round after the survey, whose points are spread evenly over the surfaces.
inline constexpr const char* kEvenRoundName = "round 1";

// What is measured at once.
struct BakeRound {
  std::string name;  // kSurveyName, "round 1"
  SensorSet set;
  RenderOverrides overrides;
};

struct BakeResult {
  std::string file;     // the mesh as glTF (.glb), or the light map as EXR
  std::string uv_mesh;  // of a light map: its surfaces with their places in it, as glTF
  std::vector<SurfaceFigures> figures;
  std::optional<double> interpolation_error;  // SurfaceMesh::InterpolationError of a refined mesh
};

class BakeRounds {
 public:
  // Whether one can begin, as far as that is known without a mesh: materials of these names, and no
  // more faces than there may be. Errors: as Begin.
  [[nodiscard]] static Status Check(const Scene& scene, const BakeSettings& settings,
                                    std::uint64_t max_bytes);
  // The end that `overrides` have is that of the first round after the survey, whose points are
  // spread evenly, without one 64 passes; all later rounds have as many passes as it had, so that
  // what is measured is equally good everywhere. Requires CheckBake.
  // What it holds stays below `max_bytes` or so, and the same in the rounds.
  // Errors: as SurfaceMesh::FromScene and SplitLongEdges, and ChartAtlasOf.
  [[nodiscard]] static StatusOr<BakeRounds> Begin(
      const Scene& scene, const BakeSettings& settings, const RenderOverrides& overrides,
      std::uint64_t max_bytes = std::numeric_limits<std::uint64_t>::max());

  // What is to be measured now; absent when all is.
  [[nodiscard]] const std::optional<BakeRound>& round() const { return round_; }
  // The image of the round's run, and how many passes it has. Requires a round.
  // Errors: DATA_LOSS when it has not what was asked for, RESOURCE_EXHAUSTED when the mesh has
  // grown too large; then nothing more can be asked.
  [[nodiscard]] Status TakeIn(const Image& image, std::int64_t passes);
  // From now on only what the mesh cannot be written without is measured.
  void StopRefining() { is_refined_ = false; }

  // Requires that no round is left. `scene_path` is the main file; `estimate` is the relative error
  // of the first round, 0: none. `metadata` is what a light map says beside its spacing and unit.
  [[nodiscard]] StatusOr<BakeResult> Finish(
      const std::string& scene_path, double estimate,
      const std::vector<std::pair<std::string, std::string>>& metadata);

  // About what it holds [bytes].
  [[nodiscard]] std::uint64_t MemoryBytes() const;

 private:
  enum class Next : std::uint8_t { kSurvey, kTexels, kBuckets, kPoints, kRest, kNothing };

  BakeRounds(BakeSettings settings, RenderOverrides overrides, SurfaceMesh mesh)
      : settings_(std::move(settings)), overrides_(std::move(overrides)), mesh_(std::move(mesh)) {}
  // Makes the round that `next` asks for, or the first after it that has points.
  [[nodiscard]] Status Prepare(Next next);
  // Requires sensors.
  void Ask(std::string name, SensorSet set, RenderOverrides overrides);
  [[nodiscard]] Next AfterSurvey() const;

  BakeSettings settings_;
  RenderOverrides overrides_;
  SurfaceMesh mesh_;
  double spacing_ = 0;  // [scene units]
  std::size_t max_texels_ = kMostTexels;
  bool chooses_photons_ = true;  // neither the job nor the scene does
  bool is_refined_ = true;
  Next asked_ = Next::kNothing;  // what round_ is
  int measured_rounds_ = 0;      // the survey apart
  std::optional<BakeRound> round_;
  std::optional<ChartAtlas> atlas_;  // of a light map
  std::vector<Irradiance> texels_;   // of its texels, once they are measured
};

}  // namespace lucerna
