#include "render/estimate/relative_error.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <vector>

namespace lucerna {

double RelativeErrorFloor(std::span<const double> luminances) {
  const auto is_lit = [](double luminance) { return luminance > 0; };
  const auto lit = static_cast<std::size_t>(std::ranges::count_if(luminances, is_lit));
  if (lit == 0) return 0;
  const auto bright = static_cast<std::size_t>(kBrightShare * static_cast<double>(lit));
  std::vector<double> by_size;
  by_size.reserve(lit);
  std::ranges::copy_if(luminances, std::back_inserter(by_size), is_lit);
  const auto first_kept = by_size.begin() + static_cast<std::ptrdiff_t>(bright);
  std::ranges::nth_element(by_size, first_kept, std::greater<>());
  // In the order of pixels; of those as large as the largest kept, as many as are.
  const double largest = *first_kept;
  double sum = 0;
  std::size_t smaller = 0;
  for (const double luminance : luminances) {
    if (!is_lit(luminance) || luminance >= largest) continue;
    sum += luminance;
    ++smaller;
  }
  sum += largest * static_cast<double>(lit - bright - smaller);
  const double mean = sum / static_cast<double>(luminances.size() - bright);
  return kFloorShare * mean * mean;
}

}  // namespace lucerna
