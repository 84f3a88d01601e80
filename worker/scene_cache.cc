#include "worker/scene_cache.h"

#include <algorithm>
#include <cstdint>
#include <map>

#include "render/analysis/scene_memory.h"
#include "render/formats/read_scene.h"
#include "render/wire/block_codec.h"

namespace lucerna {
namespace {

constexpr std::size_t kTracersKept = 2;
// Two passes of a job may be open, and workers fetch one ahead; leases of two jobs may alternate.
constexpr std::size_t kBlocksKept = 6;
// The slices of a round share theirs, and so do the photons of a pass. While one lease is worked
// off the next is fetched, which may be of the next round or of another job. As the one that was
// not used the longest goes, two jobs whose leases alternate keep theirs too.
constexpr std::size_t kRadiiKept = 2;
constexpr std::size_t kEyePathsKept = 2;
// What a hitpoint and its radius may need at most before compression, which cannot double it.
constexpr std::uint64_t kBytesPerHitpoint = 80;
constexpr std::uint64_t kHeadBytes = 4096;

// The value kept for `digest`, moved to the front; nullptr when there is none.
template <typename Kept>
auto Find(Kept& kept, const Digest& digest) {
  const auto found = std::find_if(kept.begin(), kept.end(),
                                  [&](const auto& entry) { return entry.first == digest; });
  if (found == kept.end()) return typename Kept::value_type::second_type();
  std::rotate(kept.begin(), found, found + 1);
  return kept.front().second;
}

}  // namespace

StatusOr<Scene> FetchScene(const SceneManifest& manifest, const FetchBytes& fetch,
                           const SceneLimits& limits) {
  // The parser would report a broken connection as an error of the scene.
  Status fetched;
  std::map<Digest, std::uint64_t> size_of;
  for (const auto& [path, entry] : manifest.entries)
    size_of[entry.digest] = entry.size_bytes;
  ManifestFiles files(manifest, [&](const Digest& file) {
    StatusOr<std::string> bytes = fetch(file, size_of[file]);
    fetched.Update(bytes.status());
    return bytes;
  });
  ParsedScene parsed = ReadScene(files, manifest.main_path, limits);
  LUCERNA_RETURN_IF_ERROR(fetched);
  LUCERNA_RETURN_IF_ERROR(parsed.ToStatus());
  return std::move(parsed.scene);
}

StatusOr<std::shared_ptr<BatchTracer>> SceneCache::TracerFor(const SceneManifest& scene) {
  const Digest digest = scene.SceneDigest();
  if (auto tracer = Find(tracers_, digest)) return tracer;
  // The oldest goes first: three scenes at once may be more than memory holds.
  while (tracers_.size() >= kTracersKept)
    tracers_.pop_back();
  SceneLimits limits;
  const std::uint64_t free_bytes = available_();
  limits.max_shape_bytes = std::min(limits.max_shape_bytes, free_bytes);
  limits.max_picture_bytes = std::min(limits.max_picture_bytes, free_bytes);
  LUCERNA_ASSIGN_OR_RETURN(Scene fetched, FetchScene(scene, fetch_, limits));
  // Before anything is built: a worker that the system ends takes the reason with it.
  const SceneMemory memory = SceneMemoryOf(
      fetched, {.robust_rays = true, .split_triangles = true, .shading_normals = true});
  Status fits = CheckSceneFits(memory, memory.PeakOfWorker(), available_());
  while (!fits.ok() && !tracers_.empty()) {
    tracers_.pop_back();
    fits = CheckSceneFits(memory, memory.PeakOfWorker(), available_());
  }
  LUCERNA_RETURN_IF_ERROR(fits);
  auto tracer = std::make_shared<BatchTracer>(std::move(fetched), threads_);
  tracers_.emplace_front(digest, tracer);
  return tracer;
}

StatusOr<std::shared_ptr<const HitpointBlock>> SceneCache::BlockFor(const Digest& digest,
                                                                    std::size_t max_hitpoints) {
  if (auto block = Find(blocks_, digest)) return block;
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes,
                           fetch_(digest, kHeadBytes + kBytesPerHitpoint * max_hitpoints));
  LUCERNA_ASSIGN_OR_RETURN(HitpointBlock decoded, DecodeHitpointBlock(bytes, max_hitpoints));
  std::shared_ptr<const HitpointBlock> block = std::make_shared<HitpointBlock>(std::move(decoded));
  blocks_.emplace_front(digest, block);
  while (blocks_.size() > kBlocksKept)
    blocks_.pop_back();
  return block;
}

StatusOr<std::shared_ptr<const RadiusColumn>> SceneCache::RadiiFor(const Digest& digest,
                                                                   std::size_t rows) {
  if (auto radii = Find(radii_, digest); radii != nullptr && radii->size() == rows) return radii;
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes,
                           fetch_(digest, kHeadBytes + kBytesPerHitpoint * rows));
  LUCERNA_ASSIGN_OR_RETURN(RadiusColumn decoded, DecodeRadii(bytes, rows));
  std::shared_ptr<const RadiusColumn> radii =
      std::make_shared<const RadiusColumn>(std::move(decoded));
  radii_.emplace_front(digest, radii);
  while (radii_.size() > kRadiiKept)
    radii_.pop_back();
  return radii;
}

StatusOr<std::shared_ptr<const EyePathCounts>> SceneCache::EyePathsFor(const Digest& digest,
                                                                       std::size_t pixels) {
  if (auto counts = Find(eye_paths_, digest); counts != nullptr && counts->size() == pixels)
    return counts;
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes,
                           fetch_(digest, kHeadBytes + kBytesPerHitpoint * pixels));
  LUCERNA_ASSIGN_OR_RETURN(EyePathCounts decoded, DecodeEyePathCounts(bytes, pixels));
  std::shared_ptr<const EyePathCounts> counts =
      std::make_shared<const EyePathCounts>(std::move(decoded));
  eye_paths_.emplace_front(digest, counts);
  while (eye_paths_.size() > kEyePathsKept)
    eye_paths_.pop_back();
  return counts;
}

}  // namespace lucerna
