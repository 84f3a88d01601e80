#include "render/formats/pbrt/parameter_list.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "render/base/text.h"
#include "render/formats/pbrt/optical_constants.h"

namespace lucerna {
namespace {

// Of what Cauchy's equation makes of a curve of indices.
constexpr double kLargestIndexError = 2e-3;
constexpr std::array<std::string_view, 1> kFloat = {"float"};
constexpr std::array<std::string_view, 1> kInteger = {"integer"};
constexpr std::array<std::string_view, 1> kBool = {"bool"};
constexpr std::array<std::string_view, 1> kString = {"string"};
constexpr std::array<std::string_view, 1> kTexture = {"texture"};
constexpr std::array<std::string_view, 2> kPoint = {"point3", "point"};
constexpr std::array<std::string_view, 2> kVector = {"vector3", "vector"};
constexpr std::array<std::string_view, 2> kReflectanceTypes = {"rgb", "spectrum"};
constexpr std::array<std::string_view, 3> kEmissionTypes = {"rgb", "spectrum", "blackbody"};
constexpr std::array<std::string_view, 3> kOpticalTypes = {"spectrum", "rgb", "float"};
constexpr std::array<std::string_view, 3> kIndexTypes = {"float", "spectrum", "rgb"};

void Give(WavelengthCurve curve, GivenSpectrum* given) {
  if (given != nullptr) *given = {std::make_shared<const WavelengthCurve>(std::move(curve))};
}

Rgb ToRgb(const std::vector<double>& numbers) {
  return {static_cast<float>(numbers[0]), static_cast<float>(numbers[1]),
          static_cast<float>(numbers[2])};
}

}  // namespace

const std::vector<std::string_view>& KnownParameterTypes() {
  static const std::vector<std::string_view> types = {
      "bool",   "integer", "float",  "point2", "vector2",  "point3",    "point",  "vector3",
      "vector", "normal3", "normal", "rgb",    "spectrum", "blackbody", "string", "texture"};
  return types;
}

ParameterList::ParameterList(std::string subject, SourceLocation location,
                             std::vector<Parameter> given, const std::vector<Parameter>* defaults,
                             Diagnostics& diagnostics)
    : subject_(std::move(subject)),
      location_(location),
      defaults_(defaults),
      diagnostics_(diagnostics) {
  // Sorted, because a hostile text can bring very many.
  std::vector<std::size_t> order(given.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return given[a].name < given[b].name; });
  std::vector<bool> is_left_out(given.size());
  for (std::size_t i = 1; i < order.size(); ++i) {
    const Parameter& before = given[order[i - 1]];
    const Parameter& after = given[order[i]];
    if (before.name != after.name) continue;
    // pbrt takes the last one of a type, and refuses two types. Other formats take none.
    const std::string twice = Concat("parameter ", Called(after), " is given twice");
    if (before.type == after.type && after.called.empty()) {
      diagnostics_.Warning(after.location, Concat(twice, "; the last one counts"));
      is_left_out[order[i - 1]] = true;
    } else {
      diagnostics_.Error(after.location, twice);
      is_left_out[order[i]] = true;
    }
  }
  for (std::size_t i = 0; i < is_left_out.size(); ++i) {
    if (!is_left_out[i]) parameters_.push_back(std::move(given[i]));
  }
  was_read_.resize(parameters_.size());
}

const Parameter* ParameterList::Find(std::string_view name) const {
  for (const Parameter& parameter : parameters_) {
    if (parameter.name == name) return &parameter;
  }
  if (defaults_ == nullptr) return nullptr;
  for (const Parameter& parameter : *defaults_) {
    if (parameter.name == name) return &parameter;
  }
  return nullptr;
}

bool ParameterList::MarkRead(const Parameter& parameter) {
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    if (&parameters_[i] != &parameter) continue;
    const bool is_first_time = !was_read_[i];
    was_read_[i] = true;
    return is_first_time;
  }
  return true;
}

std::string ParameterList::Called(const Parameter& parameter) const {
  const std::string& called = parameter.called.empty() ? parameter.name : parameter.called;
  return Concat(Quoted(called), " of ", subject_);
}

const Parameter* ParameterList::Take(std::string_view name, std::span<const std::string_view> types,
                                     std::size_t count) {
  known_names_.emplace_back(name);
  const Parameter* parameter = Find(name);
  if (parameter == nullptr) return nullptr;
  const bool is_first_time = MarkRead(*parameter);
  if (parameter->is_unreadable) return nullptr;
  // Other formats than pbrt's take whole numbers for numbers.
  const bool is_whole_float = !parameter->called.empty() && parameter->type == "integer" &&
                              types.size() == 1 && types[0] == kFloat[0];
  if (!is_whole_float && std::find(types.begin(), types.end(), parameter->type) == types.end()) {
    if (!is_first_time) return nullptr;
    const std::string wanted = Listed(types, " or ");
    if (parameter->type == "texture") {
      diagnostics_.Error(parameter->location,
                         Concat(Called(*parameter), " is a texture, which is not supported here; ",
                                "give a ", wanted, " instead"));
    } else {
      diagnostics_.Error(parameter->location, Concat(Called(*parameter), " must be of type ",
                                                     wanted, ", not ", parameter->type));
    }
    return nullptr;
  }
  if (count != 0 && !CheckCount(*parameter, count)) return nullptr;
  return parameter;
}

bool ParameterList::HasText(std::string_view name) {
  const Parameter* parameter = Find(name);
  if (parameter == nullptr) return false;
  if (parameter->type != "string" || parameter->count() != 1 || !parameter->strings[0].empty())
    return true;
  MarkRead(*parameter);
  return false;
}

const Parameter* ParameterList::FindWhole(std::string_view name) {
  known_names_.emplace_back(name);
  const Parameter* parameter = Find(name);
  if (parameter != nullptr) MarkRead(*parameter);
  return parameter;
}

bool ParameterList::CheckCount(const Parameter& parameter, std::size_t count) {
  if (parameter.count() == count) return true;
  diagnostics_.Error(parameter.location,
                     Concat(Called(parameter), " must have ", count,
                            count == 1 ? " value, not " : " values, not ", parameter.count()));
  return false;
}

bool ParameterList::CheckRange(const Parameter& parameter, double value, Range range) {
  if (value <= range.high && (range.low_is_allowed ? value >= range.low : value > range.low)) {
    return true;
  }
  const std::string low = Concat(range.low_is_allowed ? "at least " : "above ", range.low);
  const std::string high = range.high < 3e38 ? Concat(" and at most ", range.high) : "";
  diagnostics_.Error(parameter.location,
                     Concat(Called(parameter), " must be ", low, high, ", not ", value));
  return false;
}

std::optional<double> ParameterList::FindFloat(std::string_view name, Range range) {
  const Parameter* parameter = Take(name, kFloat, 1);
  if (parameter == nullptr || !CheckRange(*parameter, parameter->numbers[0], range)) {
    return std::nullopt;
  }
  return parameter->numbers[0];
}

double ParameterList::Float(std::string_view name, double otherwise, Range range) {
  return FindFloat(name, range).value_or(otherwise);
}

std::optional<std::int64_t> ParameterList::FindInteger(std::string_view name, Range range) {
  const Parameter* parameter = Take(name, kInteger, 1);
  if (parameter == nullptr || !CheckRange(*parameter, parameter->numbers[0], range)) {
    return std::nullopt;
  }
  return static_cast<std::int64_t>(parameter->numbers[0]);
}

std::optional<bool> ParameterList::FindBool(std::string_view name) {
  const Parameter* parameter = Take(name, kBool, 1);
  if (parameter == nullptr) return std::nullopt;
  return parameter->bools[0];
}

bool ParameterList::Bool(std::string_view name, bool otherwise) {
  return FindBool(name).value_or(otherwise);
}

std::optional<std::string> ParameterList::FindString(std::string_view name) {
  const Parameter* parameter = Take(name, kString, 1);
  if (parameter == nullptr) return std::nullopt;
  return parameter->strings[0];
}

std::string ParameterList::String(std::string_view name, std::string otherwise) {
  return FindString(name).value_or(std::move(otherwise));
}

bool ParameterList::IsTexture(std::string_view name) const {
  const Parameter* parameter = Find(name);
  return parameter != nullptr && parameter->type == "texture";
}

std::optional<std::string> ParameterList::FindTexture(std::string_view name) {
  const Parameter* parameter = Take(name, kTexture, 1);
  if (parameter == nullptr) return std::nullopt;
  return parameter->strings[0];
}

Vec3 ParameterList::Point(std::string_view name, Vec3 otherwise) {
  const Parameter* parameter = Take(name, kPoint, 3);
  if (parameter == nullptr) return otherwise;
  const Rgb three = ToRgb(parameter->numbers);
  return {three.r, three.g, three.b};
}

Vec3 ParameterList::Vector(std::string_view name, Vec3 otherwise) {
  const Parameter* parameter = Take(name, kVector, 3);
  if (parameter == nullptr) return otherwise;
  const Rgb three = ToRgb(parameter->numbers);
  return {three.r, three.g, three.b};
}

std::span<const std::string> ParameterList::Strings(std::string_view name) {
  const Parameter* parameter = Take(name, kString, 0);
  if (parameter == nullptr) return {};
  return parameter->strings;
}

std::span<const double> ParameterList::Numbers(std::string_view name,
                                               std::span<const std::string_view> types,
                                               std::size_t group) {
  const Parameter* parameter = Take(name, types, 0);
  if (parameter == nullptr) return {};
  if (parameter->numbers.empty() || parameter->numbers.size() % group != 0) {
    diagnostics_.Error(parameter->location,
                       Concat(Called(*parameter), " must have a multiple of ", group,
                              " values, not ", parameter->numbers.size()));
    return {};
  }
  return parameter->numbers;
}

std::optional<WavelengthCurve> ParameterList::CurveOf(const Parameter& parameter) {
  WavelengthCurve curve;
  const std::vector<double>& numbers = parameter.numbers;
  if (numbers.size() < 2 || numbers.size() % 2 != 0) {
    diagnostics_.Error(parameter.location,
                       Concat(Called(parameter), " must be pairs of wavelength and value"));
    return std::nullopt;
  }
  for (std::size_t i = 0; i < numbers.size(); i += 2) {
    if (!(numbers[i] > 0) || (i > 0 && !(numbers[i] > numbers[i - 2]))) {
      diagnostics_.Error(parameter.location,
                         Concat(Called(parameter), ": wavelengths must be above 0 and rise"));
      return std::nullopt;
    }
    if (numbers[i + 1] < 0) {
      diagnostics_.Error(parameter.location,
                         Concat(Called(parameter), " must not have a negative value"));
      return std::nullopt;
    }
    curve.wavelength_nm.push_back(numbers[i]);
    curve.value.push_back(numbers[i + 1]);
  }
  return curve;
}

std::optional<Rgb> ParameterList::FindReflectance(std::string_view name, GivenSpectrum* given) {
  const Parameter* parameter = Take(name, kReflectanceTypes, 0);
  if (parameter == nullptr) return std::nullopt;
  if (parameter->type == "rgb") {
    if (!CheckCount(*parameter, 3)) return std::nullopt;
    if (parameter->is_converted) {
      const Rgb color = ToRgb(parameter->numbers);
      return Rgb{std::min(color.r, 1.0F), std::min(color.g, 1.0F), std::min(color.b, 1.0F)};
    }
    for (const double value : parameter->numbers) {
      if (!CheckRange(*parameter, value, {0, 1})) return std::nullopt;
    }
    return ToRgb(parameter->numbers);
  }
  if (!parameter->strings.empty()) {
    diagnostics_.Error(
        parameter->location,
        Concat(Called(*parameter), ": the named spectrum ", Quoted(parameter->strings[0]),
               " is not a reflectance that is supported; give an rgb"));
    return std::nullopt;
  }
  std::optional<WavelengthCurve> curve = CurveOf(*parameter);
  if (!curve.has_value()) return std::nullopt;
  for (const double value : curve->value) {
    if (!CheckRange(*parameter, value, {0, 1})) return std::nullopt;
  }
  const Rgb color = ReflectanceColor(*curve);
  Give(*std::move(curve), given);
  return color;
}

std::optional<Rgb> ParameterList::FindEmission(std::string_view name, GivenSpectrum* given) {
  const Parameter* parameter = Take(name, kEmissionTypes, 0);
  if (parameter == nullptr) return std::nullopt;
  if (parameter->type == "rgb") {
    if (!CheckCount(*parameter, 3)) return std::nullopt;
    for (const double value : parameter->numbers) {
      if (!CheckRange(*parameter, value, kZeroOrMore)) return std::nullopt;
    }
    return ToRgb(parameter->numbers);
  }
  if (parameter->type == "blackbody") {
    if (!CheckCount(*parameter, 1)) return std::nullopt;
    if (!CheckRange(*parameter, parameter->numbers[0], {kMinBlackbodyK, kMaxBlackbodyK})) {
      return std::nullopt;
    }
    if (given != nullptr) Give(BlackbodyCurve(parameter->numbers[0]), given);
    return BlackbodyColor(parameter->numbers[0]);
  }
  if (!parameter->strings.empty()) {
    if (parameter->strings.size() == 1) {
      // Of which the spectrum of grey is made.
      if (parameter->strings[0] == "stdillum-D65") return Gray(1);
      std::optional<WavelengthCurve> named = IlluminantNamed(parameter->strings[0]);
      if (named.has_value()) {
        const Rgb color = EmissionColor(*named);
        Give(*std::move(named), given);
        return color;
      }
    }
    diagnostics_.Error(
        parameter->location,
        Concat(
            Called(*parameter), ": the named spectrum ", Quoted(parameter->strings[0]),
            " is not supported for lights; there are stdillum-A, stdillum-D50, stdillum-D65 and ",
            "illum-acesD60, or give an rgb, a blackbody or pairs of wavelength and value"));
    return std::nullopt;
  }
  std::optional<WavelengthCurve> curve = CurveOf(*parameter);
  if (!curve.has_value()) return std::nullopt;
  const Rgb color = EmissionColor(*curve);
  Give(*std::move(curve), given);
  return color;
}

std::optional<Rgb> ParameterList::FindOpticalConstant(std::string_view name, Range range,
                                                      GivenSpectrum* given) {
  const Parameter* parameter = Take(name, kOpticalTypes, 0);
  if (parameter == nullptr) return std::nullopt;
  Rgb constant;
  GivenSpectrum found;
  if (!parameter->strings.empty()) {
    const std::optional<Rgb> metal = MetalCurveNamed(parameter->strings[0]);
    const std::optional<RefractiveIndex> glass = GlassNamed(parameter->strings[0]);
    if (parameter->strings.size() != 1 || !(metal.has_value() || glass.has_value())) {
      diagnostics_.Error(
          parameter->location,
          Concat(Called(*parameter), ": unknown named spectrum ", Quoted(parameter->strings[0]),
                 "; there are metal-Ag-eta, metal-Ag-k and so on for Ag, Al, Au, Cu, CuZn, ",
                 "MgO and TiO2"));
      return std::nullopt;
    }
    constant = metal.has_value() ? *metal : Gray(glass->at_d);
    if (metal.has_value()) found = MetalSpectrumNamed(parameter->strings[0]);
  } else if (parameter->type == "rgb") {
    if (!CheckCount(*parameter, 3)) return std::nullopt;
    constant = ToRgb(parameter->numbers);
  } else if (parameter->type == "float") {
    if (!CheckCount(*parameter, 1)) return std::nullopt;
    constant = Gray(static_cast<float>(parameter->numbers[0]));
  } else {
    std::optional<WavelengthCurve> curve = CurveOf(*parameter);
    if (!curve.has_value()) return std::nullopt;
    constant = {static_cast<float>(curve->AtClamped(kRedNm)),
                static_cast<float>(curve->AtClamped(kGreenNm)),
                static_cast<float>(curve->AtClamped(kBlueNm))};
    Give(*std::move(curve), &found);
  }
  for (int channel = 0; channel < 3; ++channel) {
    if (!CheckRange(*parameter, static_cast<double>(constant[channel]), range)) return std::nullopt;
  }
  if (given != nullptr) *given = std::move(found);
  return constant;
}

std::optional<RefractiveIndex> ParameterList::FindRefractiveIndex(std::string_view name,
                                                                  Range range) {
  const Parameter* parameter = Take(name, kIndexTypes, 0);
  if (parameter == nullptr) return std::nullopt;
  if (parameter->type == "float") {
    if (!CheckCount(*parameter, 1)) return std::nullopt;
    if (!CheckRange(*parameter, parameter->numbers[0], range)) return std::nullopt;
    return RefractiveIndex{static_cast<float>(parameter->numbers[0]), {}};
  }
  if (parameter->type == "rgb") {
    if (!CheckCount(*parameter, 3)) return std::nullopt;
    const std::vector<double>& rgb = parameter->numbers;
    const double mean = (rgb[0] + rgb[1] + rgb[2]) / 3;
    if (!CheckRange(*parameter, mean, range)) return std::nullopt;
    if (rgb[0] != rgb[1] || rgb[1] != rgb[2]) {
      diagnostics_.Warning(parameter->location, Concat(Called(*parameter), " is read as its mean, ",
                                                       mean, "; for dispersion give a spectrum"));
    }
    return RefractiveIndex{static_cast<float>(mean), {}};
  }
  if (!parameter->strings.empty()) {
    const std::optional<RefractiveIndex> glass = GlassNamed(parameter->strings[0]);
    if (parameter->strings.size() == 1 && glass.has_value()) return glass;
    diagnostics_.Error(
        parameter->location,
        Concat(Called(*parameter), ": unknown named spectrum ", Quoted(parameter->strings[0]),
               "; there are glass-BK7, glass-BAF10, glass-FK51A, glass-LASF9, glass-F5, ",
               "glass-F10, glass-F11 and diamond"));
    return std::nullopt;
  }
  const std::optional<WavelengthCurve> curve = CurveOf(*parameter);
  if (!curve.has_value()) return std::nullopt;
  for (const double value : curve->value) {
    if (!CheckRange(*parameter, value, range)) return std::nullopt;
  }
  const auto index_at = [&](double nm) { return curve->AtClamped(nm); };
  RefractiveIndex index = {static_cast<float>(index_at(kHeliumDNm)), FitDispersion(index_at)};
  for (double nm = kFirstVisibleNm; nm <= kLastVisibleNm; nm += 1) {
    const auto fitted =
        static_cast<double>(IndexAt(static_cast<float>(nm), index.at_d, index.dispersion));
    if (std::abs(fitted - index_at(nm)) > kLargestIndexError) {
      diagnostics_.Warning(
          parameter->location,
          Concat(Called(*parameter), ": Cauchy's equation with three terms does not come within ",
                 kLargestIndexError, " of this curve, so one index of refraction (at 587.6 nm) ",
                 "stands for all colours"));
      index.dispersion = {};
      break;
    }
  }
  return index;
}

float ParameterList::OneRefractiveIndex(std::string_view name, Range range) {
  const RefractiveIndex index = FindRefractiveIndex(name, range).value_or(RefractiveIndex{});
  if (!index.dispersion.is_none()) WarnOfOneIndex(name);
  return index.at_d;
}

void ParameterList::WarnOfOneIndex(std::string_view name) {
  Warning(name,
          "dispersion is rendered of smooth surfaces of material \"dielectric\" alone, here one "
          "index of refraction (at 587.6 nm) stands for all colours");
}

void ParameterList::Ignore(std::string_view name) {
  known_names_.emplace_back(name);
  if (const Parameter* parameter = Find(name)) MarkRead(*parameter);
}

void ParameterList::Error(std::string_view name, std::string_view message) {
  const Parameter* parameter = Find(name);
  if (parameter != nullptr) MarkRead(*parameter);
  diagnostics_.Error(parameter != nullptr ? parameter->location : location_,
                     Concat(parameter != nullptr ? Called(*parameter) : subject_, " ", message));
}

void ParameterList::Warning(std::string_view name, std::string_view message) {
  const Parameter* parameter = Find(name);
  diagnostics_.Warning(parameter != nullptr ? parameter->location : location_,
                       Concat(parameter != nullptr ? Called(*parameter) : subject_, " ", message));
}

void ParameterList::WarnOfUnread() {
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    if (was_read_[i]) continue;
    const Parameter& parameter = parameters_[i];
    // Looking for the nearest name is slow; it is left out once no more warnings are kept.
    const std::string_view closest =
        diagnostics_.IsFull(Diagnostic::Severity::kWarning)
            ? std::string_view()
            : ClosestOf(parameter.name, {known_names_.begin(), known_names_.end()});
    diagnostics_.Warning(
        parameter.location,
        Concat("unknown parameter ", Called(parameter), " is ignored",
               closest.empty() ? "" : Concat("; did you mean ", Quoted(closest), "?")));
  }
}

}  // namespace lucerna
