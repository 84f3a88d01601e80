// What every scene goes through once its files are read, whatever their format.
//
// A format's reader returns an UnfinishedScene in the units of the file. FinishScene checks it as a
// whole, warns of what will not look as meant, chooses the unit of the scene and drops triangles
// that have no area in it. The result keeps the invariants of scene/scene.h.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "render/formats/diagnostic.h"
#include "render/scene/scene.h"

namespace lucerna {

// A mesh that emits. It may turn out to have no area in single precision.
struct EmittingMesh {
  std::size_t mesh = 0;  // index in the scene
  SourceLocation location;
  std::string subject;  // what messages call it, such as: Shape "trianglemesh"
};

struct UnfinishedScene {
  Scene scene;
  // Sentences about what the format requires and the file does not have.
  std::vector<std::string> missing;
  bool has_camera = false;
  // Of a format in which the scene's camera stands for one that is missing: the warning to give.
  std::string without_camera;
  // Of a format whose files are often an object alone: a camera that sees all of it, and an even
  // sky, are added where there is none.
  bool is_object = false;
  std::vector<EmittingMesh> emitting_meshes;
};

void WarnOfLightWithoutArea(const SourceLocation& location, const std::string& subject,
                            Diagnostics& diagnostics);

// After an error nothing else is said: what seems to be missing may only have been skipped.
// `main_file` outlives the diagnostics.
[[nodiscard]] Scene FinishScene(UnfinishedScene unfinished, const std::string& main_file,
                                Diagnostics& diagnostics);

}  // namespace lucerna
