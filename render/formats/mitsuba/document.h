// The objects of a Mitsuba scene, as its XML text has them.
//
// Both dialects are read: that of Mitsuba 2 and 3, whose names have underscores, and that of
// Mitsuba 0.5 and 0.6, whose names begin their words with capitals and become those of the other.
// Values become parameters of the types that pbrt texts have, so that one class checks both.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "render/formats/asset_reader.h"
#include "render/formats/diagnostic.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/math/transform.h"

namespace lucerna {

// An element that makes something, such as <bsdf type="diffuse">, or a reference to one.
struct MitsubaObject {
  std::string tag;  // "bsdf", "shape", "ref" and so on
  std::string type;
  std::string id;    // of a reference: of what it refers to
  std::string name;  // what it is to the object around it; may be empty
  SourceLocation location;
  std::vector<Parameter> values;
  std::map<std::string, Transform> transforms;  // by name; affine
  std::vector<MitsubaObject> children;          // in the order of the text
};

struct MitsubaDocument {
  MitsubaObject scene;
  bool is_old = false;  // in the dialect of Mitsuba 0.5 and 0.6
  // By their ids; they point into `scene`.
  std::map<std::string, const MitsubaObject*> objects;

  MitsubaDocument() = default;
  MitsubaDocument(const MitsubaDocument&) = delete;  // would point into the other
  MitsubaDocument& operator=(const MitsubaDocument&) = delete;
};

// Reads a text and the files that it includes into `document`, which is empty. What is wrong is
// reported, and left out.
void ReadMitsubaDocument(const std::string& main_path, std::string_view text, AssetReader& assets,
                         Diagnostics& diagnostics, MitsubaDocument& document);

}  // namespace lucerna
