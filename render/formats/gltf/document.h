// A glTF 2.0 document: its container (.gltf or .glb), its JSON, and checked access to the objects
// in it (formats/json_document.h).
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "render/formats/diagnostic.h"
#include "render/formats/json_document.h"

namespace lucerna {

// One of an object's extensions, which may not be there.
[[nodiscard]] inline JsonObject ExtensionOf(const JsonObject& object, const char* name) {
  return object.Child("extensions").Child(name);
}

class GltfDocument : public JsonDocument {
 public:
  // `bytes` of the main file and the diagnostics outlive the document; errors are in the
  // diagnostics.
  GltfDocument(const std::string& main_path, std::string_view bytes, Diagnostics& diagnostics);

  // Whether there is a JSON object of a version that is read here.
  [[nodiscard]] bool is_readable() const { return is_readable_; }
  // The second chunk of a .glb.
  [[nodiscard]] std::optional<std::string_view> binary_chunk() const { return binary_chunk_; }

 private:
  // The text of the JSON, or nullopt after an error.
  [[nodiscard]] std::optional<std::string_view> OpenContainer(std::string_view bytes);
  void CheckVersion();
  void CheckArrays();

  std::optional<std::string_view> binary_chunk_;
  bool is_readable_ = false;
};

}  // namespace lucerna
