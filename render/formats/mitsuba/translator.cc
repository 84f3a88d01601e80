#include "render/formats/mitsuba/translator.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "render/base/text.h"
#include "render/formats/mitsuba/mitsuba_reader.h"
#include "render/formats/wavelength_color.h"

namespace lucerna {
UnfinishedScene MitsubaTranslator::Translate() {
  // A camera that a view sets is mirrored as this one (formats/view/view_reader.h).
  reader_.scene().camera.camera_to_world = Transform::Scale(-1, 1, 1);
  TranslateView();
  reader_.CarryOut(Directive("WorldBegin", document_.scene));
  for (const MitsubaObject& object : document_.scene.children) {
    if (object.tag == "emitter") TranslateEmitter(object);
    if (object.tag == "shape" && object.type != "shapegroup") TranslateShape(object);
  }
  // Textures of the scene are for others to refer to.
  ParameterList values(SubjectOf(document_.scene), document_.scene.location, document_.scene.values,
                       nullptr, diagnostics_);
  values.WarnOfUnread();
  return reader_.Finish();
}

std::string MitsubaTranslator::SubjectOf(const MitsubaObject& object) {
  if (object.tag == "scene") return "<scene>";
  return Concat("<", object.tag, " type=", Quoted(object.type), ">");
}

ParameterList MitsubaTranslator::ListOf(const MitsubaObject& object) {
  std::vector<Parameter> given = object.values;
  for (const MitsubaObject& child : object.children) {
    const MitsubaObject* resolved = FindResolved(child);
    if (child.name.empty() || resolved == nullptr ||
        (resolved->tag != "texture" && resolved->tag != "volume")) {
      continue;
    }
    Parameter texture = MakeString(child.name, child.called, child.location);
    texture.type = "texture";
    texture.called = child.called;
    given.push_back(std::move(texture));
  }
  return ParameterList(SubjectOf(object), object.location, std::move(given), nullptr, diagnostics_);
}

MadeDirective MitsubaTranslator::Directive(std::string_view name,
                                           const MitsubaObject& object) const {
  MadeDirective made;
  made.name = name;
  made.location = object.location;
  made.subject = SubjectOf(object);
  return made;
}

const MitsubaObject* MitsubaTranslator::FindResolved(const MitsubaObject& object) const {
  if (object.tag != "ref") return &object;
  const auto found = document_.objects.find(object.id);
  return found != document_.objects.end() ? found->second : nullptr;
}

const MitsubaObject* MitsubaTranslator::Resolve(const MitsubaObject& object) {
  const MitsubaObject* resolved = FindResolved(object);
  if (resolved == nullptr) {
    diagnostics_.Error(object.location,
                       Concat("there is no object with the id ", Quoted(object.id)));
  }
  return resolved;
}

const MitsubaObject* MitsubaTranslator::ChildOf(const MitsubaObject& object, std::string_view tag,
                                                std::string_view name) const {
  for (const MitsubaObject& child : object.children) {
    if (!name.empty() && child.name != name) continue;
    const MitsubaObject* resolved = FindResolved(child);
    if (resolved != nullptr && resolved->tag == tag) return resolved;
  }
  return nullptr;
}

bool MitsubaTranslator::Open(const MitsubaObject& object) {
  if (open_.insert(&object).second) return true;
  diagnostics_.Error(object.location, Concat(SubjectOf(object), " refers to itself"));
  return false;
}

std::string MitsubaTranslator::NewName(const MitsubaObject& object) {
  const std::string wanted =
      object.id.empty() ? Concat(object.type, " in line ", object.location.line) : object.id;
  std::string name = wanted;
  for (int i = 2; !names_.insert(name).second; ++i)
    name = Concat(wanted, " (", i, ")");
  return name;
}

void MitsubaTranslator::SetTransform(const Transform& to_world, const MitsubaObject& object) {
  MadeDirective made = Directive("Transform", object);
  for (std::size_t column = 0; column < 4; ++column) {
    for (std::size_t row = 0; row < 3; ++row)
      made.numbers.push_back(to_world.rows()[row][column]);
    made.numbers.push_back(column == 3 ? 1 : 0);  // an inverse may have it rounded
  }
  reader_.CarryOut(std::move(made));
}

Transform MitsubaTranslator::ToWorld(const MitsubaObject& object) {
  const auto found = object.transforms.find("to_world");
  return found == object.transforms.end() ? Transform() : found->second;
}

void MitsubaTranslator::RefuseOthers(const MitsubaObject& object,
                                     std::initializer_list<std::string_view> tags) {
  for (const MitsubaObject& child : object.children) {
    const MitsubaObject* resolved = Resolve(child);
    if (resolved == nullptr || std::ranges::find(tags, resolved->tag) != tags.end()) continue;
    if (resolved->tag == "texture" && !child.name.empty()) continue;
    diagnostics_.Warning(child.location, Concat(SubjectOf(*resolved), " in ", SubjectOf(object),
                                                " is ignored: it has no meaning there"));
  }
}

Parameter MitsubaTranslator::MakeNumber(std::string name, double value,
                                        const SourceLocation& location) {
  Parameter made;
  made.location = location;
  made.type = "float";
  made.name = std::move(name);
  made.numbers = {value};
  return made;
}

Parameter MitsubaTranslator::MakeColor(std::string name, Rgb value,
                                       const SourceLocation& location) {
  Parameter made;
  made.location = location;
  made.type = "rgb";
  made.name = std::move(name);
  made.numbers = {static_cast<double>(value.r), static_cast<double>(value.g),
                  static_cast<double>(value.b)};
  return made;
}

Parameter MitsubaTranslator::MakeString(std::string name, std::string value,
                                        const SourceLocation& location) {
  Parameter made;
  made.location = location;
  made.type = "string";
  made.name = std::move(name);
  made.strings = {std::move(value)};
  return made;
}

std::optional<Parameter> MitsubaTranslator::ValueOf(const MitsubaObject& object,
                                                    ParameterList& list, std::string_view name) {
  const Parameter* given = list.FindWhole(name);
  if (given == nullptr) return std::nullopt;
  Parameter value = *given;
  if (value.type == "integer") value.type = "float";
  if (value.type != "texture") return value;
  for (const std::string_view tag : {"texture", "volume"}) {
    const MitsubaObject* child = ChildOf(object, tag, name);
    if (child == nullptr) continue;
    std::optional<Parameter> everywhere = SpectrumOf(*child);
    if (!everywhere.has_value()) continue;
    everywhere->name = value.name;
    everywhere->called = value.called;
    return everywhere;
  }
  return value;
}

std::optional<Parameter> MitsubaTranslator::SpectrumOf(const MitsubaObject& texture) {
  const std::string_view type = texture.type;
  ParameterList list = ListOf(texture);
  Parameter made = MakeColor("value", Gray(1), texture.location);
  const auto numbers = [&](std::string_view name) {
    const auto found = ListedNumbers(list.String(name, ""));
    if (!found.has_value() || found->empty()) list.Error(name, "needs numbers");
    return found.value_or(std::vector<double>());
  };
  const auto spectrum = [&](const std::vector<double>& values, const auto& wavelength_nm) {
    made.type = "spectrum";
    made.numbers.clear();
    for (std::size_t i = 0; i < values.size(); ++i)
      made.numbers.insert(made.numbers.end(), {wavelength_nm(i), values[i]});
    PartEqualWavelengths(made.numbers);
  };
  if (type == "srgb" || type == "rgb" || type == "uniform" || type == "constvolume" ||
      type == "d65") {
    const std::string_view name = list.Has("color") ? "color" : "value";
    if (const Parameter* value = list.FindWhole(name)) {
      const bool is_number = value->type == "float" || value->type == "integer";
      if (is_number || value->type == "rgb" || value->type == "spectrum") {
        made = *value;
        if (is_number) made.type = "float";
      } else {
        list.Error(name, Concat("must be a colour or a number, not ", value->type));
      }
    } else if (type != "d65") {  // is white, as everywhere in a Scene
      list.Error(Concat("needs <rgb name=", Quoted(name), ">"));
    }
    if (type == "d65") {
      const double scale = list.Float("scale", 1, kZeroOrMore);
      // Of a curve every second number is a wavelength.
      const std::size_t step = made.type == "spectrum" ? 2 : 1;
      for (std::size_t i = step - 1; i < made.numbers.size(); i += step)
        made.numbers[i] *= scale;
    }
  } else if (type == "blackbody") {
    made.type = "blackbody";
    made.numbers = {list.Float("temperature", 6500), list.Float("scale", 1)};
  } else if (type == "irregular") {
    const std::vector<double> wavelengths = numbers("wavelengths");
    const std::vector<double> values = numbers("values");
    if (wavelengths.size() != values.size()) list.Error("must have as many wavelengths as values");
    if (!values.empty() && wavelengths.size() == values.size())
      spectrum(values, [&](std::size_t i) { return wavelengths[i]; });
  } else if (type == "regular") {
    const std::vector<double> values = numbers("values");
    double first = list.Float("wavelength_min", list.Float("lambda_min", 360), kAboveZero);
    double last = list.Float("wavelength_max", list.Float("lambda_max", 830), kAboveZero);
    if (list.Has("range")) {
      const std::vector<double> range = numbers("range");
      if (range.size() != 2) list.Error("range", "must be two wavelengths");
      if (range.size() == 2) first = range[0], last = range[1];
    }
    if (!(last > first)) list.Error("must have wavelengths that increase");
    const double step = (last - first) / std::max(1.0, static_cast<double>(values.size()) - 1);
    if (!values.empty() && last > first)
      spectrum(values, [&](std::size_t i) { return first + static_cast<double>(i) * step; });
  } else {
    return std::nullopt;
  }
  list.WarnOfUnread();
  return made;
}

Parameter MitsubaTranslator::ParameterOf(Parameter value, std::string name, Meaning meaning) {
  value.name = std::move(name);
  const bool is_color = value.type == "rgb" && value.numbers.size() == 3;
  if (meaning == Meaning::kNumber && is_color) {
    value.type = "float";
    value.numbers = {(value.numbers[0] + value.numbers[1] + value.numbers[2]) / 3};
  } else if (meaning == Meaning::kColor && value.type == "float") {
    value.type = "rgb";
    value.numbers.resize(3, value.numbers.front());
  }
  return value;
}

std::optional<Parameter> MitsubaTranslator::Find(const MitsubaObject& object, ParameterList& list,
                                                 std::string_view name, std::string as,
                                                 Meaning meaning) {
  std::optional<Parameter> value = ValueOf(object, list, name);
  if (!value.has_value()) return std::nullopt;
  if (value->type == "texture") {
    const MitsubaObject* texture = ChildOf(object, "texture", name);
    const auto texture_name = texture == nullptr ? std::nullopt : TextureOf(*texture, meaning);
    if (texture == nullptr) list.Error(name, "must not be a volume");
    if (!texture_name.has_value()) return std::nullopt;
    value->strings = {*texture_name};
  }
  return ParameterOf(*std::move(value), std::move(as), meaning);
}

Rgb MitsubaTranslator::FindLight(const MitsubaObject& object, ParameterList& list,
                                 std::string_view name) {
  const std::optional<Parameter> value = ValueOf(object, list, name);
  if (!value.has_value()) return Gray(1);
  if (value->type == "texture") {
    list.Error(name, "is a texture, which is not supported here; give an rgb instead");
  } else if (value->type == "float" || value->type == "rgb") {
    const double r = value->numbers.front();
    const double g = value->numbers.size() == 3 ? value->numbers[1] : r;
    const double b = value->numbers.size() == 3 ? value->numbers[2] : r;
    if (r >= 0 && g >= 0 && b >= 0)
      return {static_cast<float>(r), static_cast<float>(g), static_cast<float>(b)};
    list.Error(name, "must not be negative");
  } else if (value->type == "blackbody") {
    const double temperature_k = value->numbers[0];
    const double scale = value->numbers[1];
    if (!(temperature_k >= kMinBlackbodyK && temperature_k <= kMaxBlackbodyK)) {
      list.Error(name, Concat("must have a temperature from ", kMinBlackbodyK, " to ",
                              kMaxBlackbodyK, ", not ", temperature_k));
      return Gray(1);
    }
    // As Mitsuba's spectra: its radiance, where 1 at all wavelengths has luminance 1.
    const double luminance = kBlackbodyUnit * LuminanceOf(BlackbodyCurve(temperature_k)) * scale;
    if (luminance >= 0 && luminance <= 1e30)
      return BlackbodyColor(temperature_k) * static_cast<float>(luminance);
    list.Error(name, "must have a scale of at least 0 that is not too large");
  } else if (value->type == "spectrum" && value->strings.empty()) {
    WavelengthCurve curve;
    for (std::size_t i = 0; i + 1 < value->numbers.size(); i += 2) {
      curve.wavelength_nm.push_back(value->numbers[i]);
      curve.value.push_back(value->numbers[i + 1]);
    }
    const bool is_negative = std::ranges::any_of(curve.value, [](double v) { return v < 0; });
    const bool is_rising = std::ranges::adjacent_find(curve.wavelength_nm, std::greater_equal()) ==
                           curve.wavelength_nm.end();
    if (!is_negative && is_rising && value->numbers.size() % 2 == 0)
      return EmissionColor(curve) * static_cast<float>(LuminanceOf(curve));
    list.Error(name, is_negative ? "must not be negative" : "must have wavelengths that increase");
  } else {
    list.Error(name,
               "must be an rgb, a number, a blackbody, pairs of wavelength and value or an "
               ".spd file of them");
  }
  return Gray(1);
}

Rgb MitsubaTranslator::FindColor(const MitsubaObject& object, ParameterList& list,
                                 std::string_view name, Rgb otherwise) {
  if (!list.Has(name)) return otherwise;
  const std::optional<Parameter> value = ValueOf(object, list, name);
  if (value.has_value() && value->type == "texture") {
    list.Error(name, "must be the same everywhere; give an rgb");
    return otherwise;
  }
  return FindLight(object, list, name);
}

bool BeginsAsMitsuba(std::string_view text) {
  const std::size_t root = text.find("<scene");
  const std::size_t first = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  return root != std::string_view::npos && root < 65'536 && text[first] == '<';
}

UnfinishedScene ReadMitsuba(const std::string& main_path, std::string_view text,
                            AssetReader& assets, Diagnostics& diagnostics) {
  MitsubaDocument document;
  ReadMitsubaDocument(main_path, text, assets, diagnostics, document);
  // What is left out by an error leads to others that say nothing new.
  if (diagnostics.has_error()) return {};
  assets.ReadPicturesAsMitsuba();
  return MitsubaTranslator(document, assets, diagnostics).Translate();
}

}  // namespace lucerna
