// The tables from which transport/coat.h reads what passes a coat: averages over facets, and random
// walks through the coat and what is under it.
#pragma once

#include <vector>

#include "render/scene/scene.h"

namespace lucerna {

// Gives coated materials their tables. Materials with equal coats share one, also with those of
// other scenes in memory. With a texture of roughness, tables of several widths, between which
// FitCoat interpolates. Tables take up to 0.2 s of processor time each; threads as in ThreadTeam,
// with the same tables for any number.
void PrepareCoats(std::vector<Material>& materials, int threads = 1);

}  // namespace lucerna
