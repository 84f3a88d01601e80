// What are the optical constants of the materials that pbrt knows by name?
//
// Metals as index of refraction and absorption at 630, 532 and 465 nm, some also at all visible
// wavelengths; glasses as the index at
// the helium d line (587.6 nm) and its dispersion.
//
// Source: Palik, "Handbook of Optical Constants of Solids" (Ag, Al, Au, Cu); Querry 1985,
// "Optical constants" (CuZn, brass); Stephens and Malitson 1952 (MgO); DeVore 1951, the ordinary
// ray of rutile (TiO2); Schott's data sheets (glasses, in the
// form of Sellmeier 1871); Peter 1923 (diamond).
#pragma once

#include <optional>
#include <string_view>

#include "render/math/dispersion.h"
#include "render/math/rgb.h"
#include "render/scene/given_spectrum.h"

namespace lucerna {

struct MetalConstants {
  Rgb eta;  // index of refraction
  Rgb k;    // absorption
};

// By pbrt's name of the metal: Ag, Al, Au, Cu, CuZn, MgO, TiO2.
[[nodiscard]] std::optional<MetalConstants> MetalNamed(std::string_view name);

// By pbrt's name of a curve: "metal-Ag-eta", "metal-Ag-k" and so on.
[[nodiscard]] std::optional<Rgb> MetalCurveNamed(std::string_view name);

// The same at all visible wavelengths, where it is known (Ag, Al, Au and Cu); else as lines between
// the three.
[[nodiscard]] GivenSpectrum MetalSpectrumNamed(std::string_view name);

// By pbrt's name: "glass-BK7", "glass-F11" (which is Schott's SF11) and so on, "diamond".
[[nodiscard]] std::optional<RefractiveIndex> GlassNamed(std::string_view name);

}  // namespace lucerna
