// How is an image made that others are measured by?
//
// Two independent halves are rendered one after the other on a cluster of its
// own and averaged (render/film/reference.h), so that the noise of the result is known and can be
// taken off errors. The bias is not known, so it is made small against the noise.
//
// Smooth light: over N passes at alpha 2/3 variance falls as 1/(r² N^(2/3)) and squared bias as
// r⁴/N^(2/3), where r is the first radius. Both fall at the same rate, so r alone decides which of
// them the image has, however long it takes. Edges of light are worse: their squared bias falls as
// the radius itself, r/N^(1/6), and in the end is all that is left. Hence half a pixel, a sixth of
// the automatic radius: 36 times the variance, which more time mends and which is known, for a
// sixth of the bias at edges and a thousandth elsewhere (docs/measurements/references.md). The
// controller is pppm: every pixel's radius vanishes, also where few photons come, and does not
// depend on the photons that it is used with.
#pragma once

#include <cstdint>
#include <string>

#include "client/commands/job_commands.h"
#include "client/local_cluster.h"
#include "render/base/status.h"
#include "render/scene/render_settings.h"

namespace lucerna {

// Where no others are given. Radii begin at so many widths of a pixel also where the scene names a
// radius, which is one for its own time.
inline constexpr RadiusControllerKind kReferenceController = RadiusControllerKind::kPppm;
inline constexpr double kReferenceFootprints = 0.5;
// Eye paths cost about as much as one photon a pixel; with more photons less of the time goes
// there. With too many, passes are few, and it is passes by which radii shrink.
inline constexpr std::int64_t kReferencePhotonsPerPixel = 4;

struct ReferenceRequest {
  std::string scene_path;
  // What is not given is chosen for little bias. passes and time_s are those of both halves
  // together; one of them is needed.
  RenderOverrides overrides;
  std::string output_path;
  bool keeps_checkpoints = true;  // beside the output, until it is written
  bool resumes = false;           // goes on from there
};

// Writes the reference whole or not at all. An interrupted one goes on to the same bits.
[[nodiscard]] Status RenderReference(const ReferenceRequest& request, const ClusterOptions& cluster,
                                     const OutputOptions& output_options);

}  // namespace lucerna
