// The classes of light paths that are tested, each with a tiny scene of its own: by kind of light,
// what the light meets on its way, and the surface that the camera sees (docs/path-classes.md).
//
// Kernel bias is kept below what tests allow by geometry: floors and panes are flat, radii are
// 4 % of the floor, and the camera sees no edge within a radius of a gathering surface.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "render/scene/scene.h"

namespace lucerna {

enum class LightKind {
  kTriangles,
  kSphere,
  kDisk,
  kPoint,
  kSpot,
  kDistant,
  kConstant,
  kMap,
  kPicture,
  kPortal
};
enum class Chain {
  kNone,
  kPane,
  kThinPane,
  kRoughPane,
  kMirror,
  kNarrowWall,
  kCoatedWall,
  kSubsurfaceWall,
  kDiffuseWall,
  kHairs,
  kPaneAndNarrowWall,
  kInBall,
  kInNarrowBall,
  kInRoughBall
};
enum class Floor {
  kDiffuse,
  kRoughMetal,
  kNarrowMetal,
  kTexturedMetal,
  kNarrowGlass,
  kRoughGlass,
  kCoated,
  kRoughCoated,
  kSheet,
  kMixed,
  kPatchyMetal,
  kPatchyCoat,
  kBumpy,
  kHairs,
  kSubsurface,
  kRoughSubsurface,
  kPatchySubsurface,
  kHazyCoat,
  kPatchyHaze,
  kSheer,
  kPatchySheer
};
enum class View { kPlain, kThroughGlass, kInMirror };

struct PathClass {
  LightKind light;
  Chain chain;
  Floor floor;
  View view = View::kPlain;
};

[[nodiscard]] std::vector<PathClass> AllPathClasses();

[[nodiscard]] std::string NameOf(const PathClass& cell);
// Of random numbers that belong to a name.
[[nodiscard]] std::uint64_t KeyOf(std::string_view name);

// A floor z = 0 in an image of 8 × 8 pixels. Light comes from above its far side (y > 0), or, with
// a wall there, from behind the camera by way of the wall while a black shield shades the floor
// itself.
[[nodiscard]] Scene SceneOf(const PathClass& cell);

// What a class is rendered and traced with.
struct Effort {
  int passes = 12;
  int photons = 2000;
  int paths = 16000;  // of each replica of the path tracer
  float delta_radius = 0.08F;
};

[[nodiscard]] Effort EffortFor(const PathClass& cell);

// Greatest depth of estimator and path tracer.
inline constexpr int kDepthOfPathClasses = 24;

}  // namespace lucerna
