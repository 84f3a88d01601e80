#include "render/analysis/prepared_scene.h"

#include <utility>

#include "render/transport/working_space.h"

namespace lucerna {

PreparedScene::PreparedScene(Scene rec709) : scene_(InWorkingSpace(std::move(rec709))) {}

Status PreparedScene::PrepareFor(const SceneNeeds& needs) {
  if (IsPreparedFor(needs)) return absl::OkStatus();
  lights_.reset();
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
