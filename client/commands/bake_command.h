// How is the irradiance of a scene's surfaces measured?
//
// By jobs like any other, on scenes whose camera is a set of sensors
// (render/formats/sensors/sensors_reader.h): a survey measures means over the faces of a coarse
// mesh, the first round at its vertices and in the middle of its edges, each further one where the
// mesh was refined (client/bake/surface_mesh.h). A light map is one round at its texels
// (client/bake/chart_atlas.h).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/bake/surface_mesh.h"
#include "client/local_cluster.h"
#include "client/output_options.h"
#include "client/scene_reading.h"
#include "render/base/status.h"
#include "render/scene/render_settings.h"
#include "render/wire/channel.h"

namespace lucerna {

// How irradiance is estimated from the photons.
enum class BakeEstimator : std::uint8_t {
  kKernel,     // a kernel at each vertex, whose width a radius controller chooses
  kNearest,    // about the k nearest photons of each vertex
  kHistogram,  // the photons on each triangle, over its area; the mesh is even
};

struct BakeRequest {
  SceneSource scene;
  RenderOverrides overrides;  // of each job
  std::string output_path;    // .ply, .glb or, for a light map, .exr
  std::string plan_path;      // .svg; empty: none
  std::string uv_mesh_path;   // of a light map: .glb; empty: none
  bool is_ascii = false;      // of a PLY file
  MeasuredSides sides = MeasuredSides::kBrighter;
  std::vector<std::string> materials;  // whose surfaces are measured; empty: all
  // Between neighbouring vertices where the mesh is finest [scene units]; absent: a 512th of the
  // scene's diagonal.
  std::optional<double> spacing;
  BakeEstimator estimator = BakeEstimator::kKernel;
  MeshElements elements = MeshElements::kLinear;
  double tolerance = 0.05;     // see SurfaceMesh::Refine; not of histograms and light maps
  bool decimates = true;       // see SurfaceMesh::Decimate
  bool indirect_only = false;  // without light that comes straight from lights
  bool in_lux = false;         // the table
  bool resumes = false;        // takes rounds that were finished before an interruption
};

// Writes the mesh whole or not at all, and prints figures of its surfaces. Until then rounds that
// are finished are kept in a folder beside it, for a bake that resumes. The jobs run on `server`
// when it is there, else on a coordinator and workers of their own.
[[nodiscard]] Status Bake(const BakeRequest& request, const ClusterOptions& cluster,
                          const std::optional<Endpoint>& server,
                          const OutputOptions& output_options);

}  // namespace lucerna
