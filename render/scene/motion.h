// What moves while the shutter is open.
//
// A Scene holds everything where it is when the shutter opens. Each pass sees the scene at one time
// (analysis/pass_time.h), at which scene/scene_at_time.h puts what moves. Lights stand still.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "render/math/animated_transform.h"
#include "render/math/vector.h"

namespace lucerna {

// How shapes move, in the place of an index into SceneMotion::of_shapes.
inline constexpr std::int32_t kNoMotion = -1;

// Where shapes are that have a place in the scene: the product of transforms, the first applied
// last.
struct ShapeMotion {
  std::vector<AnimatedTransform> to_world;
  Transform from_world;  // from where the scene holds them

  // From where the scene holds them to where they are.
  [[nodiscard]] Transform At(double time) const { return Place(time) * from_world; }
  [[nodiscard]] Transform Place(double time) const {
    Transform place;
    for (const AnimatedTransform& transform : to_world)
      place = place * transform.At(time);
    return place;
  }
  // What the start transforms make.
  [[nodiscard]] Transform StartPlace() const {
    Transform place;
    for (const AnimatedTransform& transform : to_world)
      place = place * transform.start();
    return place;
  }
  bool operator==(const ShapeMotion&) const = default;
};

// Times are those of the scene's file; only their ratios matter.
struct SceneMotion {
  double shutter_open = 0, shutter_close = 1;
  std::vector<ShapeMotion> of_shapes;
  std::optional<AnimatedTransform> of_camera;  // camera to world
  // Around all that moving shapes pass while the shutter is open.
  Bounds swept;

  [[nodiscard]] bool Moves() const { return !of_shapes.empty() || of_camera.has_value(); }
};

}  // namespace lucerna
