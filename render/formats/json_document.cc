#include "render/formats/json_document.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "render/base/text.h"

namespace lucerna {
namespace {

using Json = nlohmann::json;

// Of objects and arrays in one another. Readers of members go three or four deep.
constexpr int kMaxJsonDepth = 64;

// Some writers give whole numbers as 3.0.
std::optional<std::uint64_t> WholeOf(const Json& value) {
  const double number = value.is_number() ? value.get<double>() : -1;
  if (!(number >= 0 && number <= 0x1p53 && number == std::floor(number))) return std::nullopt;
  return static_cast<std::uint64_t>(number);
}

}  // namespace

// ---- JsonObject

std::string JsonObject::Name() const {
  const Json* name = Find("name");
  if (name == nullptr || !name->is_string()) return place_;
  return Concat(place_, " ", Quoted(name->get_ref<const std::string&>()));
}

const Json* JsonObject::Find(const char* name) const {
  if (value_ == nullptr) return nullptr;
  const auto member = value_->find(name);
  return member == value_->end() || member->is_null() ? nullptr : &*member;
}

std::string JsonObject::PlaceOf(const char* name) const {
  return place_.empty() ? name : Concat(place_, ".", name);
}

void JsonObject::Error(std::string_view text) const {
  document_->ErrorOnce(place_.empty() ? std::string(text) : Concat(Name(), ": ", text));
}

void JsonObject::Warning(std::string_view text) const {
  document_->diagnostics().Warning(document_->whole(),
                                   place_.empty() ? std::string(text) : Concat(Name(), ": ", text));
}

JsonObject JsonObject::Child(const char* name) const {
  const Json* member = Find(name);
  if (member != nullptr && !member->is_object()) {
    Error(Concat(name, " must be an object"));
    member = nullptr;
  }
  return {*document_, member, PlaceOf(name)};
}

std::vector<JsonObject> JsonObject::Children(const char* name) const {
  std::vector<JsonObject> children;
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

std::optional<double> JsonObject::Checked(const Json& value, const std::string& place,
                                          const JsonRange& range, bool is_held) const {
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

double JsonObject::Number(const char* name, double otherwise, const JsonRange& range) const {
  const Json* member = Find(name);
  return member == nullptr ? otherwise : Checked(*member, name, range, false).value_or(otherwise);
}

double JsonObject::Held(const char* name, double otherwise, const JsonRange& range) const {
  const Json* member = Find(name);
  return member == nullptr ? otherwise : Checked(*member, name, range, true).value_or(otherwise);
}

std::vector<double> JsonObject::ReadNumbers(const char* name, std::vector<double> otherwise,
                                            const JsonRange& range, bool is_held) const {
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

std::vector<double> JsonObject::Numbers(const char* name, std::vector<double> otherwise,
                                        const JsonRange& range) const {
  return ReadNumbers(name, std::move(otherwise), range, false);
}

std::vector<double> JsonObject::HeldNumbers(const char* name, std::vector<double> otherwise,
                                            const JsonRange& range) const {
  return ReadNumbers(name, std::move(otherwise), range, true);
}

std::vector<double> JsonObject::NumberList(const char* name, const JsonRange& range) const {
  const Json* member = Find(name);
  if (member == nullptr) return {};
  if (member->is_array())
    return ReadNumbers(name, std::vector<double>(member->size()), range, false);
  Error(Concat(name, " must be an array of numbers"));
  return {};
}

std::optional<std::uint64_t> JsonObject::Whole(const char* name) const {
  const Json* member = Find(name);
  if (member == nullptr) return std::nullopt;
  const std::optional<std::uint64_t> whole = WholeOf(*member);
  if (!whole.has_value()) Error(Concat(name, " must be a whole number, 0 or more"));
  return whole;
}

std::optional<std::size_t> JsonObject::Index(const char* name, const char* array) const {
  const std::optional<std::uint64_t> index = Whole(name);
  if (!index.has_value()) return std::nullopt;
  const std::size_t count = document_->Count(array);
  if (*index < count) return static_cast<std::size_t>(*index);
  Error(Concat(name, " refers to ", array, "[", *index, "], and there are ", count));
  return std::nullopt;
}

std::vector<std::size_t> JsonObject::Indices(const char* name, const char* array) const {
  std::vector<std::size_t> indices;
  const Json* member = Find(name);
  if (member == nullptr) return indices;
  if (!member->is_array()) {
    Error(Concat(name, " must be an array"));
    return indices;
  }
  const std::size_t count = document_->Count(array);
  for (const Json& entry : *member) {
    const std::optional<std::uint64_t> index = WholeOf(entry);
    if (!index.has_value() || *index >= count) {
      Error(Concat(name, " refers to none of the ", count, " ", array));
      return {};
    }
    indices.push_back(static_cast<std::size_t>(*index));
  }
  return indices;
}

std::string JsonObject::String(const char* name, std::string_view otherwise) const {
  const Json* member = Find(name);
  if (member == nullptr) return std::string(otherwise);
  if (member->is_string()) return member->get<std::string>();
  Error(Concat(name, " must be a string"));
  return std::string(otherwise);
}

std::vector<std::string> JsonObject::Strings(const char* name) const {
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

bool JsonObject::Bool(const char* name, bool otherwise) const {
  const Json* member = Find(name);
  if (member == nullptr) return otherwise;
  if (member->is_boolean()) return member->get<bool>();
  Error(Concat(name, " must be true or false"));
  return otherwise;
}

void JsonObject::RefuseOthers(std::initializer_list<std::string_view> names) const {
  if (value_ == nullptr) return;
  for (const auto& [name, value] : value_->items()) {
    if (std::ranges::find(names, name) != names.end()) continue;
    Error(Concat("has ", Quoted(name), ", which is not known; there are ", Listed(names)));
  }
}

// ---- JsonDocument

void JsonDocument::Parse(std::string_view text, std::size_t most_values) {
  if (text.empty()) {
    diagnostics_.Error(whole_, "the file is empty");
    return;
  }
  std::size_t values = 0;
  bool is_too_deep = false;
  // Once a limit is passed nothing more is kept.
  const Json::parser_callback_t within_limits = [&](int depth, Json::parse_event_t event,
                                                    Json& /*parsed*/) {
    const bool is_end =
        event == Json::parse_event_t::object_end || event == Json::parse_event_t::array_end;
    if (!is_end) ++values;
    is_too_deep = is_too_deep || depth > kMaxJsonDepth;
    return !is_too_deep && values <= most_values;
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
    diagnostics_.Error(whole_, Concat("the JSON is nested more than ", kMaxJsonDepth, " deep"));
  } else if (values > most_values) {
    diagnostics_.Error(whole_, Concat("the JSON has more than ", most_values,
                                      " values; leave out extras and animations, or join nodes"));
  } else if (!root_.is_object()) {
    diagnostics_.Error(whole_, "the JSON is no object");
  }
}

void JsonDocument::ErrorOnce(std::string text) const {
  // Once the diagnostics only count errors there is nothing to compare.
  const bool is_new =
      diagnostics_.IsFull(Diagnostic::Severity::kError) || errors_.insert(text).second;
  if (is_new) diagnostics_.Error(whole_, std::move(text));
}

void JsonDocument::CheckArrayOfObjects(const char* name) const {
  const auto member = root_.find(name);
  if (member == root_.end() || member->is_null()) return;
  const bool are_objects =
      member->is_array() &&
      std::ranges::all_of(*member, [](const Json& entry) { return entry.is_object(); });
  if (!are_objects) diagnostics_.Error(whole_, Concat(name, " must be an array of objects"));
}

std::size_t JsonDocument::Count(const char* array) const {
  const auto member = root_.find(array);
  return member == root_.end() ? 0 : member->size();
}

JsonObject JsonDocument::At(const char* array, std::size_t index) const {
  return {*this, &(*root_.find(array))[index], Concat(array, "[", index, "]")};
}

}  // namespace lucerna
