#include "render/scene/medium.h"

#include "render/scene/density_grid.h"

namespace lucerna {

float Medium::GreatestDensity() const {
  return density != nullptr ? density->largest() : 1;
}

Medium::Way Medium::TravelUnevenly(Vec3 origin, Vec3 direction, float length, float column) const {
  const DensityGrid::Way way =
      density->Travel(origin, direction, static_cast<double>(length), static_cast<double>(column));
  return {static_cast<float>(way.length), static_cast<float>(way.column), way.is_through};
}

}  // namespace lucerna
