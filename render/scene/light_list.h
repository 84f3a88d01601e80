// The kinds of light that no ray finds: those without an extent (delta lights).
//
// A kind is an include and a row here and three files: its value in render/scene/light_NAME.h, how
// pbrt files give it in render/formats/pbrt/light_NAME.cc, and its power, sampling and spectrum in
// render/transport/light_NAME.cc (docs/adding.md). Functions that differ between kinds are declared
// from these rows, in formats/pbrt/light_readers.h and transport/light_kinds.h.
//
// The value, a struct NameLight, has the members
//   kIsAtInfinity  whether it is farther than any distance
//   Place()        its position; at infinity, the direction in which its light travels, unit
//   Strength()     its colour: an intensity [W·sr⁻¹] or irradiance [W·m⁻²], as rgb in linear
//                  Rec. 709, or once the scene is in the working space, in that
//   spectrum       of the strength, where the file gives it by wavelength, up to a factor
//   medium         in which it is, as the file names it (scene/medium.h)
//   Scale(factor)  to another unit of length (scene/scaling.h); false when the strength has no
//                  number then
#pragma once

#include "render/scene/light_distant.h"
#include "render/scene/light_goniometric.h"
#include "render/scene/light_point.h"
#include "render/scene/light_projection.h"
#include "render/scene/light_spot.h"

// ROW(Name, list, name): NameLight, the member of Scene that holds them all, and their name in
// messages and in pbrt files.
#define LUCERNA_DELTA_LIGHTS(ROW)                     \
  ROW(Point, point_lights, "point")                   \
  ROW(Spot, spot_lights, "spot")                      \
  ROW(Goniometric, goniometric_lights, "goniometric") \
  ROW(Projection, projection_lights, "projection")    \
  ROW(Distant, distant_lights, "distant")
