// The kinds of material, in the order of Material::Kind.
//
// A kind is one row here and three files: its properties in render/scene/material_NAME.cc, how pbrt
// files give it in render/formats/pbrt/material_NAME.cc, and its BSDF in
// render/transport/bsdf_NAME.cc (docs/adding.md). Everything that differs between kinds is declared
// from these rows, in scene/material.h, formats/pbrt/material_readers.h and transport/bsdf_kinds.h;
// the rest of the program asks MaterialProperties.
#pragma once

// ROW(Name, name): Material::Kind::kName, and its name in messages and in pbrt files.
#define LUCERNA_MATERIALS(ROW) \
  ROW(Diffuse, "diffuse")      \
  ROW(Conductor, "conductor")  \
  ROW(Dielectric, "dielectric")
