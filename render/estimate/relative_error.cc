#include "render/estimate/relative_error.h"

#include <algorithm>
#include <functional>
#include <vector>

namespace lucerna {

double RelativeErrorFloor(std::span<const double> luminances) {
  std::vector<double> lit;
  for (const double luminance : luminances) {
    if (luminance > 0) lit.push_back(luminance);
  }
  if (lit.empty()) return 0;
  const auto bright = static_cast<std::size_t>(kBrightShare * static_cast<double>(lit.size()));
  const auto first_kept = lit.begin() + static_cast<std::ptrdiff_t>(bright);
  std::ranges::nth_element(lit, first_kept, std::greater<>());
  // Sorted, so that the order of pixels does not show in the last digit.
  std::sort(first_kept, lit.end());
  double sum = 0;
  for (auto kept = first_kept; kept != lit.end(); ++kept)
    sum += *kept;
  const double mean = sum / static_cast<double>(luminances.size() - bright);
  return kFloorShare * mean * mean;
}

}  // namespace lucerna
