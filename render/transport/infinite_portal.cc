// Light of a sky, constant or a map, that comes through a rectangle.
//
// Seen from a point, the rectangle is one in the angles (α, β) in which a direction leans along its
// two sides, so that the part of the sky behind it can be drawn in proportion to its light: from
// sums over a grid in these angles (math/windowed_constant.h). Photons are drawn by the light that
// passes through the rectangle, and evenly over it.
//
// Source: Bitterli, Novák & Jarosz 2015, "Portal-Masked Environment Map Sampling".
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "render/math/equal_area_square.h"
#include "render/math/warp.h"
#include "render/math/windowed_constant.h"
#include "render/transport/environment_map.h"
#include "render/transport/infinite_emission.h"

namespace lucerna {
namespace {

// Cells of the map's square for photons along a side, at least: within one, cosines hardly change.
constexpr int kFewestCells = 256;
// Cells of the angles along a side, at least and at most, and how many cells of the square are
// added up for each, at least, along a side.
constexpr int kFewestAngles = 128;
constexpr int kMostAngles = 512;
constexpr int kCellsOfAngle = 4;
// Of the density of directions this share is even over the sphere: some cells of the angles may
// have got less than the sky has there.
constexpr double kEvenShare = 0.02;

// A sky without its portal.
InfiniteLight SkyOf(InfiniteLight light) {
  light.kind =
      light.map == nullptr ? InfiniteLight::Kind::kInfinite : InfiniteLight::Kind::kEnvironment;
  light.portal.reset();
  return light;
}

std::shared_ptr<InfiniteEmission> EmissionOf(const InfiniteLight& light) {
  const InfiniteEmissions emissions = light.map == nullptr
                                          ? MakeInfiniteEmissions({SkyOf(light)})
                                          : MakeEnvironmentEmissions({SkyOf(light)});
  return emissions.empty() ? nullptr : emissions.front();
}

class PortalEmission final : public InfiniteEmission {
 public:
  // Of that number among the scene's infinite lights.
  PortalEmission(const InfiniteLight& light, std::size_t number,
                 std::shared_ptr<InfiniteEmission> sky)
      : number_(number), sky_(std::move(sky)), axes_(light.axes), corner_(light.portal->corner) {
    const Portal& portal = *light.portal;
    width_ = Length(portal.along_x);
    height_ = Length(portal.along_y);
    x_ = portal.along_x / width_;
    y_ = portal.along_y / height_;
    z_ = Normalize(Cross(x_, y_));
    Measure(light.map == nullptr ? 1 : light.map->width);
  }

  [[nodiscard]] EmitterKind kind() const override { return EmitterKind::kPortal; }
  void TakeColors(const std::vector<InfiniteLight>& lights, const Uplift* uplift) override {
    sky_->TakeColors({SkyOf(lights[number_])}, uplift);
  }
  [[nodiscard]] Rgb Radiance(Vec3 from, Vec3 direction) const override {
    return Lights(from) && Passes(from, direction) ? sky_->Radiance(from, direction) : Rgb{};
  }
  [[nodiscard]] Rgb MeanRadiance() const override { return sky_->MeanRadiance(); }
  [[nodiscard]] Rgb Power(const BoundingSphere& /*scene*/) const override { return power_; }
  // As an area light: its light goes from the rectangle into the room.
  [[nodiscard]] TreeLight InTree(double power, const BoundingSphere& /*scene*/) const override {
    TreeLight in_tree;
    in_tree.intensity = power / std::numbers::pi;
    in_tree.center = corner_ + x_ * (width_ / 2) + y_ * (height_ / 2);
    in_tree.radius = std::hypot(width_, height_) / 2;
    in_tree.axis = -z_;
    in_tree.cos_facing = 1;
    return in_tree;
  }
  [[nodiscard]] float LargestRadiance() const override { return sky_->LargestRadiance(); }

  [[nodiscard]] bool Sample(Vec3 from, float u1, float u2, Vec3& direction) const override {
    GridWindow window;
    if (!WindowFrom(from, window) || !(angles_.SumIn(window) > 0)) return false;
    const Vec2 place = angles_.Sample(window, static_cast<double>(u1), static_cast<double>(u2));
    const double a = std::tan(AngleAt(place.x));
    const double b = std::tan(AngleAt(place.y));
    direction = Normalize(x_ * static_cast<float>(a) + y_ * static_cast<float>(b) + z_);
    return true;
  }
  [[nodiscard]] float Density(Vec3 from, Vec3 direction, float choice) const override {
    GridWindow window;
    Vec2 place;
    float solid_angle = 0;
    if (!WindowFrom(from, window) || !PlaceOf(direction, place, solid_angle) || !window.Has(place))
      return 0;
    const double all = angles_.SumIn(window);
    if (!(all > 0)) return 0;
    return choice * static_cast<float>(angles_.WeightAt(place) / all) / solid_angle;
  }

  [[nodiscard]] bool SampleEmission(const Emitter& emitter, const BoundingSphere& scene,
                                    const EmissionNumbers& u, Emission& emission) const override {
    const Vec2 place = cells_->Sample(u.direction1, u.direction2);
    const Vec3 towards = DirectionOf(place);
    const float cosine = Dot(towards, z_);
    const float density = cells_->Density(place);
    if (!(cosine > 0) || !(density > 0)) return false;
    const Vec3 at = corner_ + x_ * (u.place1 * width_) + y_ * (u.place2 * height_);
    // From outside of the scene: what is in the way of the light takes the photon.
    emission.ray.origin = at + towards * (Length(at - scene.center) + scene.radius);
    emission.ray.direction = -towards;
    // Of the cell's middle: rounding must not take a neighbour's light, which may be the sun's.
    const Vec3 middle = DirectionOf({std::floor(place.x) + 0.5F, std::floor(place.y) + 0.5F});
    // The density over the sphere is that over the square over 4π.
    emission.flux = sky_->Radiance(at, middle) *
                    (cosine * width_ * height_ * 4 * kPi / (density * emitter.choice));
    return true;
  }
  [[nodiscard]] float PhotonDensity(Vec3 from, Vec3 direction, float choice,
                                    const BoundingSphere& scene) const override {
    const float cosine = Dot(direction, z_);
    if (!(cosine > 0) || !Passes(from, direction)) return 0;
    return choice * cells_->Density(CellOf(direction)) / (4 * kPi) *
           (kPi * scene.radius * scene.radius / (width_ * height_ * cosine));
  }
  [[nodiscard]] float LargestShare() const override { return largest_share_; }
  [[nodiscard]] bool Lights(Vec3 landing) const override { return Dot(corner_ - landing, z_) > 0; }
  [[nodiscard]] EmissionNumbers FindNumbers(const BoundingSphere& /*scene*/, Vec3 point,
                                            Vec3 direction) const override {
    const Vec2 numbers = cells_->NumbersAt(CellOf(direction));
    const Vec2 place = Crossing(point, direction);
    const auto held = [](float share) { return std::clamp(share, 0.0F, 0x1.fffffep-1F); };
    return {held(place.x), held(place.y), numbers.x, numbers.y};
  }

  // The rectangle's own edges are not looked at: it stands in a wall, which has them too.
  [[nodiscard]] std::unique_ptr<const InfiniteSpectrum> MeasureSpectrum() const override {
    return sky_->MeasureSpectrum();
  }

 private:
  void Measure(int pixels) {
    const int parts = std::max(1, (kFewestCells + pixels - 1) / pixels);
    side_ = pixels * parts;
    const int grid = std::clamp(pixels, kFewestAngles, kMostAngles);
    angles_side_ = grid;
    // Fine enough for both.
    const int finer = std::max(1, (kCellsOfAngle * grid + side_ - 1) / side_);
    std::vector<double> angles(static_cast<std::size_t>(grid) * static_cast<std::size_t>(grid));
    const auto angle_cell = [&](float place) {
      return static_cast<std::size_t>(std::clamp(static_cast<int>(place), 0, grid - 1));
    };
    const double solid_angle = 4 * kPi64 / (static_cast<double>(side_) * side_);
    std::array<double, 3> passing{};
    double all = 0;
    double covered = 0;
    // The light of a cell is that of its pixel, and no cosine in it is larger than the one that is
    // used for all of it. Asked once for each cell.
    cells_.emplace(side_, side_, [&](int column, int row) {
      const auto towards = [&](double x, double y) {
        return DirectionOf({static_cast<float>(column + x), static_cast<float>(row + y)});
      };
      const Vec3 middle = towards(0.5, 0.5);
      const Rgb radiance = sky_->Radiance({}, middle);
      const auto luminance = static_cast<double>(Luminance(radiance));
      float reach = 0;
      for (const auto& [x, y] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}, {1.0, 1.0}})
        reach = std::max(reach, Length(towards(x, y) - middle));
      // Half as much again, as a cell's sides are bent.
      const float most = std::min(1.0F, Dot(middle, z_) + 1.5F * reach);
      if (!(most > 0)) return 0.0;
      for (int v = 0; v < finer; ++v) {
        for (int u = 0; u < finer; ++u) {
          const Vec3 direction = towards((u + 0.5) / finer, (v + 0.5) / finer);
          Vec2 place;
          float of_place = 0;
          if (!PlaceOf(direction, place, of_place)) continue;
          const double part = solid_angle / (static_cast<double>(finer) * finer);
          const auto cosine = static_cast<double>(Dot(direction, z_));
          for (int c = 0; c < 3; ++c) {
            passing[static_cast<std::size_t>(c)] +=
                static_cast<double>(radiance[c]) * cosine * part;
          }
          angles[angle_cell(place.y) * static_cast<std::size_t>(grid) + angle_cell(place.x)] +=
              luminance * part;
          all += luminance * part;
        }
      }
      const double weight = luminance * static_cast<double>(most) * solid_angle;
      covered += weight;
      return weight;
    });
    const double area = static_cast<double>(width_) * static_cast<double>(height_);
    power_ = {static_cast<float>(passing[0] * area), static_cast<float>(passing[1] * area),
              static_cast<float>(passing[2] * area)};
    // Of directions whose cell reaches beyond the plane nothing comes.
    const auto passing_luminance = static_cast<double>(Luminance(power_)) / area;
    if (passing_luminance > 0)
      largest_share_ = static_cast<float>(covered / passing_luminance) * 1.001F;
    for (int row = 0; row < grid; ++row) {
      for (int column = 0; column < grid; ++column) {
        const Vec2 place = {static_cast<float>(column) + 0.5F, static_cast<float>(row) + 0.5F};
        const double a = std::tan(AngleAt(place.x));
        const double b = std::tan(AngleAt(place.y));
        angles[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid) +
               static_cast<std::size_t>(column)] +=
            kEvenShare * all / (2 * kPi64) *
            SolidAngleOf(Normalize(Vec3{static_cast<float>(a), static_cast<float>(b), 1}));
      }
    }
    angles_ = WindowedConstant2D(grid, grid, angles);
  }

  [[nodiscard]] double AngleAt(float place) const {
    return (static_cast<double>(place) / angles_side_ - 0.5) * kPi64;
  }
  [[nodiscard]] double AnglePlace(double across, double ahead) const {
    return (std::atan2(across, ahead) / kPi64 + 0.5) * angles_side_;
  }
  // [sr] of a cell of the angles at a direction in the portal's axes.
  [[nodiscard]] double SolidAngleOf(Vec3 local) const {
    const auto x = static_cast<double>(local.x);
    const auto y = static_cast<double>(local.y);
    const double cell = kPi64 / angles_side_;
    return cell * cell * (1 - x * x) * (1 - y * y) / static_cast<double>(local.z);
  }
  // Where a direction lies among the angles, and the solid angle of a cell there; false for one
  // that leads away from the portal.
  [[nodiscard]] bool PlaceOf(Vec3 direction, Vec2& place, float& solid_angle) const {
    const Vec3 local = {Dot(direction, x_), Dot(direction, y_), Dot(direction, z_)};
    if (!(local.z > 0)) return false;
    const auto z = static_cast<double>(local.z);
    place = {static_cast<float>(AnglePlace(static_cast<double>(local.x), z)),
             static_cast<float>(AnglePlace(static_cast<double>(local.y), z))};
    solid_angle = static_cast<float>(SolidAngleOf(local));
    return solid_angle > 0;
  }
  // Under which angles the portal is seen; false from behind it.
  [[nodiscard]] bool WindowFrom(Vec3 from, GridWindow& window) const {
    if (!Lights(from)) return false;
    const Vec3 to = corner_ - from;
    const auto ahead = static_cast<double>(Dot(to, z_));
    const auto x = static_cast<double>(Dot(to, x_));
    const auto y = static_cast<double>(Dot(to, y_));
    window = {AnglePlace(x, ahead), AnglePlace(x + static_cast<double>(width_), ahead),
              AnglePlace(y, ahead), AnglePlace(y + static_cast<double>(height_), ahead)};
    return window.low_x < window.high_x && window.low_y < window.high_y;
  }
  // Where the line through `from` crosses the portal's plane, in its widths and heights.
  [[nodiscard]] Vec2 Crossing(Vec3 from, Vec3 direction) const {
    const Vec3 to = from - corner_;
    const Vec3 at = to - direction * (Dot(to, z_) / Dot(direction, z_));
    return {Dot(at, x_) / width_, Dot(at, y_) / height_};
  }
  [[nodiscard]] bool Passes(Vec3 from, Vec3 direction) const {
    if (!(Dot(direction, z_) > 0)) return false;
    const Vec2 at = Crossing(from, direction);
    return at.x >= 0 && at.x <= 1 && at.y >= 0 && at.y <= 1;
  }
  // Of a place on the square [cells].
  [[nodiscard]] Vec3 DirectionOf(Vec2 place) const {
    const auto side = static_cast<float>(side_);
    const Vec3 local = EqualAreaDirection({place.x / side, place.y / side});
    return Normalize(axes_.x * local.x + axes_.y * local.y + axes_.z * local.z);
  }
  [[nodiscard]] Vec2 CellOf(Vec3 direction) const {
    const Vec2 place =
        EqualAreaPlace({Dot(direction, axes_.x), Dot(direction, axes_.y), Dot(direction, axes_.z)});
    const auto side = static_cast<float>(side_);
    return {place.x * side, place.y * side};
  }

  std::size_t number_;
  std::shared_ptr<InfiniteEmission> sky_;
  ShapeAxes axes_;  // of the sky
  Vec3 corner_;
  Vec3 x_, y_, z_;  // unit; z: towards the sky
  float width_ = 0, height_ = 0;
  Rgb power_;
  float largest_share_ = 1;
  int side_ = 1;
  std::optional<PiecewiseConstant2D> cells_;  // of the sky's square, by light through the portal
  int angles_side_ = 1;
  WindowedConstant2D angles_;  // by light
};

}  // namespace

InfiniteEmissions MakePortalEmissions(const std::vector<InfiniteLight>& lights) {
  InfiniteEmissions emissions;
  for (std::size_t number = 0; number < lights.size(); ++number) {
    if (lights[number].kind != InfiniteLight::Kind::kPortal) continue;
    std::shared_ptr<InfiniteEmission> sky = EmissionOf(lights[number]);
    if (sky != nullptr)
      emissions.push_back(std::make_shared<PortalEmission>(lights[number], number, std::move(sky)));
  }
  return emissions;
}

}  // namespace lucerna
