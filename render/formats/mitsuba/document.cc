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

// The numbers of a list that spaces and commas separate; absent when something else is in it, or a
// number that single precision cannot hold.
std::optional<std::vector<double>> NumbersOf(std::string_view text) {
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

class DocumentReader {
 public:
  DocumentReader(AssetReader& assets, Diagnostics& diagnostics, MitsubaDocument& document)
      : assets_(assets), diagnostics_(diagnostics), document_(document) {}

  void ReadText(const std::string& path, std::string_view text);

 private:
  // The attribute with the defaults of the scene put in; empty when it is absent.
  std::string AttributeOf(const Text& text, const pugi::xml_node& node, const char* name);
  void ReadInto(const Text& text, const pugi::xml_node& node, int depth, MitsubaObject& object);
  void ReadObject(const Text& text, const pugi::xml_node& node, int depth, MitsubaObject& parent);
  void ReadValue(const Text& text, const pugi::xml_node& node, MitsubaObject& object);
  bool ReadSpectrum(const std::string& value, Parameter& parameter);
  Transform ReadTransform(const Text& text, const pugi::xml_node& node);
  StatusOr<Transform> ReadStep(const Text& text, const pugi::xml_node& node);
  // x, y and z of their own, or all in "value".
  std::array<double, 3> ReadTriple(const Text& text, const pugi::xml_node& node, double otherwise);
  double ReadNumber(const Text& text, const pugi::xml_node& node, const char* name,
                    double otherwise);
  void Include(const Text& text, const pugi::xml_node& node);
  void Error(const Text& text, const pugi::xml_node& node, std::string_view message) {
    diagnostics_.Error(text.LocationOf(node), Concat("<", node.name(), ">: ", message));
  }

  AssetReader& assets_;
  Diagnostics& diagnostics_;
  MitsubaDocument& document_;
  std::map<std::string, std::string> defaults_;
  std::vector<std::string> open_texts_;
  std::uint64_t texts_read_ = 0;
};

std::string DocumentReader::AttributeOf(const Text& text, const pugi::xml_node& node,
                                        const char* name) {
  std::string value = node.attribute(name).value();
  for (std::size_t at = value.find('$'); at != std::string::npos; at = value.find('$', at)) {
    std::size_t end = at + 1;
    while (end < value.size() &&
           (absl::ascii_isalnum(static_cast<unsigned char>(value[end])) || value[end] == '_')) {
      ++end;
    }
    const std::string variable = value.substr(at + 1, end - at - 1);
    const auto found = defaults_.find(variable);
    if (found == defaults_.end()) {
      Error(text, node,
            Concat("there is no value of ", Quoted("$" + variable),
                   "; give one by <default name=... value=.../> before it"));
      return "";
    }
    value.replace(at, end - at, found->second);
    at += found->second.size();
  }
  return value;
}

double DocumentReader::ReadNumber(const Text& text, const pugi::xml_node& node, const char* name,
                                  double otherwise) {
  if (node.attribute(name).empty()) return otherwise;
  const auto numbers = NumbersOf(AttributeOf(text, node, name));
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
  const auto numbers = NumbersOf(AttributeOf(text, node, "value"));
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
    return Transform::Rotate(ReadNumber(text, node, "angle", 0), axis[0], axis[1], axis[2]);
  }
  if (kind == "lookat" || kind == "lookAt") {
    const auto triple = [&](const char* name, const std::array<double, 3>& otherwise) {
      if (node.attribute(name).empty()) return otherwise;
      const auto numbers = NumbersOf(AttributeOf(text, node, name));
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
    const auto numbers = NumbersOf(AttributeOf(text, node, "value"));
    std::array<std::array<double, 4>, 4> rows = {
        {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
    if (!numbers.has_value() || (numbers->size() != 9 && numbers->size() != 16))
      return absl::InvalidArgumentError("\"value\" must be 16 numbers, or 9, row by row");
    const std::size_t side = numbers->size() == 9 ? 3 : 4;
    for (std::size_t i = 0; i < numbers->size(); ++i)
      rows[i / side][i % side] = (*numbers)[i];
    if (rows[3] != std::array<double, 4>{0, 0, 0, 1}) {
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

// One value at all wavelengths, or pairs "wavelength:value".
bool DocumentReader::ReadSpectrum(const std::string& value, Parameter& parameter) {
  const std::size_t pairs = static_cast<std::size_t>(std::ranges::count(value, ':'));
  std::string list = value;
  std::ranges::replace(list, ':', ' ');
  const auto numbers = NumbersOf(list);
  if (!numbers.has_value()) return false;
  if (pairs == 0 && numbers->size() == 1) {
    parameter.type = "rgb";
    parameter.numbers.assign(3, numbers->front());
    return true;
  }
  parameter.type = "spectrum";
  parameter.numbers = *numbers;
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
    const auto numbers = NumbersOf(value);
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
      numbers = NumbersOf(value);
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
    } else if (!ReadSpectrum(value, parameter)) {
      return wrong("one number, or pairs \"wavelength:value\"");
    }
  } else {
    parameter.type = "blackbody";
    parameter.numbers.push_back(ReadNumber(text, node, "temperature", 6500));
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
  object.type = AttributeOf(text, node, "type");
  object.id = AttributeOf(text, node, "id");
  object.name = WithUnderscores(AttributeOf(text, node, "name"));
  object.location = text.LocationOf(node);
  if (object.tag == "ref") {
    if (object.id.empty()) Error(text, node, "needs the id of what it refers to");
    return;
  }
  if (object.type.empty()) Error(text, node, "needs a type");
  ReadInto(text, node, depth, object);
}

void DocumentReader::Include(const Text& text, const pugi::xml_node& node) {
  const std::string path = AttributeOf(text, node, "filename");
  const SceneLimits& limits = assets_.limits();
  if (std::ranges::find(open_texts_, path) != open_texts_.end()) {
    Error(text, node, Concat("the file ", Quoted(path), " includes itself"));
  } else if (static_cast<int>(open_texts_.size()) >= limits.max_include_depth ||
             ++texts_read_ > limits.max_files) {
    Error(text, node, "too many files are included");
  } else if (const StatusOr<std::string> included = assets_.ReadText(path); included.ok()) {
    ReadText(path, *included);
  } else {
    Error(text, node, std::string(included.status().message()));
  }
}

void DocumentReader::ReadInto(const Text& text, const pugi::xml_node& node, int depth,
                              MitsubaObject& object) {
  for (const pugi::xml_node& child : node.children()) {
    if (child.type() != pugi::node_element) continue;
    const std::string_view tag = child.name();
    if (IsIn(kObjectTags, tag)) {
      ReadObject(text, child, depth + 1, object);
    } else if (IsIn(kValueTags, tag)) {
      ReadValue(text, child, object);
    } else if (tag == "default" && depth == 0) {
      // What is given first counts.
      defaults_.emplace(child.attribute("name").value(), AttributeOf(text, child, "value"));
    } else if (tag == "include" && depth == 0) {
      Include(text, child);
    } else {
      std::vector<std::string_view> known(kObjectTags.begin(), kObjectTags.end());
      known.insert(known.end(), kValueTags.begin(), kValueTags.end());
      const std::string_view closest = ClosestOf(tag, known);
      Error(text, child,
            closest.empty() ? "is not supported"
                            : Concat("is unknown; did you mean <", closest, ">?"));
    }
  }
}

void DocumentReader::ReadText(const std::string& path, std::string_view bytes) {
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
  if (std::string_view(root.name()) != "scene") {
    diagnostics_.Error({text.name, 0, 0},
                       Concat("a Mitsuba scene begins with <scene>, not with <", root.name(), ">"));
    return;
  }
  if (open_texts_.empty()) {
    document_.scene.tag = "scene";
    document_.scene.location = text.LocationOf(root);
    document_.is_old = std::string_view(root.attribute("version").value()).starts_with("0.");
  }
  open_texts_.push_back(path);
  ReadInto(text, root, 0, document_.scene);
  open_texts_.pop_back();
}

void AddIds(const MitsubaObject& object, Diagnostics& diagnostics,
            std::map<std::string, const MitsubaObject*>& objects) {
  if (object.tag == "ref") return;
  if (!object.id.empty() && !objects.emplace(object.id, &object).second) {
    diagnostics.Error(object.location, Concat("the id ", Quoted(object.id), " is given twice"));
  }
  for (const MitsubaObject& child : object.children)
    AddIds(child, diagnostics, objects);
}

}  // namespace

void ReadMitsubaDocument(const std::string& main_path, std::string_view text, AssetReader& assets,
                         Diagnostics& diagnostics, MitsubaDocument& document) {
  DocumentReader(assets, diagnostics, document).ReadText(main_path, text);
  AddIds(document.scene, diagnostics, document.objects);
}

}  // namespace lucerna
