// Reads glTF 2.0, as text (.gltf) with the files that it names, or in one file (.glb).
//
// What becomes what, and what is left out: docs/manual.md. Lengths are metres, world space is the
// file's (right-handed, y up).
#pragma once

#include <string>
#include <string_view>

#include "render/formats/asset_reader.h"
#include "render/formats/diagnostic.h"
#include "render/formats/finish_scene.h"

namespace lucerna {

// Whether the bytes are those of a .glb, or a JSON object with an "asset".
[[nodiscard]] bool BeginsAsGltf(std::string_view text);

// Reads the main file, whose bytes are given, and what it names. Its errors are all in
// `diagnostics`; after one the scene is not meaningful.
[[nodiscard]] UnfinishedScene ReadGltf(const std::string& main_path, std::string_view bytes,
                                       AssetReader& assets, Diagnostics& diagnostics);

}  // namespace lucerna
