// Reads a scene that is seen from elsewhere, or under another sky, than its own file says.
//
// A JSON object:
//
//   {
//     "scene": "room.glb",                        a logical path, of any format but this one
//     "up": [0, 1, 0],                            of the camera and the environment; the default
//     "camera": {"from": [0, 1.6, 4],             takes the place of the scene's own: perspective,
//                "to": [0, 1, 0], "fov": 40},     fov [degrees] is that of the image's shorter side
//     "environment": {"image": "sky.hdr",         takes the place of the scene's infinite lights:
//                     "scale": 1, "turn": 0}      a picture in latitude and longitude, or
//   }                                             "color": [1, 1, 1] in its place
//
// Camera and environment may be left away. The middle of the picture is seen along -z when y is up,
// along +y when z is; `turn` [degrees] turns it counter-clockwise, seen from above. Images are not
// mirrored: where the scene's own camera mirrors, as right-handed worlds need it, so does this one.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "render/formats/asset_reader.h"
#include "render/formats/diagnostic.h"
#include "render/formats/finish_scene.h"

namespace lucerna {

// What such a file says; absent: as the scene has it.
struct SceneView {
  std::optional<std::array<double, 3>> up;
  std::optional<std::array<double, 3>> from, to;  // both or none
  std::optional<double> fov_deg;
  std::string environment;  // path of a picture; empty: none
  std::optional<double> scale;
  std::optional<double> turn_deg;

  [[nodiscard]] bool IsEmpty() const { return *this == SceneView(); }
  bool operator==(const SceneView&) const = default;
};

inline constexpr std::string_view kViewExtension = ".view.json";

// Whether a text begins as such files do.
[[nodiscard]] bool BeginsAsView(std::string_view text);

// Reads the main file, whose text is given, and the scene that it names.
[[nodiscard]] UnfinishedScene ReadView(const std::string& main_path, std::string_view text,
                                       AssetReader& assets, Diagnostics& diagnostics);

// The bytes of such a file.
[[nodiscard]] std::string ViewFile(const std::string& scene_path, const SceneView& view);

}  // namespace lucerna
