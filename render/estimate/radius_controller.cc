#include "render/estimate/radius_controller.h"

namespace lucerna {

std::unique_ptr<RadiusController> MakeRadiusController(const RenderSettings& settings,
                                                       float initial_radius) {
  switch (settings.radius_controller) {
#define LUCERNA_CASE(Name, name, evidence) \
  case RadiusControllerKind::k##Name:      \
    return Make##Name(settings, initial_radius);
    LUCERNA_RADIUS_CONTROLLERS(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  return nullptr;
}

}  // namespace lucerna
