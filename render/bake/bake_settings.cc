#include "render/bake/bake_settings.h"

#include <cmath>

namespace lucerna {

Status CheckBake(const BakeSettings& settings, const RenderOverrides& overrides) {
  const bool is_histogram = settings.estimator == BakeEstimator::kHistogram;
  if (settings.spacing && !(*settings.spacing > 0 && std::isfinite(*settings.spacing))) {
    return absl::InvalidArgumentError("--spacing is a length above 0");
  }
  if (!(settings.tolerance >= 0 && std::isfinite(settings.tolerance))) {
    return absl::InvalidArgumentError("--tolerance is a number from 0 on");
  }
  if (settings.is_light_map && is_histogram) {
    return absl::InvalidArgumentError(
        "a histogram is of triangles, and a light map has none; leave --estimator away");
  }
  if (settings.is_light_map && settings.elements == MeshElements::kQuadratic) {
    return absl::InvalidArgumentError("--elements is for meshes, and a light map is none");
  }
  if (is_histogram && settings.elements == MeshElements::kQuadratic) {
    return absl::InvalidArgumentError(
        "a histogram is constant on its triangles; leave --elements away");
  }
  const bool is_chosen = overrides.radius_controller || overrides.kernel;
  if (is_histogram && (is_chosen || overrides.initial_radius || overrides.initial_footprints)) {
    return absl::InvalidArgumentError(
        "a histogram has no kernel and no radius: its triangles are its buckets");
  }
  if (overrides.width) {
    return absl::InvalidArgumentError("--size has no meaning here: --spacing says how fine to be");
  }
  if (overrides.crop || overrides.coverage || overrides.denoise) {
    return absl::InvalidArgumentError(
        absl::StrCat(overrides.crop       ? "--crop"
                     : overrides.coverage ? "--coverage"
                                          : "--denoise",
                     " has no meaning here: what is measured is no image; leave it away"));
  }
  return absl::OkStatus();
}

}  // namespace lucerna
