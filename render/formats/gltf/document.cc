#include "render/formats/gltf/document.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "render/base/text.h"

namespace lucerna {
namespace {

using Json = nlohmann::json;

// Of objects and arrays in one another. Readers of members go three or four deep.
constexpr int kMaxDepth = 64;
// A value takes up to 100 bytes in memory and two in the text.
constexpr std::size_t kMaxValues = std::size_t{1} << 22;

constexpr std::string_view kMagic = "glTF";
constexpr std::size_t kHeaderBytes = 12;
constexpr std::size_t kChunkHeaderBytes = 8;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinaryChunk = 0x004E4942;

// The top-level arrays whose entries are objects.
constexpr std::array kArrays = {"accessors", "buffers",   "bufferViews", "cameras",
                                "images",    "materials", "meshes",      "nodes",
                                "samplers",  "scenes",    "textures"};

std::uint32_t WordAt(std::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof(word));
  return word;
}

}  // namespace

// ---- GltfObject

std::string GltfObject::Name() const {
  const Json* name = Find("name");
  if (name == nullptr || !name->is_string()) return place_;
  return Concat(place_, " ", Quoted(name->get_ref<const std::string&>()));
}

const Json* GltfObject::Find(const char* name) const {
  if (value_ == nullptr) return nullptr;
  const auto member = value_->find(name);
  return member == value_->end() ? nullptr : &*member;
}

std::string GltfObject::PlaceOf(const char* name) const {
  return place_.empty() ? name : Concat(place_, ".", name);
}

void GltfObject::Error(std::string_view text) const {
  document_->diagnostics().Error(document_->whole(),
                                 place_.empty() ? std::string(text) : Concat(Name(), ": ", text));
}

void GltfObject::Warning(std::string_view text) const {
  document_->diagnostics().Warning(document_->whole(),
                                   place_.empty() ? std::string(text) : Concat(Name(), ": ", text));
}

GltfObject GltfObject::Child(const char* name) const {
  const Json* member = Find(name);
  if (member != nullptr && !member->is_object()) {
    Error(Concat(name, " must be an object"));
    member = nullptr;
  }
  return {*document_, member, PlaceOf(name)};
}

GltfObject GltfObject::Extension(const char* name) const {
  return Child("extensions").Child(name);
}

std::vector<GltfObject> GltfObject::Children(const char* name) const {
  std::vector<GltfObject> children;
  const Json* member = Find(name);
  if (member == nullptr) return children;
  if (!member->is_array()) {
    Error(Concat(name, " must be an array"));
    return children;
  }
  children.reserve(member->size());
  for (std::size_t i = 0; i < member->size(); ++i) {
    const Json& entry = (*member)[i];
    if (!entry.is_object()) {
      Error(Concat(name, "[", i, "] must be an object"));
      return {};
    }
    children.emplace_back(*document_, &entry, Concat(PlaceOf(name), "[", i, "]"));
  }
  return children;
}

std::optional<double> GltfObject::Checked(const Json& value, const std::string& place,
                                          const GltfRange& range, bool is_held) const {
  if (!value.is_number()) {
    Error(Concat(place, " must be a number"));
    return std::nullopt;
  }
  const auto number = value.get<double>();
  if (number >= range.low && number <= range.high) return number;
  const std::string says =
      Concat(place, " is ", number, ", outside ", range.low, " to ", range.high);
  if (!is_held) {
    Error(says);
    return std::nullopt;
  }
  Warning(Concat(says, ", and is held there"));
  return std::clamp(number, range.low, range.high);
}

double GltfObject::Number(const char* name, double otherwise, const GltfRange& range) const {
  const Json* member = Find(name);
  return member == nullptr ? otherwise : Checked(*member, name, range, false).value_or(otherwise);
}

double GltfObject::Held(const char* name, double otherwise, const GltfRange& range) const {
  const Json* member = Find(name);
  return member == nullptr ? otherwise : Checked(*member, name, range, true).value_or(otherwise);
}

std::vector<double> GltfObject::ReadNumbers(const char* name, std::vector<double> otherwise,
                                            const GltfRange& range, bool is_held) const {
  const Json* member = Find(name);
  if (member == nullptr) return otherwise;
  if (!member->is_array() || member->size() != otherwise.size()) {
    Error(Concat(name, " must be an array of ", otherwise.size(), " numbers"));
    return otherwise;
  }
  std::vector<double> numbers;
  for (std::size_t i = 0; i < member->size(); ++i) {
    const std::optional<double> number =
        Checked((*member)[i], Concat(name, "[", i, "]"), range, is_held);
    if (!number.has_value()) return otherwise;
    numbers.push_back(*number);
  }
  return numbers;
}

std::vector<double> GltfObject::Numbers(const char* name, std::vector<double> otherwise,
                                        const GltfRange& range) const {
  return ReadNumbers(name, std::move(otherwise), range, false);
}

std::vector<double> GltfObject::HeldNumbers(const char* name, std::vector<double> otherwise,
                                            const GltfRange& range) const {
  return ReadNumbers(name, std::move(otherwise), range, true);
}

std::optional<std::uint64_t> GltfObject::Whole(const char* name) const {
  const Json* member = Find(name);
  if (member == nullptr) return std::nullopt;
  // Some writers give whole numbers as 3.0.
  const double number = member->is_number() ? member->get<double>() : -1;
  if (!(number >= 0 && number <= 0x1p53 && number == std::floor(number))) {
    Error(Concat(name, " must be a whole number, 0 or more"));
    return std::nullopt;
  }
  return static_cast<std::uint64_t>(number);
}

std::optional<std::size_t> GltfObject::Index(const char* name, const char* array) const {
  const std::optional<std::uint64_t> index = Whole(name);
  if (!index.has_value()) return std::nullopt;
  const std::size_t count = document_->Count(array);
  if (*index < count) return static_cast<std::size_t>(*index);
  Error(Concat(name, " refers to ", array, "[", *index, "], and there are ", count));
  return std::nullopt;
}

std::vector<std::size_t> GltfObject::Indices(const char* name, const char* array) const {
  std::vector<std::size_t> indices;
  const Json* member = Find(name);
  if (member == nullptr) return indices;
  if (!member->is_array()) {
    Error(Concat(name, " must be an array"));
    return indices;
  }
  const std::size_t count = document_->Count(array);
  for (const Json& entry : *member) {
    if (!entry.is_number_unsigned() || entry.get<std::uint64_t>() >= count) {
      Error(Concat(name, " refers to none of the ", count, " ", array));
      return {};
    }
    indices.push_back(entry.get<std::size_t>());
  }
  return indices;
}

std::string GltfObject::String(const char* name, std::string_view otherwise) const {
  const Json* member = Find(name);
  if (member == nullptr) return std::string(otherwise);
  if (member->is_string()) return member->get<std::string>();
  Error(Concat(name, " must be a string"));
  return std::string(otherwise);
}

std::vector<std::string> GltfObject::Strings(const char* name) const {
  std::vector<std::string> strings;
  const Json* member = Find(name);
  if (member == nullptr) return strings;
  const bool are_strings =
      member->is_array() &&
      std::ranges::all_of(*member, [](const Json& entry) { return entry.is_string(); });
  if (!are_strings) {
    Error(Concat(name, " must be an array of strings"));
    return strings;
  }
  for (const Json& entry : *member)
    strings.push_back(entry.get<std::string>());
  return strings;
}

bool GltfObject::Bool(const char* name, bool otherwise) const {
  const Json* member = Find(name);
  if (member == nullptr) return otherwise;
  if (member->is_boolean()) return member->get<bool>();
  Error(Concat(name, " must be true or false"));
  return otherwise;
}

// ---- GltfDocument

GltfDocument::GltfDocument(const std::string& main_path, std::string_view bytes,
                           Diagnostics& diagnostics)
    : whole_{&main_path, 0, 0}, diagnostics_(diagnostics) {
  const std::optional<std::string_view> text = OpenContainer(bytes);
  if (!text.has_value()) return;
  Parse(*text);
  if (diagnostics.has_error()) return;
  CheckVersion();
  CheckArrays();
  is_readable_ = !diagnostics.has_error();
}

std::optional<std::string_view> GltfDocument::OpenContainer(std::string_view bytes) {
  if (!bytes.starts_with(kMagic)) return bytes;
  const auto refuse = [&](std::string_view what) {
    diagnostics_.Error(whole_, Concat("this is no usable .glb file: ", what));
    return std::nullopt;
  };
  if (bytes.size() < kHeaderBytes + kChunkHeaderBytes) return refuse("it is cut off");
  if (WordAt(bytes, 4) != 2) return refuse(Concat("its version is ", WordAt(bytes, 4), ", not 2"));
  if (WordAt(bytes, 8) > bytes.size()) return refuse("it is cut off");
  bytes = bytes.substr(0, std::max<std::size_t>(WordAt(bytes, 8), kHeaderBytes));
  std::optional<std::string_view> text;
  for (std::size_t at = kHeaderBytes; at < bytes.size();) {
    if (bytes.size() - at < kChunkHeaderBytes) return refuse("its last chunk is cut off");
    const std::size_t size = WordAt(bytes, at);
    const std::uint32_t type = WordAt(bytes, at + 4);
    at += kChunkHeaderBytes;
    if (size > bytes.size() - at) return refuse("one of its chunks is cut off");
    const std::string_view chunk = bytes.substr(at, size);
    if (!text.has_value()) {
      if (type != kJsonChunk) return refuse("its first chunk is not JSON");
      text = chunk;
    } else if (type == kBinaryChunk && !binary_chunk_.has_value()) {
      binary_chunk_ = chunk;
    }
    at += size;
  }
  if (!text.has_value()) return refuse("it has no chunks");
  return text;
}

void GltfDocument::Parse(std::string_view text) {
  std::size_t values = 0;
  bool is_too_deep = false;
  // Once a limit is passed nothing more is kept.
  const Json::parser_callback_t within_limits = [&](int depth, Json::parse_event_t event,
                                                    Json& /*parsed*/) {
    const bool is_end =
        event == Json::parse_event_t::object_end || event == Json::parse_event_t::array_end;
    if (!is_end) ++values;
    is_too_deep = is_too_deep || depth > kMaxDepth;
    return !is_too_deep && values <= kMaxValues;
  };
  try {
    root_ = Json::parse(text, within_limits);
  } catch (const Json::parse_error& error) {
    const std::size_t at = std::min(text.size(), error.byte > 0 ? error.byte - 1 : 0);
    const std::string_view before = text.substr(0, at);
    const std::size_t line_start = before.rfind('\n') + 1;  // npos + 1 = 0
    SourceLocation location = whole_;
    location.line = static_cast<int>(std::ranges::count(before, '\n')) + 1;
    location.column = static_cast<int>(at - line_start) + 1;
    diagnostics_.Error(location, "the JSON is damaged here");
    return;
  } catch (const Json::exception&) {
    diagnostics_.Error(whole_, "the JSON has a number that is too large");
    return;
  }
  if (is_too_deep) {
    diagnostics_.Error(whole_, Concat("the JSON is nested more than ", kMaxDepth, " deep"));
  } else if (values > kMaxValues) {
    diagnostics_.Error(whole_, Concat("the JSON has more than ", kMaxValues,
                                      " values; put large arrays into a buffer"));
  } else if (!root_.is_object()) {
    diagnostics_.Error(whole_, "the JSON is no object, as that of a glTF file is");
  }
}

void GltfDocument::CheckVersion() {
  const GltfObject asset = Root().Child("asset");
  if (!asset.exists()) {
    diagnostics_.Error(whole_, "this is no glTF 2.0: it has no \"asset\" with a \"version\"");
    return;
  }
  // A file that is written for a later 2.x says in minVersion whether it needs that.
  const std::string version = asset.String("minVersion", asset.String("version", ""));
  const bool is_read = asset.Has("minVersion") ? version == "2.0" : version.starts_with("2.");
  if (is_read) return;
  asset.Error(Concat("the version is ", Quoted(version),
                     "; only 2.0 is read, to which newer exporters and converters write"));
}

void GltfDocument::CheckArrays() {
  for (const char* array : kArrays) {
    const auto member = root_.find(array);
    if (member == root_.end()) continue;
    const bool are_objects =
        member->is_array() &&
        std::ranges::all_of(*member, [](const Json& entry) { return entry.is_object(); });
    if (!are_objects) diagnostics_.Error(whole_, Concat(array, " must be an array of objects"));
  }
}

std::size_t GltfDocument::Count(const char* array) const {
  const auto member = root_.find(array);
  return member == root_.end() ? 0 : member->size();
}

GltfObject GltfDocument::At(const char* array, std::size_t index) const {
  return {*this, &(*root_.find(array))[index], Concat(array, "[", index, "]")};
}

}  // namespace lucerna
