#include "render/formats/pbrt/media.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/text.h"
#include "render/formats/cloud_density.h"
#include "render/formats/pbrt/measured_media.h"
#include "render/scene/density_grid.h"

namespace lucerna {
namespace {

// Nearer to 1, single photons straight ahead would weigh more than the sums of a pass have room for
// (FluxScale::HasRoomFor), and the image would be too dark.
constexpr Range kMeanCosine = {-0.99, 0.99};

// Emission of a medium, which may only be none: by a colour, and in grids by temperatures.
void RefuseEmission(ParameterList& parameters, bool is_grid) {
  constexpr std::array<std::string_view, 1> kFloats = {"float"};
  const auto is_any = [&](std::string_view name) {
    return std::ranges::any_of(parameters.Numbers(name, kFloats, 1),
                               [](double number) { return number > 0; });
  };
  const std::optional<Rgb> emitted = parameters.FindEmission("Le");
  const bool has_scale = parameters.Has("Lescale");
  const bool is_scaled = is_any("Lescale");
  if (emitted.has_value() && !IsBlack(*emitted) && (is_scaled || !has_scale))
    parameters.Error("Le", "is not supported: media do not emit light here");
  if (!is_grid) return;
  if (is_any("temperature") && (is_scaled || !has_scale))
    parameters.Error("temperature", "is not supported: media do not emit light here");
  for (const char* const name : {"temperatureoffset", "temperaturescale", "temperaturecutoff"})
    parameters.Ignore(name);
}

// The box that a grid fills, and where it is.
struct GridBox {
  Vec3 low, high;
  Transform from_world;
};
std::optional<GridBox> ReadGridBox(ParameterList& parameters, const Transform& to_world) {
  const Vec3 p0 = parameters.Point("p0", {0, 0, 0});
  const Vec3 p1 = parameters.Point("p1", {1, 1, 1});
  GridBox box;
  box.low = {std::min(p0.x, p1.x), std::min(p0.y, p1.y), std::min(p0.z, p1.z)};
  box.high = {std::max(p0.x, p1.x), std::max(p0.y, p1.y), std::max(p0.z, p1.z)};
  if (!(box.high.x > box.low.x && box.high.y > box.low.y && box.high.z > box.low.z)) {
    parameters.Error("p1", "makes the box from p0 flat");
    return std::nullopt;
  }
  const StatusOr<Transform> from_world = to_world.Inverse();
  if (!from_world.ok()) {
    parameters.Error(Concat("has no place: ", from_world.status().message()));
    return std::nullopt;
  }
  box.from_world = *from_world;
  return box;
}

// nullptr after an error.
std::shared_ptr<const DensityGrid> ReadCloud(ParameterList& parameters, const Transform& to_world,
                                             std::uint64_t& points_left) {
  CloudShape shape;
  shape.density = static_cast<float>(parameters.Float("density", 1, {0, 1e6}));
  shape.wispiness = static_cast<float>(parameters.Float("wispiness", 1, {0, 1e3}));
  shape.frequency = static_cast<float>(parameters.Float("frequency", 5, {0, 1e4}));
  const std::optional<GridBox> box = ReadGridBox(parameters, to_world);
  // What follows takes seconds.
  if (!box.has_value() || parameters.diagnostics().has_error()) return nullptr;
  // Places are whole features and a rest, in single precision.
  constexpr float kFarthest = 1e6F;
  const float farthest = std::max(MaxAbs(box->low), MaxAbs(box->high));
  if (!(farthest * std::max(1.0F, shape.frequency) <= kFarthest)) {
    parameters.Error("p1", Concat("and p0 must be within ", kFarthest,
                                  " of the origin, in features of the noise and in lengths"));
    return nullptr;
  }
  const std::array<int, 3> size = CloudGridSize(shape, box->low, box->high);
  const std::uint64_t points = static_cast<std::uint64_t>(size[0]) *
                               static_cast<std::uint64_t>(size[1]) *
                               static_cast<std::uint64_t>(size[2]);
  if (points > points_left) {
    parameters.Error("frequency", Concat("makes the clouds of the scene more than ",
                                         kMostCloudPoints, " points; give fewer of them"));
    return nullptr;
  }
  points_left -= points;
  return std::make_shared<const DensityGrid>(size, CloudDensities(shape, size, box->low, box->high),
                                             box->low, box->high, box->from_world);
}

// nullptr after an error.
std::shared_ptr<const DensityGrid> ReadDensity(ParameterList& parameters,
                                               const Transform& to_world) {
  constexpr std::array<std::string_view, 1> kFloats = {"float"};
  constexpr std::array<const char*, 3> kCounts = {"nx", "ny", "nz"};
  constexpr Range kCount = {1, 1'000'000};
  std::array<int, 3> size = {1, 1, 1};
  std::uint64_t points = 1;
  for (std::size_t axis = 0; axis < size.size(); ++axis) {
    const std::int64_t count = parameters.FindInteger(kCounts[axis], kCount).value_or(1);
    size[axis] = static_cast<int>(count);
    points *= static_cast<std::uint64_t>(count);
  }
  const std::optional<GridBox> box = ReadGridBox(parameters, to_world);
  const std::span<const double> numbers = parameters.Numbers("density", kFloats, 1);
  if (numbers.empty()) {
    if (!parameters.Has("density")) parameters.Error("needs \"float density\"");
    return nullptr;
  }
  if (numbers.size() != points) {
    parameters.Error("density",
                     Concat("has ", numbers.size(), " values; nx * ny * nz is ", points));
    return nullptr;
  }
  std::vector<float> values;
  values.reserve(numbers.size());
  for (const double number : numbers) {
    if (number < 0) {
      parameters.Error("density", Concat("has the negative value ", number));
      return nullptr;
    }
    values.push_back(static_cast<float>(number));
  }
  if (!box.has_value()) return nullptr;
  return std::make_shared<const DensityGrid>(size, values, box->low, box->high, box->from_world);
}

}  // namespace

Medium ReadMedium(ParameterList& parameters, const Transform& to_world,
                  std::uint64_t& cloud_points_left) {
  Medium medium;
  const std::optional<std::string> type = parameters.FindString("type");
  if (!type.has_value()) {
    if (!parameters.Has("type")) parameters.Error("needs \"string type\"");
    return medium;
  }
  if (*type == "rgbgrid" || *type == "nanovdb") {
    parameters.Error("type", Concat("is ", Quoted(*type),
                                    ", which is not supported; media of uneven density are "
                                    "uniformgrid here, with one density at each point, or "
                                    "cloud"));
    return medium;
  }
  if (*type != "homogeneous" && *type != "uniformgrid" && *type != "cloud") {
    parameters.Error("type", Concat("is ", Quoted(*type),
                                    ", which is not supported; there are homogeneous, "
                                    "uniformgrid and cloud"));
    return medium;
  }
  const bool is_grid = *type == "uniformgrid";
  if (is_grid) {
    medium.density = ReadDensity(parameters, to_world);
    if (medium.density != nullptr && !(medium.density->largest() > 0))
      parameters.Warning("density", "is 0 everywhere: the medium does nothing");
  } else if (*type == "cloud") {
    medium.density = ReadCloud(parameters, to_world, cloud_points_left);
  }
  // As pbrt-v4: each 1 where it is not given.
  medium.absorption =
      parameters.FindOpticalConstant("sigma_a", kZeroOrMore, &medium.absorption_spectrum)
          .value_or(Gray(1));
  medium.scattering =
      parameters.FindOpticalConstant("sigma_s", kZeroOrMore, &medium.scattering_spectrum)
          .value_or(Gray(1));
  if (const std::string preset = parameters.String("preset", ""); !preset.empty()) {
    const MeasuredMedium* measured = FindMeasuredMedium(preset);
    if (measured == nullptr) {
      parameters.Error("preset", Concat("is ", Quoted(preset), ", which is not known; ",
                                        MeasuredMediaThereAre()));
      return medium;
    }
    for (const std::string_view other : {"sigma_a", "sigma_s"}) {
      if (parameters.Has(other)) parameters.Warning(other, "is ignored because preset is given");
    }
    medium.absorption = measured->absorption;
    medium.scattering = measured->scattering;
    medium.absorption_spectrum = {};
    medium.scattering_spectrum = {};
  }
  const auto scale = static_cast<float>(parameters.Float("scale", 1, kZeroOrMore));
  medium.absorption *= scale;
  medium.scattering *= scale;
  medium.absorption_spectrum.factor = scale;
  medium.scattering_spectrum.factor = scale;
  if (!IsFinite(medium.Extinction() * medium.GreatestDensity()))
    parameters.Error("scale", "makes a coefficient too large");
  medium.g = static_cast<float>(parameters.Float("g", 0, kMeanCosine));
  RefuseEmission(parameters, is_grid);
  parameters.WarnOfUnread();
  return medium;
}

}  // namespace lucerna
