// What is measured of a scene's surfaces, and how?
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "render/bake/surface_mesh.h"
#include "render/base/status.h"
#include "render/scene/render_settings.h"

namespace lucerna {

// How irradiance is estimated from the photons.
enum class BakeEstimator : std::uint8_t {
  kKernel,     // a kernel at each vertex, whose width a radius controller chooses
  kNearest,    // about the k nearest photons of each vertex
  kHistogram,  // the photons on each triangle, over its area; the mesh is even
};

struct BakeSettings {
  BakeEstimator estimator = BakeEstimator::kKernel;
  MeasuredSides sides = MeasuredSides::kBrighter;
  std::vector<std::string> materials = {};  // whose surfaces are measured; empty: all
  // Between neighbouring vertices where the mesh is finest [scene units]; absent: a 512th of the
  // scene's diagonal.
  std::optional<double> spacing = {};
  MeshElements elements = MeshElements::kLinear;
  double tolerance = 0.05;     // see SurfaceMesh::Refine; not of histograms and light maps
  bool decimates = true;       // see SurfaceMesh::Decimate
  bool indirect_only = false;  // without light that comes straight from lights
  bool is_light_map = false;   // texels of charts in place of a mesh
  bool operator==(const BakeSettings&) const = default;
};

// Whether the settings, and those of its jobs, go together.
// Errors: INVALID_ARGUMENT, a sentence that says what to change.
[[nodiscard]] Status CheckBake(const BakeSettings& settings, const RenderOverrides& overrides);

}  // namespace lucerna
