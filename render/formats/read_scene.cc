#include "render/formats/read_scene.h"

#include <algorithm>
#include <array>
#include <new>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "render/base/text.h"
#include "render/formats/asset_reader.h"
#include "render/formats/finish_scene.h"
#include "render/formats/gltf/gltf_reader.h"
#include "render/formats/mitsuba/mitsuba_reader.h"
#include "render/formats/pbrt/pbrt_reader.h"
#include "render/formats/sensors/sensors_reader.h"
#include "render/formats/view/view_reader.h"

namespace lucerna {
namespace {

// A format that scenes may have. To add one is to write its two functions and its row.
struct SceneFormat {
  std::string_view name;
  std::string_view extension;
  SceneLayer layer;
  // Whether a text begins as those of the format do.
  bool (*is_begun_by)(std::string_view text);
  // Reads a main file, whose text is given, and what it includes. `main_path` outlives the
  // diagnostics.
  UnfinishedScene (*read)(const std::string& main_path, std::string_view text, AssetReader& assets,
                          Diagnostics& diagnostics);
};

constexpr std::array kFormats = {
    SceneFormat{"pbrt-v4", ".pbrt", SceneLayer::kWhole, &BeginsAsPbrt, &ReadPbrt},
    SceneFormat{"glTF 2.0", ".gltf", SceneLayer::kWhole, &BeginsAsGltf, &ReadGltf},
    SceneFormat{"binary glTF 2.0", ".glb", SceneLayer::kWhole, &BeginsAsGltf, &ReadGltf},
    SceneFormat{"Mitsuba", ".xml", SceneLayer::kWhole, &BeginsAsMitsuba, &ReadMitsuba},
    SceneFormat{"a view of a scene", kViewExtension, SceneLayer::kView, &BeginsAsView, &ReadView},
    SceneFormat{"points to measure irradiance at", ".ply", SceneLayer::kSensors, &BeginsAsSensors,
                &ReadSensors},
};

const SceneFormat* FormatOf(std::string_view path, std::string_view text) {
  for (const SceneFormat& format : kFormats) {
    if (path.ends_with(format.extension)) return &format;
  }
  for (const SceneFormat& format : kFormats) {
    if (format.is_begun_by(text)) return &format;
  }
  return nullptr;
}

std::string NamesOfFormats() {
  std::vector<std::string> names;
  names.reserve(std::size(kFormats));
  for (const SceneFormat& format : kFormats)
    names.push_back(Concat(format.name, " (", format.extension, ")"));
  return Concat(names.size() == 1 ? "there is " : "there are ", Listed(names));
}

}  // namespace

UnfinishedScene ReadUnfinishedScene(const std::string& main_path, SceneLayer highest,
                                    AssetReader& assets, Diagnostics& diagnostics) {
  const SourceLocation whole = {&main_path, 0, 0};
  const StatusOr<std::string> text = assets.ReadText(main_path);
  if (!text.ok()) {
    diagnostics.Error(whole, std::string(text.status().message()));
    return {};
  }
  const SceneFormat* format = FormatOf(main_path, *text);
  if (format == nullptr) {
    diagnostics.Error(whole,
                      Concat("this is no scene in a format that is read here; ", NamesOfFormats()));
    return {};
  }
  if (format->layer > highest) {
    diagnostics.Error(whole, Concat("this is ", format->name,
                                    ", which another file cannot name as its scene; name one in "
                                    "another format"));
    return {};
  }
  return format->read(main_path, *text, assets, diagnostics);
}

ParsedScene ReadScene(SceneFiles& files, const std::string& main_path, const SceneLimits& limits,
                      std::size_t max_of_each) {
  try {
    Diagnostics diagnostics(max_of_each);
    AssetReader assets(files, limits);
    Scene scene =
        FinishScene(ReadUnfinishedScene(main_path, SceneLayer::kSensors, assets, diagnostics),
                    main_path, diagnostics);
    return {std::move(scene), diagnostics.Take()};
  } catch (const std::bad_alloc&) {
    // What had been read is freed by now.
  } catch (const std::length_error&) {
    // The same: more elements than a vector can have.
  }
  Diagnostics out_of_memory;
  out_of_memory.Error({&main_path, 0, 0},
                      "the scene takes more memory than there is; repeat meshes and files less "
                      "often, or give fewer triangles and smaller images");
  return {Scene(), out_of_memory.Take()};
}

}  // namespace lucerna
