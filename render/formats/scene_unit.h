// Chooses the unit of length in which a scene is rendered.
//
// Squares and fourth powers of lengths are floats, and have no digits left where a room is a
// micrometre of a micrometre wide or spans light years. Such a scene is converted to another unit,
// a power of two of the file's, so that its image is the same to the last bit as if the range of
// floats had no end. Scenes of common sizes keep the file's unit.
#pragma once

#include "render/base/status.h"
#include "render/scene/scene.h"

namespace lucerna {

// Sets Scene::unit and brings everything that has a length to it.
// Errors: OUT_OF_RANGE when the intensity of a light is no float in that unit.
[[nodiscard]] Status ChooseUnit(Scene& scene);

}  // namespace lucerna
