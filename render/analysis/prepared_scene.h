// A scene with what paths through it need: colours in the working space, the intersector, the
// lights and the scale of the fixed-point flux.
//
// Eye paths, photon batches and replays of photons use one of these, built here alone.
#pragma once

#include <memory>

#include "render/analysis/needs.h"
#include "render/base/status.h"
#include "render/geometry/intersector.h"
#include "render/math/fixed_point.h"
#include "render/scene/scene.h"
#include "render/transport/light.h"

namespace lucerna {

class PreparedScene {
 public:
  // Takes a scene as readers return it, in Rec. 709.
  explicit PreparedScene(Scene rec709);
  PreparedScene(const PreparedScene&) = delete;
  PreparedScene& operator=(const PreparedScene&) = delete;

  // Builds what a job with these needs uses, and keeps what the job before it used too. Whatever
  // refers to intersector or lights must be gone unless IsPreparedFor(needs).
  // Errors: RESOURCE_EXHAUSTED when memory runs out, INTERNAL when Embree refuses the scene.
  [[nodiscard]] Status PrepareFor(const SceneNeeds& needs);
  [[nodiscard]] bool IsPreparedFor(const SceneNeeds& needs) const {
    return lights_ != nullptr && needs_ == needs;
  }

  // In the working space.
  [[nodiscard]] const Scene& scene() const { return scene_; }

  // The rest requires that PrepareFor has returned OK.
  [[nodiscard]] const SceneNeeds& needs() const { return needs_; }
  [[nodiscard]] const Intersector& intersector() const { return *intersector_; }
  [[nodiscard]] const LightSet& lights() const { return *lights_; }
  [[nodiscard]] const FluxScale& flux_scale() const { return flux_scale_; }

 private:
  Scene scene_;
  SceneNeeds needs_;
  std::unique_ptr<Intersector> intersector_;
  std::unique_ptr<LightSet> lights_;
  FluxScale flux_scale_;
};

}  // namespace lucerna
