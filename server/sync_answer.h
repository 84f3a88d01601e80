// What does the coordinator answer to a worker's Sync?
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "render/analysis/needs.h"
#include "render/base/digest.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene_files.h"
#include "server/scheduler.h"

namespace lucerna {

// What a worker must fetch for a pass.
struct PassBlobs {
  Digest block;
  Digest radii;
  std::size_t hitpoints = 0;
};

// A batch with all that a worker needs for it.
struct Loan {
  BatchLease lease;
  SceneManifest scene;
  RenderSettings settings;
  SceneNeeds needs;
  PassBlobs blobs;
};

struct SyncAnswer {
  std::optional<Loan> loan;
  std::vector<std::string> revoked;  // lease ids
};

}  // namespace lucerna
