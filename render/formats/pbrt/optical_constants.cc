#include "render/formats/pbrt/optical_constants.h"

#include <array>

namespace lucerna {
namespace {

struct Metal {
  std::string_view name;
  MetalConstants constants;
};

constexpr std::array<Metal, 7> kMetals = {{
    {"Ag", {{0.155265F, 0.116723F, 0.138381F}, {4.828358F, 3.122472F, 2.147055F}}},
    {"Al", {{1.657460F, 0.880369F, 0.521229F}, {9.223869F, 6.269523F, 4.837001F}}},
    {"Au", {{0.143119F, 0.374957F, 1.442479F}, {3.983160F, 2.385721F, 1.603215F}}},
    {"Cu", {{0.200438F, 0.924033F, 1.102212F}, {3.912949F, 2.452848F, 2.142188F}}},
    {"CuZn", {{0.444F, 0.527F, 1.094F}, {3.695F, 2.765F, 1.829F}}},
    {"MgO", {{1.7348F, 1.7421F, 1.7501F}, {0, 0, 0}}},
    {"TiO2", {{2.5853F, 2.6678F, 2.7765F}, {0, 0, 0}}},
}};

struct Glass {
  std::string_view name;
  float ior;
};

constexpr std::array<Glass, 8> kGlasses = {{
    {"glass-BK7", 1.5168F},
    {"glass-BAF10", 1.67003F},
    {"glass-FK51A", 1.48656F},
    {"glass-LASF9", 1.85025F},
    {"glass-F5", 1.67270F},   // SF5
    {"glass-F10", 1.72825F},  // SF10
    {"glass-F11", 1.78472F},  // SF11
    {"diamond", 2.4173F},
}};

}  // namespace

std::optional<MetalConstants> MetalNamed(std::string_view name) {
  for (const Metal& metal : kMetals) {
    if (metal.name == name) return metal.constants;
  }
  return std::nullopt;
}

std::optional<Rgb> MetalCurveNamed(std::string_view name) {
  constexpr std::string_view kPrefix = "metal-";
  const bool wants_eta = name.ends_with("-eta");
  if (!name.starts_with(kPrefix) || !(wants_eta || name.ends_with("-k"))) return std::nullopt;
  name.remove_prefix(kPrefix.size());
  name.remove_suffix(wants_eta ? 4 : 2);
  const std::optional<MetalConstants> metal = MetalNamed(name);
  if (!metal.has_value()) return std::nullopt;
  return wants_eta ? metal->eta : metal->k;
}

std::optional<float> GlassNamed(std::string_view name) {
  for (const Glass& glass : kGlasses) {
    if (glass.name == name) return glass.ior;
  }
  return std::nullopt;
}

}  // namespace lucerna
