// Is a submission a job that can be rendered?
//
// Reads its scene from the blob store and checks all there is to check. Knows nothing of other
// jobs.
//
// Threads: any; may take long, so not for an RPC thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "render/analysis/needs.h"
#include "render/analysis/scene_memory.h"
#include "render/bake/bake_settings.h"
#include "render/base/digest.h"
#include "render/base/status.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"
#include "render/scene/scene_files.h"
#include "server/blob_store.h"
#include "server/reference_image.h"
#include "server/work_pool.h"

namespace lucerna {

struct Submission {
  std::string request_id;
  std::string name;
  SceneManifest manifest;
  RenderOverrides overrides;
  bool validate_only = false;
  int priority = 0;
  std::optional<Digest> reference;        // of an EXR image among the blobs
  std::string owner = {};                 // who submits it; empty: unknown
  bool is_traced = false;                 // its timeline is kept (server/job_trace.h)
  std::optional<BakeSettings> bake = {};  // what is measured in place of an image
};

// A submission that was found good.
struct CheckedJob {
  Submission submission;
  Scene scene;
  std::vector<std::string> warnings;
  RenderSettings settings;
  SceneNeeds needs;
  SceneMemory scene_memory;
  PinnedBlobs pinned;  // all files of the scene, and the reference
};

class JobIntake {
 public:
  // The store outlives the intake. `max_job_bytes` is for the image of one job and its scene. While
  // that is read its shapes may have a quarter of it and its pictures another: the analysis of a
  // scene, and the tree over it, take several times the memory of the shapes.
  JobIntake(BlobStore& blobs, std::uint64_t max_job_bytes)
      : blobs_(blobs), max_job_bytes_(max_job_bytes) {}

  // Errors: INVALID_ARGUMENT with all errors of scene and settings, FAILED_PRECONDITION when blobs
  // are missing, RESOURCE_EXHAUSTED when image or scene do not fit into memory, or what
  // `still_needed` says, which is asked between two files. Of a bake all but its rounds is checked.
  [[nodiscard]] StatusOr<CheckedJob> Check(const Submission& submission,
                                           const StillNeeded& still_needed) const;

  struct ReadResult {
    Scene scene;
    std::vector<std::string> warnings;
  };
  // Errors: those of the scene, or what `still_needed` says.
  [[nodiscard]] StatusOr<ReadResult> ReadScene(const SceneManifest& manifest,
                                               const StillNeeded& still_needed) const;
  // Errors: as lucerna::ReadReference, or NOT_FOUND.
  [[nodiscard]] StatusOr<ReferenceImage> ReadReference(const Digest& digest,
                                                       const RenderSettings& settings) const;

 private:
  BlobStore& blobs_;
  const std::uint64_t max_job_bytes_;
};

}  // namespace lucerna
