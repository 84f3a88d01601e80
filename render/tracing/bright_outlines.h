// Where on the film may the outlines of bright lights lie?
//
// A pixel that the outline of a bright light crosses is noisy: a path of it either meets the light
// or not. Outlines of triangles, and small analytic shapes as a whole, are projected onto the film
// from the camera, whether or not something hides them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/tracing/eye_path.h"

namespace lucerna {

struct BrightOutlines {
  // [pixels of the whole image] 1 where an outline, blurred by the lens, may lie within the pixel's
  // filter; empty: nowhere.
  std::vector<std::uint8_t> is_near;
  std::size_t count = 0;  // of them
};

[[nodiscard]] BrightOutlines FindBrightOutlines(const EyePathTracer& tracer);

}  // namespace lucerna
