#include "render/analysis/prepared_scene.h"

#include <utility>

#include "render/transport/working_space.h"

namespace lucerna {

PreparedScene::PreparedScene(Scene rec709, int threads)
    : scene_(InWorkingSpace(std::move(rec709), threads)),
      time_(scene_.motion.shutter_open),
      mover_(scene_.motion.Moves() ? std::make_shared<const SceneMover>(scene_) : nullptr) {}

Status PreparedScene::PrepareFor(const SceneNeeds& needs, std::optional<double> time) {
  if (IsPreparedFor(needs, time)) return absl::OkStatus();
  lights_.reset();
  if (const double to = TimeOf(time); to != time_) {
    intersector_.reset();
    mover_->MoveTo(to, scene_);
    time_ = to;
  }
  if (intersector_ == nullptr || needs_.rays() != needs.rays()) {
    intersector_.reset();
    LUCERNA_ASSIGN_OR_RETURN(intersector_, Intersector::Create(scene_, needs.rays()));
  }
  needs_ = needs;
  lights_ = std::make_unique<LightSet>(scene_, *intersector_, needs_.lights());
  flux_scale_ = FluxScale::ForPower(lights_->TotalPower());
  colors_ = needs_.Uses(Part::kSpectra) ? std::make_unique<PassColors>(scene_) : nullptr;
  return absl::OkStatus();
}

StatusOr<std::unique_ptr<PreparedScene>> PreparedScene::At(double time) const {
  std::unique_ptr<PreparedScene> other(new PreparedScene(scene_, time_, mover_));
  LUCERNA_RETURN_IF_ERROR(other->PrepareFor(needs_, time));
  return other;
}

PreparedScene::AtPass::AtPass(PreparedScene& prepared, std::uint64_t seed, std::uint64_t pass)
    : prepared_(prepared) {
  if (prepared_.colors_ == nullptr) return;
  prepared_.colors_->SetAt(WavelengthsOfPass(seed, pass), prepared_.scene_);
  prepared_.lights_->TakeColors();
}

PreparedScene::AtPass::~AtPass() {
  if (prepared_.colors_ == nullptr) return;
  prepared_.colors_->SetThree(prepared_.scene_);
  prepared_.lights_->TakeColors();
}

}  // namespace lucerna
