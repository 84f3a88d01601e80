#include "render/formats/mitsuba/document.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "absl/strings/ascii.h"
#include <pugixml.hpp>

#include "render/base/text.h"
#include "render/formats/pbrt/spectrum_files.h"

namespace lucerna {
namespace {

constexpr std::array<std::string_view, 13> kObjectTags = {
    "bsdf",    "emitter", "film",   "integrator", "medium",  "phase", "ref",
    "rfilter", "sampler", "sensor", "shape",      "texture", "volume"};
constexpr std::array<std::string_view, 11> kValueTags = {
    "blackbody", "boolean", "float",  "integer",   "point", "rgb",
    "spectrum",  "srgb",    "string", "transform", "vector"};
// Of objects in objects.
constexpr int kMaxDepth = 32;
// Of an attribute in which defaults are put in, which may be long themselves.
constexpr std::size_t kMaxAttribute = 1 << 20;
// Of all that is put in: values are kept.
constexpr std::uint64_t kMaxPutIn = 1 << 26;

bool IsIn(std::span<const std::string_view> names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

// "intIOR" and "toWorld" become "int_ior" and "to_world".
std::string WithUnderscores(std::string_view name) {
  std::string result;
  bool after_lower_case = false;
  for (const char c : name) {
    const auto letter = static_cast<unsigned char>(c);
    if (absl::ascii_isupper(letter) && after_lower_case) result += '_';
    after_lower_case = absl::ascii_islower(letter) || absl::ascii_isdigit(letter);
    result += absl::ascii_tolower(letter);
  }
  return result;
}

// One text of a scene: the main file, or one that is included.
struct Text {
  const std::string* name = nullptr;
  std::vector<std::size_t> line_starts;

  [[nodiscard]] SourceLocation LocationOf(const pugi::xml_node& node) const {
    const auto offset = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, node.offset_debug()));
    const auto next = std::ranges::upper_bound(line_starts, offset);
    const auto line = next - line_starts.begin();
    return {name, static_cast<int>(line), static_cast<int>(offset - *(next - 1)) + 1};
  }
};

Text TextOf(const std::string* name, std::string_view text) {
  Text result = {name, {0}};
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\n') result.line_starts.push_back(i + 1);
  }
  return result;
}

// "0.6.0"; that of today where it is absent or says nothing.
std::array<int, 3> VersionOf(std::string_view text) {
  if (text.empty()) return MitsubaDocument().version;
  std::array<int, 3> version = {};
  for (std::size_t i = 0; i < version.size() && !text.empty(); ++i) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), version[i]);
    if (error != std::errc()) return MitsubaDocument().version;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (text.starts_with('.')) text.remove_prefix(1);
  }
  return version;
}

class DocumentReader {
 public:
  DocumentReader(AssetReader& assets, Diagnostics& diagnostics, MitsubaDocument& document)
      : assets_(assets), diagnostics_(diagnostics), document_(document) {}

  // The main file.
  void Read(const std::string& path, std::string_view text) {
    ReadText(path, text, 0, document_.scene);
    AddIds(document_.scene);
    AddAliases();
  }

 private:
  struct Alias {
    std::string of, name;
    SourceLocation location;
  };

  // Reads what the root has, or the root itself where it is no scene, into `object`.
  void ReadText(const std::string& path, std::string_view bytes, int depth, MitsubaObject& object);
  void AddIds(const MitsubaObject& object);
  void AddAliases();
  // The attribute with the defaults of the scene put in; empty when it is absent.
  std::string AttributeOf(const Text& text, const pugi::xml_node& node, const char* name);
  // The children of `node`, or one of them, as parts of `object`.
  void ReadInto(const Text& text, const pugi::xml_node& node, int depth, MitsubaObject& object);
  void ReadElement(const Text& text, const pugi::xml_node& node, int depth, MitsubaObject& object);
  void ReadObject(const Text& text, const pugi::xml_node& node, int depth, MitsubaObject& parent);
  void ReadValue(const Text& text, const pugi::xml_node& node, MitsubaObject& object);
  bool ReadSpectrum(const std::string& value, Parameter& parameter);
  Transform ReadTransform(const Text& text, const pugi::xml_node& node);
  StatusOr<Transform> ReadStep(const Text& text, const pugi::xml_node& node);
  // x, y and z of their own, or all in "value".
  std::array<double, 3> ReadTriple(const Text& text, const pugi::xml_node& node, double otherwise);
  double ReadNumber(const Text& text, const pugi::xml_node& node, const char* name,
                    double otherwise);
  void Include(const Text& text, const pugi::xml_node& node, int depth, MitsubaObject& object);
  void Error(const Text& text, const pugi::xml_node& node, std::string_view message) {
    diagnostics_.Error(text.LocationOf(node), Concat("<", node.name(), ">: ", message));
  }

  AssetReader& assets_;
  Diagnostics& diagnostics_;
  MitsubaDocument& document_;
  std::map<std::string, std::string> defaults_;
  std::vector<Alias> aliases_;
  std::vector<std::string> open_texts_;
  std::uint64_t texts_read_ = 0;
  std::uint64_t put_in_bytes_ = 0;  // of defaults
};

std::string DocumentReader::AttributeOf(const Text& text, const pugi::xml_node& node,
                                        const char* name) {
  const std::string_view text_of = node.attribute(name).value();
  std::string value;
  std::string_view rest = text_of;
  for (std::size_t at = rest.find('$'); at != std::string::npos; at = rest.find('$')) {
    std::size_t end = at + 1;
    while (end < rest.size() && (absl::ascii_isalnum(static_cast<unsigned char>(rest[end])) ||
                                 rest[end] == '_' || rest[end] == '-')) {
      ++end;
    }
    // As Mitsuba, the longest name that there is: a dash may be part of it or follow it.
    std::string variable(rest.substr(at + 1, end - at - 1));
    auto found = defaults_.find(variable);
    while (found == defaults_.end() && !variable.empty()) {
      variable.pop_back();
      found = defaults_.find(variable);
    }
    if (found == defaults_.end()) {
      Error(text, node,
            Concat("there is no value of ", Quoted(rest.substr(at, end - at)),
                   "; give one by <default name=... value=.../> before it"));
      return "";
    }
    value += rest.substr(0, at);
    value += found->second;
    rest.remove_prefix(at + 1 + variable.size());
    put_in_bytes_ += found->second.size();
    if (value.size() > kMaxAttribute || put_in_bytes_ > kMaxPutIn) {
      Error(text, node, Concat(Quoted(name), " is too long with its defaults put in"));
      return "";
    }
  }
  value += rest;
  return value;
}

double DocumentReader::ReadNumber(const Text& text, const pugi::xml_node& node, const char* name,
                                  double otherwise) {
  if (node.attribute(name).empty()) return otherwise;
  const auto numbers = ListedNumbers(AttributeOf(text, node, name));
  if (numbers.has_value() && numbers->size() == 1) return numbers->front();
  Error(text, node, Concat(Quoted(name), " must be a number"));
  return otherwise;
}

std::array<double, 3> DocumentReader::ReadTriple(const Text& text, const pugi::xml_node& node,
                                                 double otherwise) {
  if (node.attribute("value").empty()) {
    return {ReadNumber(text, node, "x", otherwise), ReadNumber(text, node, "y", otherwise),
            ReadNumber(text, node, "z", otherwise)};
  }
  const auto numbers = ListedNumbers(AttributeOf(text, node, "value"));
  if (numbers.has_value() && numbers->size() == 1)
    return {numbers->front(), numbers->front(), numbers->front()};
  if (numbers.has_value() && numbers->size() == 3)
    return {(*numbers)[0], (*numbers)[1], (*numbers)[2]};
  Error(text, node, "\"value\" must be one number or three");
  return {otherwise, otherwise, otherwise};
}

StatusOr<Transform> DocumentReader::ReadStep(const Text& text, const pugi::xml_node& node) {
  const std::string_view kind = node.name();
  if (kind == "translate") {
    const std::array<double, 3> v = ReadTriple(text, node, 0);
    return Transform::Translate(v[0], v[1], v[2]);
  }
  if (kind == "scale") {
    const std::array<double, 3> v = ReadTriple(text, node, 1);
    return Transform::Scale(v[0], v[1], v[2]);
  }
  if (kind == "rotate") {
    const std::array<double, 3> axis = ReadTriple(text, node, 0);
    if (axis == std::array<double, 3>{} && ReadNumber(text, node, "angle", 0) == 0)
      return Transform();
    return Transform::Rotate(ReadNumber(text, node, "angle", 0), axis[0], axis[1], axis[2]);
  }
  if (kind == "lookat" || kind == "lookAt") {
    const auto triple = [&](const char* name, const std::array<double, 3>& otherwise) {
      if (node.attribute(name).empty()) return otherwise;
      const auto numbers = ListedNumbers(AttributeOf(text, node, name));
      if (numbers.has_value() && numbers->size() == 3)
        return std::array<double, 3>{(*numbers)[0], (*numbers)[1], (*numbers)[2]};
      Error(text, node, Concat(Quoted(name), " must be three numbers"));
      return otherwise;
    };
    const std::array<double, 3> origin = triple("origin", {0, 0, 0});
    const std::array<double, 3> target = triple("target", {0, 0, 1});
    std::array<double, 3> up = triple("up", {0, 0, 0});
    if (up == std::array<double, 3>{0, 0, 0}) {
      // Any that is not along the view.
      up = {0, 1, 0};
      if (target[0] == origin[0] && target[2] == origin[2]) up = {0, 0, 1};
    }
    LUCERNA_ASSIGN_OR_RETURN(const Transform from_world, Transform::LookAt(origin, target, up));
    return from_world.Inverse();
  }
  if (kind == "matrix") {
    const auto numbers = ListedNumbers(AttributeOf(text, node, "value"));
    std::array<std::array<double, 4>, 4> rows = {
        {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
    if (!numbers.has_value() || (numbers->size() != 9 && numbers->size() != 16))
      return absl::InvalidArgumentError("\"value\" must be 16 numbers, or 9, row by row");
    const std::size_t side = numbers->size() == 9 ? 3 : 4;
    for (std::size_t i = 0; i < numbers->size(); ++i)
      rows[i / side][i % side] = (*numbers)[i];
    // What exporters multiply is rounded.
    constexpr std::array<double, 4> kLast = {0, 0, 0, 1};
    const bool is_affine = std::ranges::equal(
        rows[3], kLast, [](double a, double b) { return std::abs(a - b) <= 1e-4; });
    rows[3] = kLast;
    if (!is_affine) {
      return absl::InvalidArgumentError(
          "\"value\" must be affine: its last four numbers must be 0 0 0 1");
    }
    return Transform(rows);
  }
  return absl::InvalidArgumentError(
      "is no part of a transform; there are translate, rotate, scale, lookat and matrix");
}

Transform DocumentReader::ReadTransform(const Text& text, const pugi::xml_node& node) {
  Transform transform;
  for (const pugi::xml_node& step : node.children()) {
    if (step.type() != pugi::node_element) continue;
    const StatusOr<Transform> next = ReadStep(text, step);
    if (!next.ok()) {
      Error(text, step, std::string(next.status().message()));
      continue;
    }
    // Steps are applied in the order of the text.
    transform = *next * transform;
    if (!transform.IsFinite()) {
      Error(text, step, "makes a transform that is not finite");
      return {};
    }
  }
  return transform;
}

// One value at all wavelengths, pairs "wavelength:value" or, in old files, red, green and blue.
bool DocumentReader::ReadSpectrum(const std::string& value, Parameter& parameter) {
  const std::size_t pairs = static_cast<std::size_t>(std::ranges::count(value, ':'));
  std::string list = value;
  std::ranges::replace(list, ':', ' ');
  const auto numbers = ListedNumbers(list);
  if (!numbers.has_value()) return false;
  if (pairs == 0 && numbers->size() == 1) {
    parameter.type = "rgb";
    parameter.numbers.assign(3, numbers->front());
    return true;
  }
  if (pairs == 0 && numbers->size() == 3 && document_.is_old()) {
    parameter.type = "rgb";
    parameter.numbers = *numbers;
    return true;
  }
  parameter.type = "spectrum";
  parameter.numbers = *numbers;
  PartEqualWavelengths(parameter.numbers);
  return pairs > 0 && numbers->size() == 2 * pairs;
}

void DocumentReader::ReadValue(const Text& text, const pugi::xml_node& node,
                               MitsubaObject& object) {
  const std::string_view tag = node.name();
  Parameter parameter;
  parameter.location = text.LocationOf(node);
  parameter.called = AttributeOf(text, node, "name");
  parameter.name = WithUnderscores(parameter.called);
  if (parameter.name.empty()) {
    Error(text, node, "needs a name");
    return;
  }
  if (tag == "transform") {
    if (!object.transforms.emplace(parameter.name, ReadTransform(text, node)).second)
      Error(text, node, Concat(Quoted(parameter.called), " is given twice"));
    return;
  }
  const std::string value = AttributeOf(text, node, "value");
  const auto wrong = [&](std::string_view wanted) {
    Error(text, node,
          Concat(Quoted(parameter.called), " must be ", wanted, ", not ", Quoted(value)));
  };
  if (tag == "string") {
    parameter.type = "string";
    parameter.strings.push_back(value);
  } else if (tag == "boolean") {
    parameter.type = "bool";
    const std::string lower = absl::AsciiStrToLower(value);
    if (lower != "true" && lower != "false") return wrong("true or false");
    parameter.bools.push_back(lower == "true");
  } else if (tag == "point" || tag == "vector") {
    parameter.type = tag == "point" ? "point3" : "vector3";
    const std::array<double, 3> triple = ReadTriple(text, node, 0);
    parameter.numbers.assign(triple.begin(), triple.end());
  } else if (tag == "float" || tag == "integer") {
    parameter.type = tag;
    const auto numbers = ListedNumbers(value);
    if (!numbers.has_value() || numbers->size() != 1) return wrong("a number");
    if (tag == "integer" && (numbers->front() != std::floor(numbers->front()) ||
                             !(std::abs(numbers->front()) < 0x1p31))) {
      return wrong("a whole number of 32 bits");
    }
    parameter.numbers = *numbers;
  } else if (tag == "rgb" || tag == "srgb") {
    parameter.type = "rgb";
    const bool is_code = value.starts_with('#');
    std::optional<std::vector<double>> numbers;
    if (is_code) {
      std::uint32_t code = 0;
      const auto [end, error] =
          std::from_chars(value.data() + 1, value.data() + value.size(), code, 16);
      if (error != std::errc() || end != value.data() + value.size() || value.size() != 7)
        return wrong("a colour such as #ff8000");
      numbers = {(code >> 16U) / 255.0, ((code >> 8U) & 255U) / 255.0, (code & 255U) / 255.0};
    } else {
      numbers = ListedNumbers(value);
    }
    if (!numbers.has_value() || (numbers->size() != 1 && numbers->size() != 3))
      return wrong("one number or three");
    if (numbers->size() == 1) numbers->resize(3, numbers->front());
    if (is_code || tag == "srgb") {
      for (double& number : *numbers)
        number = PixelEncoding().Decode(std::clamp(number, 0.0, 1.0));
    }
    parameter.numbers = *std::move(numbers);
  } else if (tag == "spectrum") {
    if (!node.attribute("filename").empty()) {
      parameter.type = "spectrum";
      parameter.strings.push_back(AttributeOf(text, node, "filename"));
      std::vector<Parameter> read = {std::move(parameter)};
      ReadSpectrumFiles(assets_, read, diagnostics_);
      parameter = std::move(read.front());
      PartEqualWavelengths(parameter.numbers);
    } else if (!ReadSpectrum(value, parameter)) {
      return wrong(document_.is_old() ? "one number, three, or pairs \"wavelength:value\""
                                      : "one number, or pairs \"wavelength:value\"");
    }
  } else {
    parameter.type = "blackbody";
    std::string temperature = AttributeOf(text, node, "temperature");
    if (temperature.ends_with('K')) temperature.pop_back();
    const auto kelvin = ListedNumbers(temperature.empty() ? "6500" : temperature);
    if (!kelvin.has_value() || kelvin->size() != 1) {
      Error(text, node, "\"temperature\" must be a number");
      return;
    }
    parameter.numbers = {kelvin->front(), ReadNumber(text, node, "scale", 1)};
  }
  object.values.push_back(std::move(parameter));
}

void DocumentReader::ReadObject(const Text& text, const pugi::xml_node& node, int depth,
                                MitsubaObject& parent) {
  if (depth > kMaxDepth) {
    Error(text, node, Concat("is in more than ", kMaxDepth, " others"));
    return;
  }
  MitsubaObject& object = parent.children.emplace_back();
  object.tag = node.name();
  if (object.tag == "spectrum") object.tag = "texture";
  object.type = AttributeOf(text, node, "type");
  object.id = AttributeOf(text, node, "id");
  object.called = AttributeOf(text, node, "name");
  object.name = WithUnderscores(object.called);
  object.location = text.LocationOf(node);
  if (object.tag == "ref") {
    if (object.id.empty()) Error(text, node, "needs the id of what it refers to");
    return;
  }
  if (object.type.empty()) Error(text, node, "needs a type");
  ReadInto(text, node, depth, object);
}

void DocumentReader::Include(const Text& text, const pugi::xml_node& node, int depth,
                             MitsubaObject& object) {
  const std::string path = AttributeOf(text, node, "filename");
  const SceneLimits& limits = assets_.limits();
  if (std::ranges::find(open_texts_, path) != open_texts_.end()) {
    Error(text, node, Concat("the file ", Quoted(path), " includes itself"));
  } else if (static_cast<int>(open_texts_.size()) >= limits.max_include_depth ||
             ++texts_read_ > limits.max_files) {
    Error(text, node, "too many files are included");
  } else if (const StatusOr<std::string> included = assets_.ReadText(path); included.ok()) {
    const std::size_t parts_before = object.children.size();
    ReadText(path, *included, depth, object);
    const std::string called = AttributeOf(text, node, "name");
    if (!called.empty() && object.children.size() == parts_before + 1) {
      object.children.back().called = called;
      object.children.back().name = WithUnderscores(called);
    }
  } else {
    Error(text, node, std::string(included.status().message()));
  }
}

void DocumentReader::ReadInto(const Text& text, const pugi::xml_node& node, int depth,
                              MitsubaObject& object) {
  for (const pugi::xml_node& child : node.children()) {
    if (child.type() == pugi::node_element) ReadElement(text, child, depth, object);
  }
}

void DocumentReader::ReadElement(const Text& text, const pugi::xml_node& node, int depth,
                                 MitsubaObject& object) {
  const std::string_view tag = node.name();
  if (IsIn(kObjectTags, tag) || (tag == "spectrum" && !node.attribute("type").empty())) {
    ReadObject(text, node, depth + 1, object);
  } else if (IsIn(kValueTags, tag)) {
    ReadValue(text, node, object);
  } else if (tag == "default") {
    // What is given first counts.
    defaults_.emplace(node.attribute("name").value(), AttributeOf(text, node, "value"));
  } else if (tag == "include") {
    Include(text, node, depth, object);
  } else if (tag == "path") {
    if (depth > 0) Error(text, node, "must not be in an object");
    if (const Status added = assets_.AddFolder(AttributeOf(text, node, "value")); !added.ok())
      Error(text, node, std::string(added.message()));
  } else if (tag == "alias") {
    aliases_.push_back(
        {AttributeOf(text, node, "id"), AttributeOf(text, node, "as"), text.LocationOf(node)});
  } else {
    std::vector<std::string_view> known(kObjectTags.begin(), kObjectTags.end());
    known.insert(known.end(), kValueTags.begin(), kValueTags.end());
    const std::string_view closest = ClosestOf(tag, known);
    Error(
        text, node,
        closest.empty() ? "is not supported" : Concat("is unknown; did you mean <", closest, ">?"));
  }
}

void DocumentReader::ReadText(const std::string& path, std::string_view bytes, int depth,
                              MitsubaObject& object) {
  const Text text = TextOf(diagnostics_.NameOfFile(path), bytes);
  pugi::xml_document xml;
  const pugi::xml_parse_result parsed =
      xml.load_buffer(bytes.data(), bytes.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!parsed) {
    const auto next = std::ranges::upper_bound(
        text.line_starts, static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, parsed.offset)));
    diagnostics_.Error({text.name, static_cast<int>(next - text.line_starts.begin()), 1},
                       Concat("this is no XML: ", parsed.description()));
    return;
  }
  const pugi::xml_node root = xml.document_element();
  const bool is_scene = std::string_view(root.name()) == "scene";
  if (open_texts_.empty()) {
    if (!is_scene) {
      diagnostics_.Error(
          {text.name, 0, 0},
          Concat("a Mitsuba scene begins with <scene>, not with <", root.name(), ">"));
      return;
    }
    object.tag = "scene";
    object.location = text.LocationOf(root);
    document_.version = VersionOf(root.attribute("version").value());
  }
  open_texts_.push_back(path);
  if (is_scene) {
    ReadInto(text, root, depth, object);
  } else {
    ReadElement(text, root, depth, object);
  }
  open_texts_.pop_back();
}

void DocumentReader::AddIds(const MitsubaObject& object) {
  if (object.tag == "ref") return;
  if (!object.id.empty() && !document_.objects.emplace(object.id, &object).second)
    diagnostics_.Error(object.location, Concat("the id ", Quoted(object.id), " is given twice"));
  for (const MitsubaObject& child : object.children)
    AddIds(child);
}

void DocumentReader::AddAliases() {
  for (const Alias& alias : aliases_) {
    const auto found = document_.objects.find(alias.of);
    if (found == document_.objects.end()) {
      diagnostics_.Error(alias.location,
                         Concat("there is no object with the id ", Quoted(alias.of)));
    } else if (!document_.objects.emplace(alias.name, found->second).second) {
      diagnostics_.Error(alias.location, Concat("the id ", Quoted(alias.name), " is given twice"));
    }
  }
}

}  // namespace

std::optional<std::vector<double>> ListedNumbers(std::string_view text) {
  std::vector<double> numbers;
  constexpr std::string_view kBetween = " \t\r\n,";
  std::size_t at = 0;
  while ((at = text.find_first_not_of(kBetween, at)) != std::string_view::npos) {
    std::string_view word = text.substr(at, text.find_first_of(kBetween, at) - at);
    at += word.size();
    if (word.starts_with('+')) word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::result_out_of_range) {
      value = 0;  // too small; what is too large has more than 38 digits or an exponent
      if (word.find("e-") == std::string_view::npos && word.find("E-") == std::string_view::npos)
        return std::nullopt;
    } else if (error != std::errc()) {
      return std::nullopt;
    }
    if (end != word.data() + word.size() || !(std::abs(value) <= 3.4e38)) return std::nullopt;
    numbers.push_back(value);
  }
  return numbers;
}

void PartEqualWavelengths(std::vector<double>& pairs) {
  constexpr double kStepNm = 1e-4;
  double given = 0;
  for (std::size_t i = 0; i < pairs.size(); i += 2) {
    const bool is_equal = i > 0 && pairs[i] == given;
    given = pairs[i];
    if (is_equal) pairs[i] = pairs[i - 2] + kStepNm;
  }
}

void ReadMitsubaDocument(const std::string& main_path, std::string_view text, AssetReader& assets,
                         Diagnostics& diagnostics, MitsubaDocument& document) {
  DocumentReader(assets, diagnostics, document).Read(main_path, text);
}

}  // namespace lucerna
