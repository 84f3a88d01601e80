// Which materials does a scene show, and how long do their tables take?
#pragma once

#include <cstdint>
#include <tuple>
#include <vector>

#include "render/scene/scene.h"

namespace lucerna {

// One number for each material: 1 for those on some shape, and for those that such mixes choose
// from, else 0.
[[nodiscard]] std::vector<std::uint8_t> MaterialsInUse(const Scene& scene);

// Makes plain ones of those that are not in use. Numbers of materials stay.
void DropUnusedMaterials(Scene& scene);

// Materials of equal numbers share the tables of their coat (transport/coat_tables.h).
using CoatNumbers = std::tuple<Material::Kind, float, float, float, float, float, float,
                               std::int32_t, bool, float, bool>;
[[nodiscard]] CoatNumbers CoatNumbersOf(const Material& material);
// Whether it has such tables.
[[nodiscard]] bool HasCoatTables(const Material& material);

// How much processor time the tables of coats and of light below surfaces take together, in every
// process that opens the scene [s, of one core of 2026].
[[nodiscard]] double SecondsOfTables(const std::vector<Material>& materials);

}  // namespace lucerna
