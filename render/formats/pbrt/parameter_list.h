// The parameters of a directive.
//
// A parameter is `"type name" value` or `"type name" [values]`. A ParameterList hands them out by
// name, checks type, count and range, and at the end reports those that were never read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "render/formats/diagnostic.h"
#include "render/formats/wavelength_color.h"
#include "render/math/dispersion.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"
#include "render/scene/given_spectrum.h"

namespace lucerna {

struct Parameter {
  SourceLocation location;
  std::string type;  // one of KnownParameterTypes()
  std::string name;
  std::string called = {};      // by messages, where that is not `name`
  std::vector<double> numbers;  // numeric types and colours; finite, within single precision
  std::vector<std::string> strings;
  std::vector<bool> bools;
  // A value could not be read, which was reported; the others may be anything.
  bool is_unreadable = false;
  // Its rgb was given in other primaries; what Rec. 709 cannot show is to be clamped.
  bool is_converted = false;

  [[nodiscard]] std::size_t count() const { return numbers.size() + strings.size() + bools.size(); }
};

[[nodiscard]] const std::vector<std::string_view>& KnownParameterTypes();

// The range a number must be in.
struct Range {
  double low, high;
  bool low_is_allowed = true;
};
inline constexpr Range kAnyNumber = {-3.4e38, 3.4e38};
inline constexpr Range kAboveZero = {0, 3.4e38, false};
inline constexpr Range kZeroOrMore = {0, 3.4e38};

// Functions that return a parameter mark it as read. Where a parameter is wrong, they report it and
// return what they would if it were absent.
class ParameterList {
 public:
  // `subject` is what messages call the thing, such as: Shape "sphere". A default (may be null;
  // else outlives the list) gives way to a parameter of its name, and need not be read. Of a
  // parameter that comes twice with one type the last counts, with two types it is an error.
  ParameterList(std::string subject, SourceLocation location, std::vector<Parameter> given,
                const std::vector<Parameter>* defaults, Diagnostics& diagnostics);

  [[nodiscard]] bool Has(std::string_view name) const { return Find(name) != nullptr; }
  // The same of a string that says nothing where it is empty, which counts as read.
  [[nodiscard]] bool HasText(std::string_view name);

  std::optional<double> FindFloat(std::string_view name, Range range = kAnyNumber);
  double Float(std::string_view name, double otherwise, Range range = kAnyNumber);
  std::optional<std::int64_t> FindInteger(std::string_view name, Range range);
  std::optional<bool> FindBool(std::string_view name);
  bool Bool(std::string_view name, bool otherwise);
  std::optional<std::string> FindString(std::string_view name);
  std::string String(std::string_view name, std::string otherwise);
  Vec3 Point(std::string_view name, Vec3 otherwise);
  Vec3 Vector(std::string_view name, Vec3 otherwise);
  // All strings of one parameter, empty when it is absent. Valid as long as the list.
  std::span<const std::string> Strings(std::string_view name);

  // All numbers of one parameter, empty when it is absent. `types` are the type names it may
  // have; their count is a multiple of `group`. Valid as long as the list.
  std::span<const double> Numbers(std::string_view name, std::span<const std::string_view> types,
                                  std::size_t group);

  // Whether a parameter of this name is of type texture, and the name of that texture.
  [[nodiscard]] bool IsTexture(std::string_view name) const;
  std::optional<std::string> FindTexture(std::string_view name);
  // Of colours, `given` (or nullptr) becomes the curve where one is given.
  // A colour in [0, 1].
  std::optional<Rgb> FindReflectance(std::string_view name, GivenSpectrum* given = nullptr);
  // The colour of a light; rgb as it stands, everything else with luminance 1, as in pbrt-v4.
  std::optional<Rgb> FindEmission(std::string_view name, GivenSpectrum* given = nullptr);
  // An optical constant per channel: a colour, a number, a named metal or a curve.
  std::optional<Rgb> FindOpticalConstant(std::string_view name, Range range,
                                         GivenSpectrum* given = nullptr);
  // An index of refraction: a number, a named glass, a curve, or a colour, of which it is the mean.
  std::optional<RefractiveIndex> FindRefractiveIndex(std::string_view name, Range range);
  // The same at the d line, 1.5 when it is absent, with a warning where it is not the same at all
  // wavelengths.
  float OneRefractiveIndex(std::string_view name, Range range);
  void WarnOfOneIndex(std::string_view name);

  // The parameter as it stands, whatever its type; nullptr when it is absent. Valid as long as the
  // list.
  [[nodiscard]] const Parameter* FindWhole(std::string_view name);

  // Warns that a known parameter has no effect here.
  void Ignore(std::string_view name);

  // Report about a parameter, or about the thing itself when the parameter is absent. One with an
  // error counts as read.
  void Error(std::string_view name, std::string_view message);
  void Warning(std::string_view name, std::string_view message);
  void Error(std::string_view message) { Error("", message); }

  // Warns of all parameters that were not read. Call it once, after the last one is read.
  void WarnOfUnread();

  [[nodiscard]] const SourceLocation& location() const { return location_; }
  [[nodiscard]] const std::string& subject() const { return subject_; }
  [[nodiscard]] Diagnostics& diagnostics() { return diagnostics_; }

 private:
  [[nodiscard]] const Parameter* Find(std::string_view name) const;
  // True the first time; always for a default.
  bool MarkRead(const Parameter& parameter);
  // The parameter when it is there, of one of `types` and with `count` values (0: any count).
  const Parameter* Take(std::string_view name, std::span<const std::string_view> types,
                        std::size_t count);
  bool CheckCount(const Parameter& parameter, std::size_t count);
  bool CheckRange(const Parameter& parameter, double value, Range range);
  // The curve that a list of wavelengths and values is.
  std::optional<WavelengthCurve> CurveOf(const Parameter& parameter);
  std::string Called(const Parameter& parameter) const;

  std::string subject_;
  SourceLocation location_;
  std::vector<Parameter> parameters_;
  std::vector<bool> was_read_;  // one for each parameter
  const std::vector<Parameter>* defaults_;
  std::vector<std::string> known_names_;  // for suggestions
  Diagnostics& diagnostics_;
};

}  // namespace lucerna
