// The objects of a Mitsuba scene, as its XML text has them.
//
// Both dialects are read: that of Mitsuba 2 and 3, whose names have underscores, and that of
// Mitsuba 0.5 and 0.6, whose names begin their words with capitals and become those of the other.
// Values become parameters of the types that pbrt texts have, so that one class checks both.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "render/formats/asset_reader.h"
#include "render/formats/diagnostic.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/math/transform.h"

namespace lucerna {

// An element that makes something, such as <bsdf type="diffuse">, or a reference to one. A
// <spectrum> with a type is a texture, as in Mitsuba.
struct MitsubaObject {
  std::string tag;  // "bsdf", "shape", "ref" and so on
  std::string type;
  std::string id;      // of a reference: of what it refers to
  std::string name;    // what it is to the object around it; may be empty
  std::string called;  // the name as the text has it
  SourceLocation location;
  std::vector<Parameter> values;
  std::map<std::string, Transform> transforms;  // by name; affine
  std::vector<MitsubaObject> children;          // in the order of the text
};

struct MitsubaDocument {
  MitsubaObject scene;
  std::array<int, 3> version = {3, 0, 0};
  // By their ids; they point into `scene`.
  std::map<std::string, const MitsubaObject*> objects;

  // In the dialect of Mitsuba 0.5 and 0.6.
  [[nodiscard]] bool is_old() const { return version[0] == 0; }

  MitsubaDocument() = default;
  MitsubaDocument(const MitsubaDocument&) = delete;  // would point into the other
  MitsubaDocument& operator=(const MitsubaDocument&) = delete;
};

// The numbers of a list that spaces and commas separate; absent when something else is in it, or a
// number that single precision cannot hold.
[[nodiscard]] std::optional<std::vector<double>> ListedNumbers(std::string_view text);

// Moves a wavelength that is the same as the one before it, where a curve has a step, up by a
// little. `pairs` of wavelength and value.
void PartEqualWavelengths(std::vector<double>& pairs);

// Reads a text and the files that it includes into `document`, which is empty. What is wrong is
// reported, and left out.
void ReadMitsubaDocument(const std::string& main_path, std::string_view text, AssetReader& assets,
                         Diagnostics& diagnostics, MitsubaDocument& document);

}  // namespace lucerna
