#include "render/formats/pbrt/optical_constants.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>

#include "render/formats/wavelength_color.h"

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

// At photon energies 0.05 eV apart, as Palik tabulates them, from 1.55 eV (800 nm) on.
constexpr std::size_t kEnergies = 36;
constexpr double kFirstEnergyEv = 1.55, kEnergyStepEv = 0.05;
constexpr double kNmEv = 1239.84;  // wavelength times energy of a photon

struct MetalCurve {
  std::string_view name;
  std::array<double, kEnergies> values;
};

constexpr std::array<MetalCurve, 8> kMetalCurves = {{
    {"metal-Ag-eta",
     {{0.14256, 0.143,   0.14588, 0.148,   0.14431, 0.14,    0.14006, 0.14,    0.13612,
       0.131,   0.1255,  0.121,   0.11931, 0.12,    0.12437, 0.129,   0.13006, 0.13,
       0.12994, 0.13,    0.13025, 0.132,   0.13731, 0.144,   0.15106, 0.157,   0.1585,
       0.16,    0.16669, 0.173,   0.17263, 0.173,   0.182,   0.192,   0.19806, 0.2}}},
    {"metal-Ag-k",
     {{5.2888, 5.09, 4.9081, 4.74, 4.5862, 4.44, 4.2931, 4.15, 4.0106, 3.88, 3.7662, 3.66,
       3.5537, 3.45, 3.3481, 3.25, 3.1594, 3.07, 2.9737, 2.88, 2.7981, 2.72, 2.64,   2.56,
       2.4787, 2.4,  2.3294, 2.26, 2.1862, 2.11, 2.0294, 1.95, 1.8787, 1.81, 1.735,  1.67}}},
    {"metal-Al-eta",
     {{2.8,   2.63,    2.41,    2.14,    1.91,    1.74,    1.6,     1.49,    1.39,
       1.3,   1.22,    1.15,    1.08,    1.02,    0.963,   0.912,   0.867,   0.826,
       0.789, 0.755,   0.72375, 0.695,   0.66863, 0.644,   0.62031, 0.598,   0.57731,
       0.558, 0.54006, 0.523,   0.50619, 0.49,    0.47469, 0.46,    0.44569, 0.432}}},
    {"metal-Al-k",
     {{8.45, 8.6,  8.62, 8.57, 8.39,   8.21, 8.01,   7.82, 7.65,   7.48, 7.31,   7.15,
       7,    6.85, 6.7,  6.55, 6.42,   6.28, 6.15,   6.03, 5.915,  5.8,  5.69,   5.58,
       5.48, 5.38, 5.29, 5.2,  5.1087, 5.02, 4.9381, 4.86, 4.7844, 4.71, 4.6338, 4.56}}},
    {"metal-Au-eta",
     {{0.18138, 0.176,   0.1695, 0.164,   0.16087, 0.16,   0.161,  0.166,   0.17775,
       0.194,   0.21238, 0.236,  0.26763, 0.306,   0.3455, 0.402,  0.49175, 0.608,
       0.7545,  0.916,   1.0868, 1.242,   1.3459,  1.426,  1.5021, 1.562,   1.5962,
       1.616,   1.628,   1.636,  1.6473,  1.658,   1.666,  1.674,  1.6847,  1.696}}},
    {"metal-Au-k",
     {{5.1258, 4.86,  4.6102, 4.357, 4.0877, 3.8,   3.4458, 3.15,  3.07,   3.06,  3.015,  2.97,
       2.9406, 2.88,  2.7306, 2.54,  2.3262, 2.12,  1.9565, 1.84,  1.7974, 1.796, 1.8146, 1.846,
       1.8759, 1.904, 1.9245, 1.94,  1.9514, 1.958, 1.9594, 1.956, 1.9478, 1.936, 1.9225, 1.906}}},
    {"metal-Cu-eta",
     {{0.25419, 0.25,    0.2365, 0.223,   0.21625, 0.213,   0.20925, 0.214,  0.23081,
       0.272,   0.35125, 0.468,  0.64587, 0.826,   0.95037, 1.04,    1.0924, 1.12,
       1.1316,  1.135,   1.1428, 1.15,    1.1553,  1.16,    1.1653,  1.17,   1.1728,
       1.175,   1.1781,  1.18,   1.1775,  1.175,   1.1744,  1.18,    1.2,    1.225}}},
    {"metal-Cu-k",
     {{5.0341, 4.817, 4.6196, 4.43,  4.2396, 4.05,  3.8631, 3.67,  3.4582, 3.24,  3.0107, 2.809,
       2.6781, 2.599, 2.5765, 2.583, 2.5956, 2.605, 2.5896, 2.564, 2.5359, 2.504, 2.4692, 2.433,
       2.3976, 2.362, 2.326,  2.289, 2.2499, 2.21,  2.1601, 2.13,  2.1772, 2.21,  2.1216, 2.015}}},
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

GivenSpectrum MetalSpectrumNamed(std::string_view name) {
  WavelengthCurve curve;
  for (const MetalCurve& of_metal : kMetalCurves) {
    if (of_metal.name != name) continue;
    for (std::size_t i = kEnergies; i-- > 0;) {
      curve.wavelength_nm.push_back(kNmEv /
                                    (kFirstEnergyEv + kEnergyStepEv * static_cast<double>(i)));
      curve.value.push_back(of_metal.values[i]);
    }
    return {std::make_shared<const WavelengthCurve>(std::move(curve))};
  }
  const std::optional<Rgb> three = MetalCurveNamed(name);
  if (!three.has_value()) return {};
  curve.wavelength_nm = {kBlueNm, kGreenNm, kRedNm};
  curve.value = {static_cast<double>(three->b), static_cast<double>(three->g),
                 static_cast<double>(three->r)};
  return {std::make_shared<const WavelengthCurve>(std::move(curve))};
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
