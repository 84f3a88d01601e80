#include "render/scene/measured_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "render/math/color_matching.h"
#include "render/math/color_space.h"
#include "render/math/warp.h"

namespace lucerna {
namespace {

// D18: the square's x goes with the angle to the normal, finer where that is small.
float SquareOfTheta(float theta) {
  return std::sqrt(theta * (2 / kPi));
}
float ThetaOfSquare(float x) {
  return x * x * (kPi / 2);
}
float SquareOfPhi(float phi) {
  const float turns = (phi + kPi) / (2 * kPi);
  return turns - std::floor(turns);
}

// The angle to the normal, without the cancellation of arccosines near it.
float ThetaOf(Vec3 d) {
  return 2 * std::asin(std::min(1.0F, 0.5F * Length(d - Vec3{0, 0, 1})));
}

// Between which two values of `knots` (increasing) `at` lies; beyond them, the nearest one.
GridCell Between(const std::vector<float>& knots, float at) {
  if (knots.size() == 1 || !(at > knots.front())) return {0, 0};
  if (at >= knots.back()) return {knots.size() - 2, 1};
  const auto above = std::ranges::upper_bound(knots, at);
  const auto first = static_cast<std::size_t>(above - knots.begin()) - 1;
  return {first, (at - knots[first]) / (knots[first + 1] - knots[first])};
}

// [wavelengths]: what a value at each of them adds to a colour in the working space, in daylight;
// of values that are 1 everywhere the colour is white.
std::vector<Rgb> ColorsOf(const std::vector<float>& wavelength_nm) {
  constexpr double kFirstNm = 360, kLastNm = 830;
  std::vector<Xyz> sums(wavelength_nm.size(), Xyz{0, 0, 0});
  Xyz white = {0, 0, 0};
  for (double nm = kFirstNm; nm <= kLastNm; nm += 1) {
    const Xyz matching = CieObserver(nm);
    const GridCell cell = Between(wavelength_nm, static_cast<float>(nm));
    const auto within = static_cast<double>(cell.within);
    for (std::size_t i = 0; i < 3; ++i) {
      const double seen = matching[i] * D65At(nm);
      white[i] += seen;
      sums[cell.first][i] += (1 - within) * seen;
      if (within > 0) sums[cell.first + 1][i] += within * seen;
    }
  }
  const auto of_white = Rec709(white);
  std::vector<Rgb> colors;
  colors.reserve(sums.size());
  for (const Xyz& sum : sums) {
    const auto rec709 = Rec709(sum);
    colors.push_back(ToWorking({static_cast<float>(rec709[0] / of_white[0]),
                                static_cast<float>(rec709[1] / of_white[1]),
                                static_cast<float>(rec709[2] / of_white[2])}));
  }
  return colors;
}

// [directions × 3 × knots] of [directions × wavelengths × knots].
std::vector<float> InWorkingSpace(const std::vector<float>& values, std::size_t knots,
                                  const std::vector<Rgb>& colors) {
  const std::size_t wavelengths = colors.size();
  const std::size_t directions = values.size() / (wavelengths * knots);
  std::vector<float> mixed;
  mixed.reserve(directions * 3 * knots);
  for (std::size_t d = 0; d < directions; ++d) {
    const float* first = &values[d * wavelengths * knots];
    for (int channel = 0; channel < 3; ++channel) {
      for (std::size_t k = 0; k < knots; ++k) {
        double sum = 0;
        for (std::size_t w = 0; w < wavelengths; ++w)
          sum +=
              static_cast<double>(colors[w][channel]) * static_cast<double>(first[w * knots + k]);
        mixed.push_back(static_cast<float>(std::max(sum, 0.0)));
      }
    }
  }
  return mixed;
}

}  // namespace

MeasuredTable::MeasuredTable(MeasuredData data)
    : phi_rad_(std::move(data.phi_rad)),
      theta_rad_(std::move(data.theta_rad)),
      wavelength_nm_(std::move(data.wavelength_nm)),
      is_over_facets_(data.is_over_facets),
      facets_(data.facets_size, std::move(data.facets)),
      projected_(data.projected_size, std::move(data.projected)),
      visible_(data.visible_size, std::move(data.visible)),
      luminance_(data.values_size, std::move(data.luminance)),
      colors_(data.values_size,
              InWorkingSpace(data.values, data.values_size.knots(), ColorsOf(wavelength_nm_))),
      is_black_(std::ranges::all_of(data.values, [](float value) { return value == 0; })),
      values_(data.values_size, std::move(data.values)) {
  if (is_anisotropic()) {
    const float parts = 2 * kPi / (phi_rad_.back() - phi_rad_.front());
    mirrored_ = parts > 3 ? 4 : parts > 1.5F ? 2 : 1;
  }
  MeasureFromAbove();
}

MeasuredTable::Planes MeasuredTable::WorkingSpace() const {
  const auto first = static_cast<float>(wavelength_nm_.size());
  return {first, first + 1, first + 2};
}

MeasuredTable::Planes MeasuredTable::At(const std::array<double, 3>& nm) const {
  Planes planes{};
  for (std::size_t i = 0; i < 3; ++i) {
    const GridCell cell = Between(wavelength_nm_, static_cast<float>(nm[i]));
    planes[i] = static_cast<float>(cell.first) + cell.within;
  }
  return planes;
}

MeasuredTable::Seen MeasuredTable::SeenFrom(Vec3 wo) const {
  Seen seen;
  if (mirrored_ > 1) {
    const float side = mirrored_ == 4 ? wo.x : wo.y;
    seen.flip_x = side > 0 ? -1.0F : 1.0F;
    seen.flip_y = wo.y > 0 ? -1.0F : 1.0F;
  }
  seen.wo = {seen.flip_x * wo.x, seen.flip_y * wo.y, wo.z};
  seen.phi = std::atan2(seen.wo.y, seen.wo.x);
  const float theta = ThetaOf(wo);
  const GridCell phi_cell = Between(phi_rad_, seen.phi);
  const GridCell theta_cell = Between(theta_rad_, theta);
  for (std::size_t i = 0; i < 4; ++i) {
    const bool is_high_phi = i >= 2;
    const bool is_high_theta = i % 2 == 1;
    seen.mixture.grid[i] = (phi_cell.first + (is_high_phi ? 1 : 0)) * theta_rad_.size() +
                           theta_cell.first + (is_high_theta ? 1 : 0);
    seen.mixture.share[i] = (is_high_phi ? phi_cell.within : 1 - phi_cell.within) *
                            (is_high_theta ? theta_cell.within : 1 - theta_cell.within);
  }
  constexpr float kLeastArea = 1e-6F;
  if (is_over_facets_) {
    const float area = projected_.At(0, {SquareOfTheta(theta), SquareOfPhi(seen.phi)});
    seen.facets_over = 1 / (4 * std::max(area, kLeastArea));
  }
  return seen;
}

Vec2 MeasuredTable::PlaceOf(const Seen& seen, Vec3 m) const {
  const float phi = std::atan2(m.y, m.x);
  return {SquareOfTheta(ThetaOf(m)), SquareOfPhi(is_anisotropic() ? phi : phi - seen.phi)};
}

float MeasuredTable::Jacobian(const Seen& seen, Vec3 m, Vec2 place) {
  // dω of m over d(square), and dω of wi over that of m.
  const float sine = std::sqrt(m.x * m.x + m.y * m.y);
  constexpr float kLeast = 1e-6F;
  return std::max(2 * kPi * kPi * place.x * sine, kLeast) * std::max(4 * Dot(seen.wo, m), kLeast);
}

float MeasuredTable::PlaneAt(std::size_t direction, std::size_t plane, Vec2 warped) const {
  const std::size_t wavelengths = wavelength_nm_.size();
  return plane < wavelengths ? values_.At(direction * wavelengths + plane, warped)
                             : colors_.At(direction * 3 + plane - wavelengths, warped);
}

Rgb MeasuredTable::ValueAt(const Seen& seen, Vec2 warped, Vec2 place, const Planes& planes) const {
  const float factor = is_over_facets_ ? seen.facets_over * facets_.At(0, place) : 1.0F;
  std::array<float, 3> values{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto plane = static_cast<std::size_t>(planes[i]);
    const float within = planes[i] - static_cast<float>(plane);
    for (std::size_t k = 0; k < seen.mixture.grid.size(); ++k) {
      if (!(seen.mixture.share[k] > 0)) continue;
      float value = PlaneAt(seen.mixture.grid[k], plane, warped);
      if (within > 0) value += within * (PlaneAt(seen.mixture.grid[k], plane + 1, warped) - value);
      values[i] += seen.mixture.share[k] * value;
    }
    values[i] *= factor;
  }
  return {values[0], values[1], values[2]};
}

Rgb MeasuredTable::Scattered(Vec3 wo, Vec3 wi, const Planes& planes) const {
  const Seen seen = SeenFrom(wo);
  const Vec3 m = Normalize(seen.wo + Vec3{seen.flip_x * wi.x, seen.flip_y * wi.y, wi.z});
  const Vec2 place = PlaceOf(seen, m);
  return ValueAt(seen, visible_.Find(seen.mixture, place).at, place, planes);
}

float MeasuredTable::Pdf(Vec3 wo, Vec3 wi) const {
  const Seen seen = SeenFrom(wo);
  const Vec3 m = Normalize(seen.wo + Vec3{seen.flip_x * wi.x, seen.flip_y * wi.y, wi.z});
  const Vec2 place = PlaceOf(seen, m);
  const BilinearDensities::Place warped = visible_.Find(seen.mixture, place);
  return warped.density * luminance_.Density(seen.mixture, warped.at) / Jacobian(seen, m, place);
}

MeasuredTable::Drawn MeasuredTable::Sample(Vec3 wo, float u1, float u2) const {
  const Seen seen = SeenFrom(wo);
  const BilinearDensities::Place warped = luminance_.Sample(seen.mixture, {u1, u2});
  const BilinearDensities::Place facet = visible_.Sample(seen.mixture, warped.at);
  const float theta = ThetaOfSquare(facet.at.x);
  const float phi = (2 * facet.at.y - 1) * kPi + (is_anisotropic() ? 0.0F : seen.phi);
  const float sine = std::sin(theta);
  const Vec3 m = {std::cos(phi) * sine, std::sin(phi) * sine, std::cos(theta)};
  const Vec3 wi = m * (2 * Dot(seen.wo, m)) - seen.wo;
  if (!(Dot(seen.wo, m) > 0)) return {};
  const float pdf = warped.density * facet.density / Jacobian(seen, m, facet.at);
  // Values over less than that may leave single precision.
  constexpr float kLeastPdf = 1e-12F;
  if (!(pdf >= kLeastPdf)) return {};
  return {{seen.flip_x * wi.x, seen.flip_y * wi.y, wi.z}, pdf};
}

Rgb MeasuredTable::Albedo(const Planes& planes) const {
  const auto at = [&](float position) {
    const auto plane = static_cast<std::size_t>(position);
    const float within = position - static_cast<float>(plane);
    return within > 0 ? (1 - within) * albedo_[plane] + within * albedo_[plane + 1]
                      : albedo_[plane];
  };
  return {at(planes[0]), at(planes[1]), at(planes[2])};
}

void MeasuredTable::MeasureFromAbove() {
  // Directions drawn at the middles of the cells of the square.
  constexpr int kCells = 24;
  const Vec3 above = {0, 0, 1};
  const Seen seen = SeenFrom(above);
  const std::size_t planes = wavelength_nm_.size() + 3;
  std::vector<double> sums(planes);
  struct Found {
    float theta, light;
  };
  std::vector<Found> found;
  double all = 0;
  for (int i = 0; i < kCells * kCells; ++i) {
    const int row = i / kCells;
    const Drawn drawn = Sample(above, (static_cast<float>(i - row * kCells) + 0.5F) / kCells,
                               (static_cast<float>(row) + 0.5F) / kCells);
    if (!(drawn.wi.z > 0) || !(drawn.pdf > 0)) continue;
    const Vec3 m = Normalize(above + drawn.wi);
    const Vec2 place = PlaceOf(seen, m);
    const Vec2 warped = visible_.Find(seen.mixture, place).at;
    for (std::size_t plane = 0; plane < planes; plane += 3) {
      const auto of = [&](std::size_t k) {
        return static_cast<float>(std::min(plane + k, planes - 1));
      };
      const Rgb value = ValueAt(seen, warped, place, {of(0), of(1), of(2)}) / drawn.pdf;
      const std::array<float, 3> values = {value.r, value.g, value.b};
      for (std::size_t k = 0; k < 3 && plane + k < planes; ++k)
        sums[plane + k] += static_cast<double>(values[k]);
    }
    const float light = Luminance(ValueAt(seen, warped, place, WorkingSpace())) / drawn.pdf;
    found.push_back({ThetaOf(m), light});
    all += static_cast<double>(light);
  }
  albedo_.clear();
  for (const double sum : sums)
    albedo_.push_back(static_cast<float>(sum / (kCells * kCells)));
  // Facets of GGX of width a send the share t² / (a² + t²) of light from above to half vectors
  // whose angle has at most the tangent t.
  std::ranges::sort(found, {}, &Found::theta);
  double narrow = 0;
  float theta = kPi / 2;
  for (const Found& f : found) {
    narrow += static_cast<double>(f.light);
    if (narrow >= 0.25 * all && narrow > 0) {
      theta = f.theta;
      break;
    }
  }
  constexpr float kWidest = 10;
  lobe_width_ = std::min(std::numbers::sqrt3_v<float> * std::tan(std::min(theta, 1.5F)), kWidest);
}

std::size_t MeasuredTable::bytes() const {
  return sizeof(*this) + facets_.bytes() + projected_.bytes() + visible_.bytes() +
         luminance_.bytes() + values_.bytes() + colors_.bytes() +
         (phi_rad_.size() + theta_rad_.size() + wavelength_nm_.size() + albedo_.size()) *
             sizeof(float);
}

}  // namespace lucerna
