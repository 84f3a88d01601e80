// A scene with what paths through it need: colours in the working space, the intersector, the
// lights and the scale of the fixed-point flux.
//
// Eye paths, photon batches and replays of photons use one of these, built here alone.
#pragma once

#include <cstdint>
#include <memory>

#include "render/analysis/needs.h"
#include "render/base/status.h"
#include "render/geometry/intersector.h"
#include "render/math/fixed_point.h"
#include "render/scene/scene.h"
#include "render/transport/light.h"
#include "render/transport/pass_colors.h"

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

  // In the working space, or at the wavelengths of a pass.
  [[nodiscard]] const Scene& scene() const { return scene_; }

  // Gives scene() and lights() of a job that carries wavelengths those of a pass, until the object
  // is gone; of other jobs nothing changes. Requires that PrepareFor has returned OK, and that
  // nobody uses them meanwhile but for that pass.
  class AtPass {
   public:
    AtPass(PreparedScene& prepared, std::uint64_t seed, std::uint64_t pass);
    ~AtPass();
    AtPass(const AtPass&) = delete;
    AtPass& operator=(const AtPass&) = delete;

   private:
    PreparedScene& prepared_;
  };

  // The rest requires that PrepareFor has returned OK.
  [[nodiscard]] const SceneNeeds& needs() const { return needs_; }
  [[nodiscard]] const Intersector& intersector() const { return *intersector_; }
  [[nodiscard]] const LightSet& lights() const { return *lights_; }
  [[nodiscard]] const FluxScale& flux_scale() const { return flux_scale_; }
  // At least how many times its power [luminance] a light has in any pass: 1 where its colour is
  // the same in all.
  [[nodiscard]] double largest_power() const {
    return colors_ == nullptr ? 1 : colors_->largest_power();
  }

 private:
  Scene scene_;
  SceneNeeds needs_;
  std::unique_ptr<Intersector> intersector_;
  std::unique_ptr<LightSet> lights_;
  FluxScale flux_scale_;
  std::unique_ptr<PassColors> colors_;  // of a job that carries wavelengths
};

}  // namespace lucerna
