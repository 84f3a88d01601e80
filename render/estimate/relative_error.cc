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
  std::vector<double> by_size = lit;
  const auto first_kept = by_size.begin() + static_cast<std::ptrdiff_t>(bright);
  std::ranges::nth_element(by_size, first_kept, std::greater<>());
  // In the order of pixels; of those as large as the largest kept, as many as are.
  const double largest = *first_kept;
  double sum = 0;
  std::size_t smaller = 0;
  for (const double luminance : lit) {
    if (luminance >= largest) continue;
    sum += luminance;
    ++smaller;
  }
  sum += largest * static_cast<double>(lit.size() - bright - smaller);
  const double mean = sum / static_cast<double>(luminances.size() - bright);
  return kFloorShare * mean * mean;
}

}  // namespace lucerna
