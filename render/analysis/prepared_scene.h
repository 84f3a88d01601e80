// A scene with what paths through it need: colours in the working space, the intersector, the
// lights and the scale of the fixed-point flux.
//
// Eye paths, photon batches and replays of photons use one of these, built here alone. A scene that
// moves is prepared for one time, and anew for another: all that is found on its surfaces is then
// right without knowing of motion.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "render/analysis/needs.h"
#include "render/base/status.h"
#include "render/geometry/intersector.h"
#include "render/math/fixed_point.h"
#include "render/scene/scene.h"
#include "render/scene/scene_at_time.h"
#include "render/transport/light.h"
#include "render/transport/pass_colors.h"

namespace lucerna {

class PreparedScene {
 public:
  // Takes a scene as readers return it, in Rec. 709. Threads as in InWorkingSpace.
  explicit PreparedScene(Scene rec709, int threads = 1);
  PreparedScene(const PreparedScene&) = delete;
  PreparedScene& operator=(const PreparedScene&) = delete;

  // Builds what a job with these needs uses, as of the time when the shutter opens or of another,
  // and keeps what the job before it used too. Whatever refers to scene, intersector or lights must
  // be gone unless IsPreparedFor(needs) and that time.
  // Errors: RESOURCE_EXHAUSTED when memory runs out, INTERNAL when Embree refuses the scene.
  [[nodiscard]] Status PrepareFor(const SceneNeeds& needs, std::optional<double> time = {});
  [[nodiscard]] bool IsPreparedFor(const SceneNeeds& needs, std::optional<double> time = {}) const {
    return lights_ != nullptr && needs_ == needs && time_ == TimeOf(time);
  }
  // The same scene, prepared for the same needs as of another time. Requires PrepareFor.
  // Errors: those of PrepareFor.
  [[nodiscard]] StatusOr<std::unique_ptr<PreparedScene>> At(double time) const;

  // In the working space, or at the wavelengths of a pass.
  [[nodiscard]] const Scene& scene() const { return scene_; }
  // That of which the scene is.
  [[nodiscard]] double time() const { return time_; }

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
  PreparedScene(const Scene& scene, double time, std::shared_ptr<const SceneMover> mover)
      : scene_(scene), time_(time), mover_(std::move(mover)) {}
  // All times are one where nothing moves.
  [[nodiscard]] double TimeOf(std::optional<double> time) const {
    return mover_ == nullptr ? time_ : time.value_or(scene_.motion.shutter_open);
  }

  Scene scene_;  // at `time_`
  double time_;
  std::shared_ptr<const SceneMover> mover_;  // nullptr: nothing moves
  SceneNeeds needs_;
  std::unique_ptr<Intersector> intersector_;
  std::unique_ptr<LightSet> lights_;
  FluxScale flux_scale_;
  std::unique_ptr<PassColors> colors_;  // of a job that carries wavelengths
};

}  // namespace lucerna
