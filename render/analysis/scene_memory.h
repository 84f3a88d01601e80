// How much memory does a scene take, before anything is built of it?
//
// From the numbers of its triangles, vertices and so on, with figures that were measured
// (docs/measurements/scene-memory.md). Coordinator and worker refuse a scene that does not fit
// instead of being ended by the system.
#pragma once

#include <cstdint>

#include "render/analysis/needs.h"
#include "render/base/status.h"
#include "render/geometry/intersector.h"
#include "render/scene/scene.h"

namespace lucerna {

// In bytes.
struct SceneMemory {
  double files = 0;         // as they were uploaded, which a coordinator keeps; 0: not counted
  double shapes = 0;        // meshes, analytic shapes, instances, materials, lights
  double textures = 0;      // pixels, also of environment maps; densities of media
  double tables = 0;        // of materials below whose surfaces light is scattered
  double acceleration = 0;  // Embree's trees, with the copies of positions that they refer to
  double instances = 0;     // of that, what stands for instances in the tree above
  double lights = 0;        // of emitting triangles
  double moving = 0;        // copies of the shapes that move
  double edges = 0;         // at which discs are cut: of a worker; at most, where edges are unknown
  double bends = 0;         // of meshes with facets, as if none were flat

  // What building takes for a while beside what is kept.
  double building_trees = 0, building_edges = 0, building_bends = 0, analysing = 0;
  // Of a coordinator that traces eye paths of a scene that moves: a second one.
  double at_another_time = 0;

  // What a coordinator keeps of a job beside the image.
  [[nodiscard]] double KeptByCoordinator() const {
    return shapes + textures + tables + acceleration + lights + moving + bends;
  }
  // The greatest at one time, beside the image, of a coordinator that reads, analyses and renders
  // it, and of a worker. With what the heaps keep of memory that was freed.
  [[nodiscard]] double PeakOfCoordinator() const;
  [[nodiscard]] double PeakOfWorker() const;
};

[[nodiscard]] SceneMemory SceneMemoryOf(const Scene& scene, const RayNeeds& rays);

// Whether what is built of a scene that has been read fits beside it. Errors: RESOURCE_EXHAUSTED
// that says how much memory it takes, and what to do.
[[nodiscard]] Status CheckSceneFits(const SceneMemory& memory, double peak_bytes,
                                    std::uint64_t available_bytes);

}  // namespace lucerna
