// How is the irradiance of a scene's surfaces measured?
//
// As a job like any other (render/bake/bake_rounds.h), whose end is a mesh or a light map in place
// of an image.
#pragma once

#include <string>

#include "client/connection.h"
#include "client/local_cluster.h"
#include "client/output_options.h"
#include "client/scene_reading.h"
#include "render/bake/bake_settings.h"
#include "render/base/status.h"
#include "render/scene/render_settings.h"
#include "render/wire/channel.h"

namespace lucerna {

// What is written of a bake.
struct BakeOutputs {
  std::string path;          // .ply or .glb; of a light map .exr
  std::string plan = {};     // .svg; empty: none
  std::string uv_mesh = {};  // of a light map: .glb; empty: none
  bool is_ascii = false;     // of a PLY file
  bool in_lux = false;       // the table
};

struct BakeRequest {
  SceneSource scene;
  RenderOverrides overrides;  // of each round
  BakeSettings settings;
  BakeOutputs outputs;   // without a path: the job is submitted alone
  int priority = 0;      // that of Job
  bool resumes = false;  // goes on with a bake of its own that was interrupted
};

// Writes the mesh whole or not at all, and prints figures of its surfaces. The job runs on `server`
// when it is there, and goes on there when this process is interrupted; else on a coordinator and
// workers of its own, whose state is in a folder beside the output until it has been written.
[[nodiscard]] Status Bake(BakeRequest request, const ClusterOptions& cluster,
                          const std::optional<Endpoint>& server,
                          const OutputOptions& output_options);

// Whether the files to write go together. Errors: Failure(kUsage).
[[nodiscard]] Status CheckBakeOutputs(const BakeOutputs& outputs);

// Writes what a bake made. Errors: also FAILED_PRECONDITION when it made something else.
[[nodiscard]] Status SaveBake(ClientConnection& connection, const v1::Job& job,
                              const BakeOutputs& outputs, const OutputOptions& output_options);

}  // namespace lucerna
