#include "render/transport/path_wavelength.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "render/math/color_matching.h"
#include "render/math/color_space.h"
#include "render/math/dispersion.h"

namespace lucerna {
namespace {

// Of cells of 1 nm.
constexpr std::size_t kCells = static_cast<std::size_t>(kLastVisibleNm - kFirstVisibleNm);

struct Table {
  std::array<double, kCells + 1> cumulative{};
  std::array<Rgb, kCells> color;
};

Table MakeTable() {
  std::array<std::array<double, 3>, kCells> channels{};
  std::array<double, 3> sum{};
  for (std::size_t i = 0; i < kCells; ++i) {
    const double nm = kFirstVisibleNm + static_cast<double>(i) + 0.5;
    const std::array<double, 3> rec709 = Rec709(CieObserver(nm));
    for (std::size_t c = 0; c < 3; ++c) {
      double value = 0;
      for (std::size_t k = 0; k < 3; ++k)
        value += kWorkingFrom709[c][k] * rec709[k];
      channels[i][c] = std::max(0.0, value * D65At(nm));
      sum[c] += channels[i][c];
    }
  }
  Table table;
  for (std::size_t i = 0; i < kCells; ++i) {
    double density = 0;  // of cells
    for (std::size_t c = 0; c < 3; ++c)
      density += channels[i][c] / sum[c] / 3;
    table.cumulative[i + 1] = table.cumulative[i] + density;
    const auto over_density = [&](std::size_t c) {
      return density > 0 ? static_cast<float>(channels[i][c] / sum[c] / density) : 1.0F;
    };
    table.color[i] = {over_density(0), over_density(1), over_density(2)};
  }
  return table;
}

}  // namespace

PathWavelength::PathWavelength(float u) {
  static const Table table = MakeTable();
  const auto above = std::upper_bound(table.cumulative.begin() + 1, table.cumulative.end() - 1,
                                      static_cast<double>(u));
  const auto cell = static_cast<std::size_t>(above - table.cumulative.begin()) - 1;
  const double low = table.cumulative[cell];
  const double width = table.cumulative[cell + 1] - low;
  const double inside =
      width > 0 ? std::clamp((static_cast<double>(u) - low) / width, 0.0, 1.0) : 0.5;
  nm_ = static_cast<float>(kFirstVisibleNm + static_cast<double>(cell) + inside);
  color_ = table.color[cell];
}

PathWavelength::PathWavelength(float u, const Uplift* uplift) {
  if (uplift == nullptr) {
    *this = PathWavelength(u);
    return;
  }
  const auto chosen = std::min(static_cast<std::size_t>(3 * u), std::size_t{2});
  nm_ = static_cast<float>(uplift->wavelengths().nm[chosen]);
  color_ = {chosen == 0 ? 3.0F : 0.0F, chosen == 1 ? 3.0F : 0.0F, chosen == 2 ? 3.0F : 0.0F};
}

}  // namespace lucerna
