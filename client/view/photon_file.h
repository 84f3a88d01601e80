// Photons as files that programs for geometry show: where they landed, and the ways they took.
#pragma once

#include <string>
#include <string_view>

#include "proto/lucerna/v1/photons.pb.h"
#include "render/base/status.h"

namespace lucerna {

enum class PhotonFileFormat : unsigned char {
  kPly,  // a point for each landing that left a deposit
  kObj,  // a line for each photon that was emitted, from its light over all landings
};
// By the ending of the name. Errors: Failure(kUsage) for another ending.
[[nodiscard]] StatusOr<PhotonFileFormat> PhotonFileFormatOf(std::string_view path);

// PLY: binary, little-endian; x y z, the colour of the flux (its largest channel is 255), the flux
// in watts of all photons of the pass together, the photon's index and the number of the landing,
// from 1. OBJ: text; a group for each photon, named by its key. Lengths are those of the scene's
// file.
[[nodiscard]] std::string PhotonFile(const v1::PhotonPaths& paths, PhotonFileFormat format);

}  // namespace lucerna
