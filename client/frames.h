// Which scenes and images belong to a command that renders several?
//
// A run of # in the name of a scene or of an image stands for the number of a frame, with zeros in
// front up to as many digits: room.####.pbrt and 7 are room.0007.pbrt.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "render/base/status.h"

namespace lucerna {

struct SceneFrame {
  std::string scene;  // path
  int number = 0;
};

[[nodiscard]] bool HasFrameNumber(std::string_view path);
// `path` with its last run of # replaced; as it is where there is none.
[[nodiscard]] std::string WithFrameNumber(std::string_view path, int number);

// The scenes in order. With `frames`, such as "1-24" or "1,5,8-10", each scene once for every
// number. Else a scene's number is what its file's name ends with, before the ending, or its place
// in the list, from 1.
// Errors: Failure(kUsage) for frames that are none or more than 100,000, frames without a #, and
// a # without frames.
[[nodiscard]] StatusOr<std::vector<SceneFrame>> FramesOf(const std::vector<std::string>& scenes,
                                                         std::string_view frames);

}  // namespace lucerna
