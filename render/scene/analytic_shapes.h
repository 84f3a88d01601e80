// The kinds of shape that are given by a formula. All others are triangle meshes.
//
// A kind is an include and a row here and four files: its value in render/scene/shape_NAME.h, how
// it is moved in shape_NAME.cc there, how pbrt files give it in render/formats/pbrt/shape_NAME.cc,
// and intersection, sampling, texture coordinates, curvature and edges in
// render/geometry/shape_NAME.cc (docs/adding.md). Functions that differ between kinds are declared
// from these rows: scene/shape_moves.h, formats/pbrt/shape_readers.h, geometry/shape_geometry.h.
//
// The value, a struct Name, has the members
//   center, traits         `center` is the middle of a ball that holds the shape
//   Reach()                the radius of that ball
//   Area<Real>()           of one side, computed in Real
//   Scale(factor)          to another unit of length (scene/scaling.h)
//   LightsItself()         whether light that leaves its outward side may meet the shape again
//   kIsFlat                whether it lies in a plane; then also `normal`, unit, outward
//   kIsClosed              whether it is the surface of a convex body; then also
//                          SignedDistance(point): to the surface, negative inside. One that is not
//                          closed has a rim.
//   kIsThin                whether it is much thinner than the discs of hitpoints: then nothing is
//                          gathered on it (StopGatheringOnThinShapes in formats/finish_scene.cc),
//                          no disc is cut where it passes through a surface, and it encloses
//                          nothing
#pragma once

#include "render/scene/shape_curve.h"
#include "render/scene/shape_disk.h"
#include "render/scene/shape_sphere.h"

// ROW(Name, list, name): the struct, the member of Scene that holds them all, and their name in
// messages and in pbrt files.
#define LUCERNA_ANALYTIC_SHAPES(ROW) \
  ROW(Sphere, spheres, "sphere")     \
  ROW(Disk, disks, "disk")           \
  ROW(CurvePiece, curve_pieces, "curve")
