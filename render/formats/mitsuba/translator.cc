#include "render/formats/mitsuba/translator.h"

#include <algorithm>
#include <utility>

#include "render/base/text.h"
#include "render/formats/mitsuba/mitsuba_reader.h"
#include "render/formats/wavelength_color.h"

namespace lucerna {
UnfinishedScene MitsubaTranslator::Translate() {
  TranslateView();
  reader_.CarryOut(Directive("WorldBegin", document_.scene));
  for (const MitsubaObject& object : document_.scene.children) {
    if (object.tag == "emitter") TranslateEmitter(object);
    if (object.tag == "shape" && object.type != "shapegroup") TranslateShape(object);
  }
  ParameterList values = ListOf(document_.scene);
  values.WarnOfUnread();
  return reader_.Finish();
}

std::string MitsubaTranslator::SubjectOf(const MitsubaObject& object) {
  if (object.tag == "scene") return "<scene>";
  return Concat("<", object.tag, " type=", Quoted(object.type), ">");
}

ParameterList MitsubaTranslator::ListOf(const MitsubaObject& object) {
  return ParameterList(SubjectOf(object), object.location, object.values, nullptr, diagnostics_);
}

MadeDirective MitsubaTranslator::Directive(std::string_view name,
                                           const MitsubaObject& object) const {
  MadeDirective made;
  made.name = name;
  made.location = object.location;
  made.subject = SubjectOf(object);
  return made;
}

const MitsubaObject* MitsubaTranslator::Resolve(const MitsubaObject& object) {
  if (object.tag != "ref") return &object;
  const auto found = document_.objects.find(object.id);
  if (found != document_.objects.end()) return found->second;
  diagnostics_.Error(object.location, Concat("there is no object with the id ", Quoted(object.id)));
  return nullptr;
}

const MitsubaObject* MitsubaTranslator::ChildOf(const MitsubaObject& object, std::string_view tag,
                                                std::string_view name) {
  for (const MitsubaObject& child : object.children) {
    if (!name.empty() && child.name != name) continue;
    const MitsubaObject* resolved = nullptr;
    if (child.tag != "ref") {
      resolved = &child;
    } else if (document_.objects.contains(child.id)) {
      resolved = document_.objects.at(child.id);
    }
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

std::optional<Parameter> MitsubaTranslator::Find(const MitsubaObject& object, ParameterList& list,
                                                 std::string_view name, std::string as,
                                                 Meaning meaning) {
  if (const MitsubaObject* texture = ChildOf(object, "texture", name)) {
    const std::optional<std::string> texture_name = TextureOf(*texture, meaning);
    if (!texture_name.has_value()) return std::nullopt;
    Parameter made = MakeString(std::move(as), *texture_name, texture->location);
    made.type = "texture";
    made.called = name;
    return made;
  }
  const Parameter* value = list.FindWhole(name);
  if (value == nullptr) return std::nullopt;
  Parameter made = *value;
  made.name = std::move(as);
  const bool is_color = made.type == "rgb" && made.numbers.size() == 3;
  if (meaning == Meaning::kNumber && is_color) {
    made.type = "float";
    made.numbers = {(made.numbers[0] + made.numbers[1] + made.numbers[2]) / 3};
  } else if (meaning == Meaning::kColor && made.type == "float") {
    made.type = "rgb";
    made.numbers.resize(3, made.numbers.front());
  }
  return made;
}

Rgb MitsubaTranslator::FindLight(const MitsubaObject& object, ParameterList& list,
                                 std::string_view name) {
  if (const MitsubaObject* texture = ChildOf(object, "texture", name)) {
    diagnostics_.Error(texture->location,
                       Concat(Quoted(name), " of ", list.subject(),
                              " is a texture, which is not supported here; give an rgb instead"));
    return Gray(1);
  }
  const Parameter* value = list.FindWhole(name);
  if (value == nullptr) return Gray(1);
  if (value->type == "float" || value->type == "rgb") {
    const double r = value->numbers.front();
    const double g = value->numbers.size() == 3 ? value->numbers[1] : r;
    const double b = value->numbers.size() == 3 ? value->numbers[2] : r;
    if (r >= 0 && g >= 0 && b >= 0)
      return {static_cast<float>(r), static_cast<float>(g), static_cast<float>(b)};
    list.Error(name, "must not be negative");
  } else if (value->type == "spectrum" && value->strings.empty()) {
    WavelengthCurve curve;
    for (std::size_t i = 0; i + 1 < value->numbers.size(); i += 2) {
      curve.wavelength_nm.push_back(value->numbers[i]);
      curve.value.push_back(value->numbers[i + 1]);
    }
    if (std::ranges::adjacent_find(curve.wavelength_nm, std::greater_equal()) ==
        curve.wavelength_nm.end()) {
      return EmissionColor(curve) * static_cast<float>(LuminanceOf(curve));
    }
    list.Error(name, "must have wavelengths that increase");
  } else {
    list.Error(name, "must be an rgb, a number or pairs of wavelength and value");
  }
  return Gray(1);
}

Rgb MitsubaTranslator::FindColor(const MitsubaObject& object, ParameterList& list,
                                 std::string_view name, Rgb otherwise) {
  for (const std::string_view tag : {"texture", "volume"}) {
    const MitsubaObject* child = ChildOf(object, tag, name);
    if (child == nullptr) continue;
    diagnostics_.Error(child->location, Concat(Quoted(name), " of ", list.subject(),
                                               " must be the same everywhere; give an rgb"));
    return otherwise;
  }
  if (!list.Has(name)) return otherwise;
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
  return MitsubaTranslator(document, assets, diagnostics).Translate();
}

}  // namespace lucerna
