// Reads a scene whose irradiance is measured at points of its surfaces.
//
// A PLY file with positions and unit normals, and comments in its header:
//
//   comment lucerna scene FILE      the scene, a logical path; its camera and film do not count
//   comment lucerna spacing NUMBER  about the distance between neighbouring points [scene units],
//                                   which takes the place of a pixel's width; each point may have a
//                                   property `spacing` of its own instead
//
// Segments, an element `segment` with the properties ax ay az bx by bz, are borders at which discs
// of photons are cut. Triangles, an element `bucket` with the properties ax ay az bx by bz cx cy cz
// ox oy oz r, as many as there are points: the direct light of a point is the mean over its
// triangle, or over the part of a ball with this centre and radius that lies over it (r 0: flat).
//
// The image of such a scene has a pixel for each point, row by row, in about as many rows as
// columns.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "render/formats/asset_reader.h"
#include "render/formats/diagnostic.h"
#include "render/formats/finish_scene.h"
#include "render/math/vector.h"
#include "render/scene/scene.h"

namespace lucerna {

// Whether a text begins as PLY files do.
[[nodiscard]] bool BeginsAsSensors(std::string_view text);

// Reads the main file, whose text is given, and the scene that it names.
[[nodiscard]] UnfinishedScene ReadSensors(const std::string& main_path, std::string_view text,
                                          AssetReader& assets, Diagnostics& diagnostics);

// Sensors, and what may come with them.
struct SensorSet {
  std::vector<Sensor> sensors;
  std::vector<SensorBucket> buckets;  // [sensors] or empty
  std::vector<std::array<Vec3, 2>> borders;
};

// The bytes of such a file. Requires spacings above 0.
[[nodiscard]] std::string SensorsFile(const std::string& scene_path, const SensorSet& set);

}  // namespace lucerna
