#include "render/scene/scene_at_time.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstddef>

#include "render/scene/degenerate_triangles.h"
#include "render/scene/scene_extent.h"
#include "render/scene/shape_lists.h"
#include "render/scene/shape_moves.h"

namespace lucerna {
namespace {

// Times at which the box around a moving shape is known; between them it is bridged.
constexpr int kSteps = 64;
// What a path may leave the boxes of two steps by, over the size of all that it sweeps. A turn goes
// half way round at most, so a step turns by 2.8 degrees, and an arc leaves its chord by 3e-4 of
// its radius, which is at most about what a half turn sweeps.
constexpr float kMargin = 0x1p-9F;

bool MoveTo(const Transform& motion, TriangleMesh& mesh) {
  const bool is_finite = MoveMesh(motion, mesh);
  DropTriangles(mesh, FLT_MIN);
  return is_finite;
}
bool MoveTo(const Transform& motion, Instance& instance) {
  instance.to_world = motion * instance.to_world;
  return instance.to_world.IsFinite();
}
// A radius that is too small for single precision is so when the shutter opens or closes, and is
// left to be so: such a shape is not seen.
#define LUCERNA_MOVE(Name, list, name)                \
  bool MoveTo(const Transform& motion, Name& shape) { \
    Move##Name(shape, motion).IgnoreError();          \
    return IsFinite(shape.center);                    \
  }
LUCERNA_ANALYTIC_SHAPES(LUCERNA_MOVE)
#undef LUCERNA_MOVE

// The motion of a shape or an instance.
template <typename Shape>
auto& MotionOf(Shape& shape) {
  if constexpr (requires { shape.traits; })
    return shape.traits.motion;
  else
    return shape.motion;
}

// Calls `visit` for each shape and instance that moves.
template <typename Visit>
void ForEachMoving(Scene& scene, const Visit& visit) {
  const auto visit_list = [&](auto& list) {
    for (auto& shape : list) {
      if (MotionOf(shape) != kNoMotion) visit(shape);
    }
  };
  ForEachShapeList(scene, visit_list);
  visit_list(scene.instances);
}

Bounds BoxOf(const Scene& /*scene*/, const TriangleMesh& mesh) {
  Bounds box;
  for (const Vec3& position : mesh.positions)
    box.Add(position);
  return box;
}
Bounds BoxOf(const Scene& scene, const Instance& instance) {
  return BoundsOf(scene, instance);
}
template <typename Shape>
Bounds BoxOf(const Scene& /*scene*/, const Shape& shape) {
  const Vec3 reach = {shape.Reach(), shape.Reach(), shape.Reach()};
  Bounds box;
  box.Add(shape.center - reach);
  box.Add(shape.center + reach);
  return box;
}

// What a motion moves, where the scene holds it.
struct Moved {
  Bounds box;
  // Of thin shapes, which stay round whatever stretches them.
  float thickest = 0;
};

double LargestStretch(const Transform& transform) {
  double squares = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j)
      squares += transform.rows()[i][j] * transform.rows()[i][j];
  }
  return std::sqrt(squares);
}

// The box around all that `moved` passes.
Bounds SweptBy(const ShapeMotion& motion, const Moved& moved, double open, double close) {
  Bounds swept;
  float largest_step = 0;
  std::array<Vec3, 8> before{};
  for (int step = 0; step <= kSteps; ++step) {
    const Transform to = motion.At(open + (close - open) * step / kSteps);
    const auto thick = static_cast<float>(static_cast<double>(moved.thickest) * LargestStretch(to));
    for (std::size_t corner = 0; corner < 8; ++corner) {
      const Vec3 at = to.Point({(corner & 1) != 0 ? moved.box.high.x : moved.box.low.x,
                                (corner & 2) != 0 ? moved.box.high.y : moved.box.low.y,
                                (corner & 4) != 0 ? moved.box.high.z : moved.box.low.z});
      swept.Add(at - Vec3{thick, thick, thick});
      swept.Add(at + Vec3{thick, thick, thick});
      if (step > 0) largest_step = std::max(largest_step, MaxAbs(at - before[corner]));
      before[corner] = at;
    }
  }
  // A path lies no farther from the nearer of two steps than half of their distance, but for its
  // bend.
  const float margin = 0.5F * largest_step + kMargin * MaxAbs(swept.high - swept.low);
  swept.low = swept.low - Vec3{margin, margin, margin};
  swept.high = swept.high + Vec3{margin, margin, margin};
  return swept;
}

bool StandsStill(const ShapeMotion& motion, double open, double close) {
  return std::ranges::none_of(motion.to_world, [&](const AnimatedTransform& transform) {
    return transform.MovesWithin(open, close);
  });
}

}  // namespace

SceneMover::SceneMover(const Scene& at_open) {
  const auto keep = [](const auto& list, auto& kept) {
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (MotionOf(list[i]) != kNoMotion) kept.push_back({i, list[i]});
    }
  };
  keep(at_open.meshes, meshes_);
#define LUCERNA_KEEP(Name, list, name) keep(at_open.list, list##_);
  LUCERNA_ANALYTIC_SHAPES(LUCERNA_KEEP)
#undef LUCERNA_KEEP
  keep(at_open.instances, instances_);
}

void SceneMover::MoveTo(double time, Scene& scene) const {
  std::vector<Transform> motions;
  motions.reserve(scene.motion.of_shapes.size());
  for (const ShapeMotion& motion : scene.motion.of_shapes)
    motions.push_back(motion.At(time));
  const auto move = [&](const auto& kept, auto& list) {
    for (const auto& moving : kept) {
      auto& shape = list[moving.index];
      shape = moving.at_open;
      // When the shutter opens it is there already, to the bit.
      if (time == scene.motion.shutter_open) continue;
      const bool is_finite =
          lucerna::MoveTo(motions[static_cast<std::size_t>(MotionOf(shape))], shape);
      LUCERNA_CHECK(is_finite);
    }
  };
  move(meshes_, scene.meshes);
#define LUCERNA_MOVE_LIST(Name, list, name) move(list##_, scene.list);
  LUCERNA_ANALYTIC_SHAPES(LUCERNA_MOVE_LIST)
#undef LUCERNA_MOVE_LIST
  move(instances_, scene.instances);
  if (scene.motion.of_camera) scene.camera.camera_to_world = scene.motion.of_camera->At(time);
}

Status BeginMotion(Scene& scene) {
  SceneMotion& motion = scene.motion;
  const double open = motion.shutter_open;
  const double close = motion.shutter_close;
  if (motion.of_camera) {
    scene.camera.camera_to_world = motion.of_camera->At(open);
    if (!motion.of_camera->MovesWithin(open, close)) motion.of_camera.reset();
  }
  if (motion.of_shapes.empty()) return absl::OkStatus();

  std::vector<bool> is_used(motion.of_shapes.size(), false);
  ForEachMoving(scene,
                [&](auto& shape) { is_used[static_cast<std::size_t>(MotionOf(shape))] = true; });
  std::vector<Transform> to_open;
  std::vector<std::int32_t> numbers;  // [motions] of those that remain
  std::vector<ShapeMotion> remaining;
  for (ShapeMotion& of_shapes : motion.of_shapes) {
    const Transform place = of_shapes.Place(open);
    to_open.push_back(place * of_shapes.from_world);
    const StatusOr<Transform> from_world = place.Inverse();
    if (!from_world.ok()) {
      return absl::InvalidArgumentError(
          "a moving shape is flattened by its transform when the shutter opens");
    }
    if (of_shapes.Place(open) == of_shapes.StartPlace()) to_open.back() = Transform();
    numbers.push_back(!is_used[numbers.size()] || StandsStill(of_shapes, open, close)
                          ? kNoMotion
                          : static_cast<std::int32_t>(remaining.size()));
    if (numbers.back() == kNoMotion) continue;
    of_shapes.from_world = *from_world;
    remaining.push_back(std::move(of_shapes));
  }
  const Status moved_away = absl::InvalidArgumentError(
      "a moving shape leaves single precision while the shutter is open; let it move less far");
  std::vector<Moved> moved(remaining.size());
  bool is_finite = true;
  ForEachMoving(scene, [&](auto& shape) {
    const auto number = static_cast<std::size_t>(MotionOf(shape));
    if (to_open[number] != Transform()) is_finite = MoveTo(to_open[number], shape) && is_finite;
    MotionOf(shape) = numbers[number];
    if (numbers[number] == kNoMotion) return;
    Moved& of_motion = moved[static_cast<std::size_t>(numbers[number])];
    const Bounds box = BoxOf(scene, shape);
    if (box.empty()) return;
    of_motion.box.Add(box.low);
    of_motion.box.Add(box.high);
    if constexpr (requires { shape.kIsThin; }) {
      if (shape.kIsThin) of_motion.thickest = std::max(of_motion.thickest, shape.Reach());
    }
  });
  if (!is_finite) return moved_away;
  motion.of_shapes = std::move(remaining);
  motion.swept = {};
  for (std::size_t i = 0; i < moved.size(); ++i) {
    if (moved[i].box.empty()) continue;
    const Bounds swept = SweptBy(motion.of_shapes[i], moved[i], open, close);
    if (!IsFinite(swept.low) || !IsFinite(swept.high)) return moved_away;
    motion.swept.Add(swept.low);
    motion.swept.Add(swept.high);
  }
  return absl::OkStatus();
}

void ForgetMotion(Scene& scene) {
  ForEachMoving(scene, [](auto& shape) { MotionOf(shape) = kNoMotion; });
  scene.motion.of_shapes.clear();
  scene.motion.of_camera.reset();
  scene.motion.swept = {};
}

}  // namespace lucerna
