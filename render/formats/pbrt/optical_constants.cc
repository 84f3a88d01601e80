#include "render/formats/pbrt/optical_constants.h"

#include <array>
#include <cmath>

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

// n² - 1 = the sum of strength · λ² / (λ² - resonance²), λ in µm.
struct SellmeierTerm {
  double strength, resonance_um2;
};

struct Glass {
  std::string_view name;
  float at_d;
  std::array<SellmeierTerm, 3> terms;
};

constexpr std::array<Glass, 8> kGlasses = {{
    {"glass-BK7",
     1.5168F,
     {{{1.03961212, 0.00600069867}, {0.231792344, 0.0200179144}, {1.01046945, 103.560653}}}},
    {"glass-BAF10",
     1.67003F,
     {{{1.5851495, 0.00926681282}, {0.143559385, 0.0424489805}, {1.08521269, 105.613573}}}},
    {"glass-FK51A",
     1.48656F,
     {{{0.971247817, 0.00472301995}, {0.216901417, 0.0153575612}, {0.904651666, 168.68133}}}},
    {"glass-LASF9",
     1.85025F,
     {{{2.00029547, 0.0121426017}, {0.298926886, 0.0538736236}, {1.80691843, 156.530829}}}},
    {"glass-F5",  // SF5
     1.67270F,
     {{{1.52481889, 0.011254756}, {0.187085527, 0.0588995392}, {1.42729015, 129.141675}}}},
    {"glass-F10",  // SF10
     1.72825F,
     {{{1.62153902, 0.0122241457}, {0.256287842, 0.0595736775}, {1.64447552, 147.468793}}}},
    {"glass-F11",  // SF11
     1.78472F,
     {{{1.73759695, 0.013188707}, {0.313747346, 0.0623068142}, {1.89878101, 155.23629}}}},
    {"diamond", 2.4173F, {{{0.3306, 0.175 * 0.175}, {4.3356, 0.106 * 0.106}, {0, 1}}}},
}};

double IndexOf(const Glass& glass, double nm) {
  const double square_um2 = nm * nm * 1e-6;
  double index_squared = 1;
  for (const SellmeierTerm& term : glass.terms)
    index_squared += term.strength * square_um2 / (square_um2 - term.resonance_um2);
  return std::sqrt(index_squared);
}

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

std::optional<RefractiveIndex> GlassNamed(std::string_view name) {
  for (const Glass& glass : kGlasses) {
    if (glass.name == name) {
      return RefractiveIndex{glass.at_d,
                             FitDispersion([&](double nm) { return IndexOf(glass, nm); })};
    }
  }
  return std::nullopt;
}

}  // namespace lucerna
