// Which emissions does the image need, seen from the eye?
//
// Of photons that are sent evenly perhaps one in ten thousand comes through a window and into view:
// guides that learn from those alone (estimate/guide_learning.h) begin late. Pilot paths go the
// other way. From hitpoints of random pixels they are scattered through the scene as eye paths are,
// and at each vertex light is drawn from the lights: each connection that nothing blocks is an
// emission, with what it adds to the pixel. So importance is found as by the importons of Peter &
// Pietrek 1998, "Importance Driven Construction of Photon Maps", and light in one go. Nothing of it
// is added to the image; an error here costs noise.
//
// Left out: light that reaches the hitpoint itself without photons; hitpoints for caustic photons
// alone, and media. At a glossy hitpoint directions are drawn as at a diffuse one, and at all by
// the geometric normal.
#pragma once

#include "render/base/parallel.h"
#include "render/estimate/emission_report.h"
#include "render/tracing/eye_path.h"

namespace lucerna {

// Traces paths until they have led to enough emissions, or there are too many of them: between
// 1,024 and 16,384. The same for all numbers of threads.
[[nodiscard]] PilotReports TracePilotPaths(const EyePathTracer& tracer, const SceneNeeds& needs,
                                           ThreadTeam& team);

// Adds those of further paths to the reports of the first ones, until there are so many paths or a
// few more, or 2^16 reports. The same for all numbers of threads and for any steps on the way.
void AddPilotPaths(const EyePathTracer& tracer, const SceneNeeds& needs, std::uint64_t paths,
                   ThreadTeam& team, PilotReports& all);

}  // namespace lucerna
