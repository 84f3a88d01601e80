#include "render/estimate/radius_controller.h"

#include <cmath>

namespace lucerna {

double ScheduledShrink(double alpha, const PassRange& passes) {
  double square = 1;
  for (std::uint64_t pass = passes.first; pass < passes.last; ++pass) {
    const auto i = static_cast<double>(pass + 1);
    square *= (i + alpha) / (i + 1);
  }
  return std::sqrt(square);
}

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
