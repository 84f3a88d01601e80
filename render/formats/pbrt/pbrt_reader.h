// Reads pbrt-v4 text. Defaults and units are pbrt-v4's.
#pragma once

#include <string>
#include <string_view>

#include "render/formats/asset_reader.h"
#include "render/formats/diagnostic.h"
#include "render/formats/finish_scene.h"

namespace lucerna {

// Whether the first word of a text that is not a comment is a directive.
[[nodiscard]] bool BeginsAsPbrt(std::string_view text);

// Reads the main file, whose text is given, and everything it includes. Its errors are all in
// `diagnostics`; after one the scene is not meaningful.
[[nodiscard]] UnfinishedScene ReadPbrt(const std::string& main_path, std::string_view text,
                                       AssetReader& assets, Diagnostics& diagnostics);

}  // namespace lucerna
