#include "render/formats/measured_file.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "render/base/text.h"
#include "render/formats/diagnostic.h"

namespace lucerna {
namespace {

static_assert(std::endian::native == std::endian::little);

// More than any material has: sizes multiply without overflow.
constexpr std::uint64_t kMostKnots = std::uint64_t{1} << 20;
constexpr std::size_t kMostFields = 1000;
constexpr std::size_t kMostRank = 5;

Status Bad(std::string_view what) {
  return absl::InvalidArgumentError(Concat("bad measured BSDF: ", what));
}

enum class Numbers : std::uint8_t { kBytes = 1, kFloats = 10 };

struct Field {
  Numbers type = Numbers::kFloats;
  std::vector<std::uint64_t> sizes;
  std::string_view bytes;
};
using Fields = std::map<std::string, Field, std::less<>>;

// Takes numbers from the front of bytes.
class Front {
 public:
  explicit Front(std::string_view bytes) : left_(bytes) {}

  template <typename Number>
  [[nodiscard]] bool Take(Number& number) {
    if (left_.size() < sizeof(number)) return false;
    std::memcpy(&number, left_.data(), sizeof(number));
    left_.remove_prefix(sizeof(number));
    return true;
  }
  [[nodiscard]] bool Take(std::size_t count, std::string_view& bytes) {
    if (left_.size() < count) return false;
    bytes = left_.substr(0, count);
    left_.remove_prefix(count);
    return true;
  }

 private:
  std::string_view left_;
};

StatusOr<Fields> FieldsOf(std::string_view bytes) {
  constexpr std::string_view kMagic("tensor_file\0", 12);
  const auto cut_off = [] { return Bad("the file is cut off"); };
  Front front(bytes);
  std::string_view magic;
  if (!front.Take(kMagic.size(), magic) || magic != kMagic)
    return Bad("the file does not begin with \"tensor_file\"");
  std::uint8_t major = 0;
  std::uint8_t minor = 0;
  std::uint32_t count = 0;
  if (!front.Take(major) || !front.Take(minor) || !front.Take(count)) return cut_off();
  if (major != 1) return Bad(Concat("its version is ", int{major}, ", not 1"));
  if (count > kMostFields) return Bad(Concat("it has ", count, " arrays"));
  Fields fields;
  for (std::uint32_t i = 0; i < count; ++i) {
    std::uint16_t length = 0;
    std::string_view name;
    std::uint16_t rank = 0;
    std::uint8_t type = 0;
    std::uint64_t offset = 0;
    if (!front.Take(length) || !front.Take(length, name) || !front.Take(rank) ||
        !front.Take(type) || !front.Take(offset)) {
      return cut_off();
    }
    if (rank > kMostRank) return Bad(Concat("an array has ", rank, " dimensions"));
    Field field;
    std::uint64_t numbers = 1;
    for (int d = 0; d < rank; ++d) {
      std::uint64_t size = 0;
      if (!front.Take(size)) return cut_off();
      if (size > kMostKnots || (size > 0 && numbers > bytes.size() / size))
        return Bad("an array is larger than the file");
      numbers *= size;
      field.sizes.push_back(size);
    }
    // Arrays of other numbers are of no use here.
    if (type != static_cast<std::uint8_t>(Numbers::kBytes) &&
        type != static_cast<std::uint8_t>(Numbers::kFloats)) {
      continue;
    }
    field.type = static_cast<Numbers>(type);
    const std::uint64_t size =
        numbers * (field.type == Numbers::kFloats ? sizeof(float) : sizeof(std::uint8_t));
    if (offset > bytes.size() || size > bytes.size() - offset) return cut_off();
    field.bytes = bytes.substr(offset, size);
    fields.emplace(std::string(name), std::move(field));
  }
  return fields;
}

StatusOr<const Field*> Find(const Fields& fields, std::string_view name, std::size_t rank) {
  const auto found = fields.find(name);
  if (found == fields.end() || found->second.type != Numbers::kFloats) {
    if (name == "spectra" && fields.contains("rgb"))
      return Bad("it holds colours and no spectra; take the file whose name ends in _spec.bsdf");
    return Bad(Concat("the array ", Quoted(name), " is missing, or of other numbers than floats"));
  }
  if (found->second.sizes.size() != rank)
    return Bad(Concat("the array ", Quoted(name), " must have ", rank, " dimensions"));
  return &found->second;
}

std::vector<float> NumbersOf(const Field& field) {
  std::vector<float> numbers(field.bytes.size() / sizeof(float));
  // To no place, not even nothing may be copied.
  if (!numbers.empty()) std::memcpy(numbers.data(), field.bytes.data(), field.bytes.size());
  return numbers;
}

// Increasing numbers in [low, high].
StatusOr<std::vector<float>> KnotsOf(const Fields& fields, std::string_view name, double low,
                                     double high) {
  LUCERNA_ASSIGN_OR_RETURN(const Field* field, Find(fields, name, 1));
  std::vector<float> knots = NumbersOf(*field);
  const auto is_inside = [&](float value) {
    return static_cast<double>(value) >= low && static_cast<double>(value) <= high;
  };
  if (knots.empty() || !std::ranges::all_of(knots, is_inside) ||
      std::ranges::adjacent_find(knots, std::greater_equal<>()) != knots.end()) {
    return Bad(Concat("the array ", Quoted(name), " must have increasing numbers from ", low,
                      " to ", high));
  }
  return knots;
}

// A grid for each of `leading`. What is measured near zero may be below it by its noise.
StatusOr<std::vector<float>> GridsOf(const Fields& fields, std::string_view name,
                                     const std::vector<std::size_t>& leading, GridSize& size) {
  LUCERNA_ASSIGN_OR_RETURN(const Field* field, Find(fields, name, leading.size() + 2));
  for (std::size_t i = 0; i < leading.size(); ++i) {
    if (field->sizes[i] != leading[i]) {
      return Bad(Concat("the array ", Quoted(name), " has ", field->sizes[i], " in dimension ", i,
                        ", where other arrays have ", leading[i]));
    }
  }
  const GridSize found = {field->sizes[leading.size() + 1], field->sizes[leading.size()]};
  if (found.width < 2 || found.height < 2)
    return Bad(Concat("the array ", Quoted(name), " has fewer than 2 knots in a dimension"));
  if (size.width != 0 && (size.width != found.width || size.height != found.height))
    return Bad(Concat("the array ", Quoted(name), " has other knots than \"luminance\""));
  size = found;
  std::vector<float> values = NumbersOf(*field);
  // Beyond it, products leave single precision; real surfaces are far below.
  constexpr float kMost = 1e9F;
  for (float& value : values) {
    if (!(std::abs(value) <= kMost))
      return Bad(Concat("the array ", Quoted(name), " has a number that is none, or above 1e9"));
    value = std::max(value, 0.0F);
  }
  return values;
}

}  // namespace

StatusOr<MeasuredTable> ParseMeasured(std::string_view bytes) {
  LUCERNA_ASSIGN_OR_RETURN(const Fields fields, FieldsOf(bytes));
  MeasuredData data;
  constexpr double kTurn = 2 * std::numbers::pi;
  // What single precision makes of a right angle.
  constexpr double kRightAngle = std::numbers::pi / 2 + 1e-4;
  LUCERNA_ASSIGN_OR_RETURN(data.phi_rad, KnotsOf(fields, "phi_i", -1.01 * kTurn, 1.01 * kTurn));
  LUCERNA_ASSIGN_OR_RETURN(data.theta_rad, KnotsOf(fields, "theta_i", 0, kRightAngle));
  LUCERNA_ASSIGN_OR_RETURN(data.wavelength_nm, KnotsOf(fields, "wavelengths", 1, 1e5));
  // What follows from a table is computed for each of them.
  constexpr std::size_t kMostWavelengths = 4096;
  if (data.wavelength_nm.size() > kMostWavelengths)
    return Bad(Concat("it has more than ", kMostWavelengths, " wavelengths"));
  const std::vector<std::size_t> directions = {data.phi_rad.size(), data.theta_rad.size()};
  LUCERNA_ASSIGN_OR_RETURN(data.facets, GridsOf(fields, "ndf", {}, data.facets_size));
  LUCERNA_ASSIGN_OR_RETURN(data.projected, GridsOf(fields, "sigma", {}, data.projected_size));
  LUCERNA_ASSIGN_OR_RETURN(data.visible, GridsOf(fields, "vndf", directions, data.visible_size));
  LUCERNA_ASSIGN_OR_RETURN(data.luminance,
                           GridsOf(fields, "luminance", directions, data.values_size));
  std::vector<std::size_t> at_wavelengths = directions;
  at_wavelengths.push_back(data.wavelength_nm.size());
  LUCERNA_ASSIGN_OR_RETURN(data.values,
                           GridsOf(fields, "spectra", at_wavelengths, data.values_size));
  const auto jacobian = fields.find("jacobian");
  if (jacobian == fields.end() || jacobian->second.type != Numbers::kBytes ||
      jacobian->second.bytes.size() != 1) {
    return Bad("the array \"jacobian\" is missing, or not one byte");
  }
  data.is_over_facets = jacobian->second.bytes[0] != 0;
  return MeasuredTable(std::move(data));
}

}  // namespace lucerna
