// A JSON text whose values are checked as they are read.
//
// Nothing in a text is trusted. It is parsed within limits of depth and of the number of values,
// and every member is read through JsonObject, which reports what has the wrong type or lies out of
// range and then returns the default, so that readers go on and find all errors.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "render/formats/diagnostic.h"

namespace lucerna {

// Bounds of a number, inclusive.
struct JsonRange {
  double low = 0, high = 0;
};
inline constexpr JsonRange kJsonFactor = {0, 1};
inline constexpr JsonRange kJsonAnyNumber = {-1e30, 1e30};
inline constexpr JsonRange kJsonZeroOrMore = {0, 1e30};

class JsonDocument;

// One JSON object of the document, or what stands for one that is not there, in which every member
// has its default, as one that is null has. Points into the document.
class JsonObject {
 public:
  JsonObject(const JsonDocument& document, const nlohmann::json* value, std::string place)
      : document_(&document), value_(value), place_(std::move(place)) {}

  [[nodiscard]] bool exists() const { return value_ != nullptr; }
  [[nodiscard]] bool Has(const char* name) const { return Find(name) != nullptr; }
  // What messages call it: materials[3].pbrMetallicRoughness.
  [[nodiscard]] const std::string& place() const { return place_; }
  // That, with the name that the file gives it.
  [[nodiscard]] std::string Name() const;

  [[nodiscard]] JsonObject Child(const char* name) const;
  // The entries of an array of objects.
  [[nodiscard]] std::vector<JsonObject> Children(const char* name) const;

  // A number within the range; one outside is an error.
  [[nodiscard]] double Number(const char* name, double otherwise, const JsonRange& range) const;
  // The same, but a number outside is held in the range, with a warning.
  [[nodiscard]] double Held(const char* name, double otherwise, const JsonRange& range) const;
  // `count` numbers, of the default's count, each as by Number or by Held.
  [[nodiscard]] std::vector<double> Numbers(const char* name, std::vector<double> otherwise,
                                            const JsonRange& range) const;
  [[nodiscard]] std::vector<double> HeldNumbers(const char* name, std::vector<double> otherwise,
                                                const JsonRange& range) const;
  // As many numbers as there are, each as by Number; none where the member is not there.
  [[nodiscard]] std::vector<double> NumberList(const char* name, const JsonRange& range) const;
  // A whole number from 0 to 2^53.
  [[nodiscard]] std::optional<std::uint64_t> Whole(const char* name) const;
  // The index of an entry of a top-level array, in range.
  [[nodiscard]] std::optional<std::size_t> Index(const char* name, const char* array) const;
  [[nodiscard]] std::vector<std::size_t> Indices(const char* name, const char* array) const;
  [[nodiscard]] std::string String(const char* name, std::string_view otherwise) const;
  [[nodiscard]] std::vector<std::string> Strings(const char* name) const;
  [[nodiscard]] bool Bool(const char* name, bool otherwise) const;
  // An error for each member that is none of `names`.
  void RefuseOthers(std::initializer_list<std::string_view> names) const;

  // Messages that begin with the place. An error that is the same as an earlier one is dropped:
  // some members are read for several purposes.
  void Error(std::string_view text) const;
  void Warning(std::string_view text) const;

  [[nodiscard]] const JsonDocument& document() const { return *document_; }

 private:
  [[nodiscard]] const nlohmann::json* Find(const char* name) const;
  [[nodiscard]] std::string PlaceOf(const char* name) const;
  [[nodiscard]] std::vector<double> ReadNumbers(const char* name, std::vector<double> otherwise,
                                                const JsonRange& range, bool is_held) const;
  // The number in the range, or nullopt after an error.
  [[nodiscard]] std::optional<double> Checked(const nlohmann::json& value, const std::string& place,
                                              const JsonRange& range, bool is_held) const;

  const JsonDocument* document_;
  const nlohmann::json* value_;
  std::string place_;
};

class JsonDocument {
 public:
  // The path and the diagnostics outlive the document. There is no value before Parse.
  JsonDocument(const std::string& path, Diagnostics& diagnostics)
      : whole_{&path, 0, 0}, diagnostics_(diagnostics) {}

  // Errors, also of a text that is no object or has more values, are in the diagnostics.
  void Parse(std::string_view text, std::size_t most_values);

  [[nodiscard]] JsonObject Root() const { return {*this, &root_, ""}; }
  // Of a top-level array; 0 when it is not there.
  [[nodiscard]] std::size_t Count(const char* array) const;
  // Of a top-level array of objects. Requires index < Count(array).
  [[nodiscard]] JsonObject At(const char* array, std::size_t index) const;
  // An error where there is a top-level value of this name that is none.
  void CheckArrayOfObjects(const char* name) const;
  // An error about the document, unless it had the same one before.
  void ErrorOnce(std::string text) const;

  [[nodiscard]] const SourceLocation& whole() const { return whole_; }
  [[nodiscard]] Diagnostics& diagnostics() const { return diagnostics_; }

 private:
  SourceLocation whole_;
  Diagnostics& diagnostics_;
  nlohmann::json root_ = nlohmann::json::object();
  mutable std::set<std::string> errors_;
};

}  // namespace lucerna
