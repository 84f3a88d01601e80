#include "render/formats/pbrt/rgb_space.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "render/base/text.h"
#include "render/formats/wavelength_color.h"
#include "render/math/color_matching.h"
#include "render/math/color_space.h"

namespace lucerna {

struct RgbSpace {
  std::string_view name;
  Chromaticity red, green, blue, white;
};

namespace {

using Column = std::array<double, 3>;

// ITU-R BT.709 and BT.2020, SMPTE EG 432-1, and SMPTE ST 2065-1.
constexpr std::array<RgbSpace, 4> kSpaces = {{
    {"srgb", {0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, {0.3127, 0.3290}},
    {"rec2020", {0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, {0.3127, 0.3290}},
    {"dci-p3", {0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {0.3127, 0.3290}},
    {"aces2065-1", {0.7347, 0.2653}, {0.0, 1.0}, {0.0001, -0.0770}, {0.32168, 0.33767}},
}};

// Requires a determinant other than 0. By cofactors, whose indices go round.
ColorMatrix Inverse(const ColorMatrix& m) {
  const auto cofactor = [&](std::size_t row, std::size_t column) {
    const auto at = [&](std::size_t r, std::size_t c) {
      return m[(row + r) % 3][(column + c) % 3];
    };
    return at(1, 1) * at(2, 2) - at(1, 2) * at(2, 1);
  };
  double determinant = 0;
  for (std::size_t column = 0; column < 3; ++column)
    determinant += m[0][column] * cofactor(0, column);
  ColorMatrix out{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column)
      out[column][row] = cofactor(row, column) / determinant;
  }
  return out;
}

Column XyzOf(Chromaticity place) {
  return {place.x / place.y, 1, (1 - place.x - place.y) / place.y};
}

// To CIE XYZ, the white at luminance 1.
ColorMatrix XyzFrom(const RgbSpace& space) {
  ColorMatrix primaries{};
  const std::array places = {space.red, space.green, space.blue};
  for (std::size_t c = 0; c < 3; ++c) {
    primaries[0][c] = places[c].x;
    primaries[1][c] = places[c].y;
    primaries[2][c] = 1 - places[c].x - places[c].y;
  }
  const Column strengths = Transformed(Inverse(primaries), XyzOf(space.white));
  for (Column& row : primaries) {
    for (std::size_t c = 0; c < 3; ++c)
      row[c] *= strengths[c];
  }
  return primaries;
}

// Between whites, by the cone responses of Lam 1985 ("Bradford").
ColorMatrix Adapted(Chromaticity from, Chromaticity to) {
  constexpr ColorMatrix kCones = {
      {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};
  const Column before = Transformed(kCones, XyzOf(from));
  const Column after = Transformed(kCones, XyzOf(to));
  ColorMatrix scaled = kCones;
  for (std::size_t row = 0; row < 3; ++row) {
    for (double& value : scaled[row])
      value *= after[row] / before[row];
  }
  return Product(Inverse(kCones), scaled);
}

// Of daylight, below 4000 K of a black body.
Chromaticity WhiteAt(double temperature_k) {
  // As pbrt-v4 has it: both by the constant of Planck's law of today.
  const double t = temperature_k * 1.4388 / 1.4380;
  if (t >= 4000) return DaylightChromaticity(temperature_k);
  Column sum{};
  for (double nm = kFirstObservedNm; nm <= kLastObservedNm; ++nm) {
    const Xyz seen = CieObserver(nm);
    // Planck's law, up to a factor.
    const double power = 1 / (std::pow(nm * 1e-3, 5) * std::expm1(1.4388e7 / (nm * t)));
    for (std::size_t c = 0; c < 3; ++c)
      sum[c] += power * seen[c];
  }
  const double all = sum[0] + sum[1] + sum[2];
  return {sum[0] / all, sum[1] / all};
}

}  // namespace

const RgbSpace* FindRgbSpace(std::string_view name) {
  const auto found = std::ranges::find(kSpaces, name, &RgbSpace::name);
  return found == kSpaces.end() ? nullptr : &*found;
}

std::string RgbSpaceNames() {
  std::vector<std::string_view> names;
  for (const RgbSpace& space : kSpaces)
    names.push_back(space.name);
  return Concat("there are ", Listed(names));
}

void ToRec709(std::vector<Parameter>& parameters, const RgbSpace* space) {
  if (space == nullptr || space == &kSpaces[0]) return;
  const ColorMatrix convert =
      Product(Inverse(XyzFrom(kSpaces[0])),
              Product(Adapted(space->white, kSpaces[0].white), XyzFrom(*space)));
  for (Parameter& parameter : parameters) {
    if (parameter.type != "rgb") continue;
    parameter.is_converted = true;
    for (std::size_t i = 0; i + 3 <= parameter.numbers.size(); i += 3) {
      const Column given = {parameter.numbers[i], parameter.numbers[i + 1],
                            parameter.numbers[i + 2]};
      const Column color = Transformed(convert, given);
      for (std::size_t c = 0; c < 3; ++c)
        parameter.numbers[i + c] = std::max(0.0, color[c]);
    }
  }
}

ColorMatrix WhiteBalance(double temperature_k) {
  const RgbSpace& rec709 = kSpaces[0];
  const ColorMatrix from = XyzFrom(rec709);
  return Product(Inverse(from), Product(Adapted(WhiteAt(temperature_k), rec709.white), from));
}

}  // namespace lucerna
