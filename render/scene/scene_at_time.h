// Puts what moves where it is at a time.
//
// What moves is put anew from where it is when the shutter opens, so that the result depends on the
// time alone, not on the times before.
#pragma once

#include <vector>

#include "render/base/status.h"
#include "render/scene/analytic_shapes.h"
#include "render/scene/scene.h"

namespace lucerna {

class SceneMover {
 public:
  // Keeps copies of the shapes that move of a scene as readers return it.
  explicit SceneMover(const Scene& at_open);

  // Moves this scene, or a copy of it. Triangles that have no area there are left out.
  // Requires a time while the shutter is open.
  void MoveTo(double time, Scene& scene) const;

 private:
  template <typename Shape>
  struct Moving {
    std::size_t index = 0;  // in the scene
    Shape at_open;
  };
  std::vector<Moving<TriangleMesh>> meshes_;
#define LUCERNA_MEMBER(Name, list, name) std::vector<Moving<Name>> list##_;
  LUCERNA_ANALYTIC_SHAPES(LUCERNA_MEMBER)
#undef LUCERNA_MEMBER
  std::vector<Moving<Instance>> instances_;
};

// For readers, once all shapes are where the start transforms of their motions have them: puts them
// where they are when the shutter opens, forgets the motion of what stands still while it is open,
// and finds SceneMotion::swept.
// Errors: INVALID_ARGUMENT when something moves out of single precision.
[[nodiscard]] Status BeginMotion(Scene& scene);

// Leaves everything where it is.
void ForgetMotion(Scene& scene);

}  // namespace lucerna
