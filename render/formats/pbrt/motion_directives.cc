// What moves while the shutter is open: shapes, instances and the camera, between the two current
// transforms. As in pbrt-v4, lights and the places of textures stand still.
#include <utility>

#include "render/base/text.h"
#include "render/formats/pbrt/directives.h"

namespace lucerna {
namespace {

// Each is followed through the shutter's time.
constexpr std::size_t kMaxMotions = std::size_t{1} << 17;

}  // namespace

std::optional<AnimatedTransform> DirectiveReader::Animated(const TransformPair& transforms,
                                                           Arguments& arguments) {
  StatusOr<AnimatedTransform> animated =
      AnimatedTransform::Create(transforms.start, transform_start_, transforms.end, transform_end_);
  if (animated.ok()) return *std::move(animated);
  arguments.Error(Concat("this motion is not possible: ", animated.status().message()));
  return std::nullopt;
}

std::int32_t DirectiveReader::MotionHere(Arguments& arguments) {
  if (!graphics_.state().to_world.Moves()) return kNoMotion;
  return MotionOfInstance(kNoMotion, arguments);
}

std::int32_t DirectiveReader::MotionOfInstance(std::int32_t within, Arguments& arguments) {
  const TransformPair& here = graphics_.state().to_world;
  if (!here.Moves() && within == kNoMotion) return kNoMotion;
  if (last_motion_ != kNoMotion && last_within_ == within && last_transforms_ == here)
    return last_motion_;
  std::vector<ShapeMotion>& motions = scene_.motion.of_shapes;
  if (motions.size() >= kMaxMotions) {
    arguments.Error(Concat("the scene has more than ", kMaxMotions,
                           " motions; let shapes that move alike follow one another"));
    is_stopped_ = true;
    return kNoMotion;
  }
  const std::optional<AnimatedTransform> outer = Animated(here, arguments);
  if (!outer) return kNoMotion;
  ShapeMotion motion;
  motion.to_world.push_back(*outer);
  if (within != kNoMotion) {
    const std::vector<AnimatedTransform>& inner =
        motions[static_cast<std::size_t>(within)].to_world;
    motion.to_world.insert(motion.to_world.end(), inner.begin(), inner.end());
  }
  const StatusOr<Transform> from_world = motion.StartPlace().Inverse();
  if (!from_world.ok()) {
    arguments.Error(Concat("this motion is not possible: ", from_world.status().message()));
    return kNoMotion;
  }
  motion.from_world = *from_world;
  motions.push_back(std::move(motion));
  last_motion_ = static_cast<std::int32_t>(motions.size()) - 1;
  last_within_ = within;
  last_transforms_ = here;
  return last_motion_;
}

void DirectiveReader::WarnIfMoved(const Arguments& arguments, std::string_view what) {
  if (!graphics_.state().to_world.Moves()) return;
  diagnostics_.Warning(arguments.location(),
                       Concat(what, ": it stands where the transform at the start puts it"));
}

}  // namespace lucerna
