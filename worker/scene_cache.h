// Which scenes and hitpoint blocks does this worker still hold?
//
// Everything a batch needs is named by digest, and what a worker holds is only a cache: the
// tracers of the last two scenes, each with its acceleration structure, and the last hitpoint
// blocks and radii.
//
// Threads: one; what it returns may be used by another for as long as it is held.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "render/base/digest.h"
#include "render/base/memory.h"
#include "render/base/status.h"
#include "render/estimate/hitpoint_block.h"
#include "render/scene/scene_files.h"
#include "worker/batch_tracer.h"

namespace lucerna {

// The bytes of a digest, at most so many.
using FetchBytes =
    std::function<StatusOr<std::string>(const Digest& digest, std::uint64_t max_bytes)>;

// Errors: what fetching or reading the scene said.
[[nodiscard]] StatusOr<Scene> FetchScene(const SceneManifest& manifest, const FetchBytes& fetch,
                                         const SceneLimits& limits = {});

class SceneCache {
 public:
  using Fetch = FetchBytes;

  // `available` is how much memory is free [bytes].
  SceneCache(int threads, Fetch fetch, std::function<std::uint64_t()> available = AvailableMemory)
      : threads_(threads), fetch_(std::move(fetch)), available_(std::move(available)) {}

  // Errors: what fetching or reading the scene said, RESOURCE_EXHAUSTED for a scene that does not
  // fit into what is free once the other scenes are dropped.
  [[nodiscard]] StatusOr<std::shared_ptr<BatchTracer>> TracerFor(const SceneManifest& scene);
  // Errors: what fetching said, INVALID_ARGUMENT for bytes that are no block.
  [[nodiscard]] StatusOr<std::shared_ptr<const HitpointBlock>> BlockFor(const Digest& digest,
                                                                        std::size_t max_hitpoints);
  // Errors: what fetching said, INVALID_ARGUMENT for bytes that are not so many radii.
  [[nodiscard]] StatusOr<std::shared_ptr<const RadiusColumn>> RadiiFor(const Digest& digest,
                                                                       std::size_t rows);
  // Errors: what fetching said, INVALID_ARGUMENT for bytes that are no numbers of so many pixels.
  [[nodiscard]] StatusOr<std::shared_ptr<const EyePathCounts>> EyePathsFor(const Digest& digest,
                                                                           std::size_t pixels);

 private:
  template <typename Value>
  using Kept = std::deque<std::pair<Digest, std::shared_ptr<Value>>>;  // newest first

  const int threads_;
  const Fetch fetch_;
  const std::function<std::uint64_t()> available_;
  Kept<BatchTracer> tracers_;
  Kept<const HitpointBlock> blocks_;
  Kept<const RadiusColumn> radii_;
  Kept<const EyePathCounts> eye_paths_;
};

}  // namespace lucerna
