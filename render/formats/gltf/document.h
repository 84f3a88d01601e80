// A glTF 2.0 document: its container (.gltf or .glb), its JSON, and checked access to the objects
// in it.
//
// Nothing in a document is trusted. The JSON is parsed within limits of depth and of the number of
// values, and every member is read through GltfObject, which reports what has the wrong type or
// lies out of range and then returns the default, so that readers go on and find all errors.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "render/formats/diagnostic.h"

namespace lucerna {

// Bounds of a number, inclusive.
struct GltfRange {
  double low = 0, high = 0;
};
inline constexpr GltfRange kGltfFactor = {0, 1};
inline constexpr GltfRange kGltfAnyNumber = {-1e30, 1e30};
inline constexpr GltfRange kGltfZeroOrMore = {0, 1e30};

class GltfDocument;

// One JSON object of the document, or what stands for one that is not there, in which every member
// has its default. Points into the document.
class GltfObject {
 public:
  GltfObject(const GltfDocument& document, const nlohmann::json* value, std::string place)
      : document_(&document), value_(value), place_(std::move(place)) {}

  [[nodiscard]] bool exists() const { return value_ != nullptr; }
  [[nodiscard]] bool Has(const char* name) const { return Find(name) != nullptr; }
  // What messages call it: materials[3].pbrMetallicRoughness.
  [[nodiscard]] const std::string& place() const { return place_; }
  // That, with the name that the file gives it.
  [[nodiscard]] std::string Name() const;

  [[nodiscard]] GltfObject Child(const char* name) const;
  [[nodiscard]] GltfObject Extension(const char* name) const;
  // The entries of an array of objects.
  [[nodiscard]] std::vector<GltfObject> Children(const char* name) const;

  // A number within the range; one outside is an error.
  [[nodiscard]] double Number(const char* name, double otherwise, const GltfRange& range) const;
  // The same, but a number outside is held in the range, with a warning.
  [[nodiscard]] double Held(const char* name, double otherwise, const GltfRange& range) const;
  // `count` numbers, of the default's count, each as by Number or by Held.
  [[nodiscard]] std::vector<double> Numbers(const char* name, std::vector<double> otherwise,
                                            const GltfRange& range) const;
  [[nodiscard]] std::vector<double> HeldNumbers(const char* name, std::vector<double> otherwise,
                                                const GltfRange& range) const;
  // A whole number from 0 to 2^53.
  [[nodiscard]] std::optional<std::uint64_t> Whole(const char* name) const;
  // The index of an entry of a top-level array, in range.
  [[nodiscard]] std::optional<std::size_t> Index(const char* name, const char* array) const;
  [[nodiscard]] std::vector<std::size_t> Indices(const char* name, const char* array) const;
  [[nodiscard]] std::string String(const char* name, std::string_view otherwise) const;
  [[nodiscard]] std::vector<std::string> Strings(const char* name) const;
  [[nodiscard]] bool Bool(const char* name, bool otherwise) const;

  // Messages that begin with the place.
  void Error(std::string_view text) const;
  void Warning(std::string_view text) const;

  [[nodiscard]] const GltfDocument& document() const { return *document_; }

 private:
  [[nodiscard]] const nlohmann::json* Find(const char* name) const;
  [[nodiscard]] std::string PlaceOf(const char* name) const;
  [[nodiscard]] std::vector<double> ReadNumbers(const char* name, std::vector<double> otherwise,
                                                const GltfRange& range, bool is_held) const;
  // The number in the range, or nullopt after an error.
  [[nodiscard]] std::optional<double> Checked(const nlohmann::json& value, const std::string& place,
                                              const GltfRange& range, bool is_held) const;

  const GltfDocument* document_;
  const nlohmann::json* value_;
  std::string place_;
};

class GltfDocument {
 public:
  // `bytes` of the main file and the diagnostics outlive the document; errors are in the
  // diagnostics.
  GltfDocument(const std::string& main_path, std::string_view bytes, Diagnostics& diagnostics);

  // Whether there is a JSON object of a version that is read here.
  [[nodiscard]] bool is_readable() const { return is_readable_; }
  [[nodiscard]] GltfObject Root() const { return {*this, &root_, ""}; }
  // Of a top-level array of objects; 0 when it is not there.
  [[nodiscard]] std::size_t Count(const char* array) const;
  // Requires index < Count(array).
  [[nodiscard]] GltfObject At(const char* array, std::size_t index) const;
  // The second chunk of a .glb.
  [[nodiscard]] std::optional<std::string_view> binary_chunk() const { return binary_chunk_; }

  [[nodiscard]] const SourceLocation& whole() const { return whole_; }
  [[nodiscard]] Diagnostics& diagnostics() const { return diagnostics_; }

 private:
  // The text of the JSON, or nullopt after an error.
  [[nodiscard]] std::optional<std::string_view> OpenContainer(std::string_view bytes);
  void Parse(std::string_view text);
  void CheckVersion();
  void CheckArrays();

  SourceLocation whole_;
  Diagnostics& diagnostics_;
  nlohmann::json root_;
  std::optional<std::string_view> binary_chunk_;
  bool is_readable_ = false;
};

}  // namespace lucerna
