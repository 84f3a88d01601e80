// What is the right image, when a job brings one?
#pragma once

#include <string_view>
#include <vector>

#include "render/base/status.h"
#include "render/math/rgb.h"
#include "render/scene/render_settings.h"

namespace lucerna {

// R, G, B [pixels], row-major in the crop window; finite.
using ReferenceImage = std::vector<Rgb>;

// Squared errors against it, over the pixels and as ErrorEstimate has them.
struct TrueError {
  double relative = 0;
  double absolute = 0;
  double untrimmed = 0;  // relative, of all pixels
};

// Errors: INVALID_ARGUMENT for bytes that are not an EXR image of the job's size with R, G, B.
[[nodiscard]] StatusOr<ReferenceImage> ReadReference(std::string_view exr_bytes,
                                                     const RenderSettings& settings);

}  // namespace lucerna
