// Reads scenes of Mitsuba: XML, in the dialects of its versions 0.5 to 3.
//
// Objects are translated into pbrt directives that mean the same and are carried out one after the
// other, so that limits, checks and everything that materials, lights and shapes are made of are
// those of pbrt texts. What has no counterpart is an error, or a warning where it is approximated.
#pragma once

#include <string>
#include <string_view>

#include "render/formats/asset_reader.h"
#include "render/formats/diagnostic.h"
#include "render/formats/finish_scene.h"

namespace lucerna {

[[nodiscard]] bool BeginsAsMitsuba(std::string_view text);

// `main_path` outlives the diagnostics.
[[nodiscard]] UnfinishedScene ReadMitsuba(const std::string& main_path, std::string_view text,
                                          AssetReader& assets, Diagnostics& diagnostics);

}  // namespace lucerna
