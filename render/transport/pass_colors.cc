#include "render/transport/pass_colors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "render/base/status.h"
#include "render/math/color_matching.h"
#include "render/math/color_space.h"
#include "render/scene/measured_table.h"

namespace lucerna {
namespace {

// [luminance] of a spectrum, sampled each nanometre.
template <typename Spectrum>
double LuminanceOf(const Spectrum& spectrum) {
  double sum = 0;
  for (double nm = kFirstObservedNm; nm <= kLastObservedNm; nm += 1)
    sum += spectrum(nm) * CieObserver(nm)[1];
  return sum;
}

// Back from the working space; grey stays grey.
Rgb FromWorking(Rgb color) {
  if (IsGray(color)) return Gray(color.g);
  const auto rec709 = ToRec709(
      {static_cast<double>(color.r), static_cast<double>(color.g), static_cast<double>(color.b)});
  const auto held = [](double value) { return static_cast<float>(std::max(value, 0.0)); };
  return {held(rec709[0]), held(rec709[1]), held(rec709[2])};
}

// The reflectance at right angles from which a metal with the index 1 has this absorption
// (AbsorptionFor).
float ReflectanceOf(float k) {
  return k * k / (4 + k * k);
}
Rgb ReflectanceOf(Rgb k) {
  return {ReflectanceOf(k.r), ReflectanceOf(k.g), ReflectanceOf(k.b)};
}

// Calls visit(strength, spectrum) for all lights, in order.
template <typename SceneType, typename Visit>
void ForEachLight(SceneType& scene, const Visit& visit) {
  for (auto& light : scene.area_lights)
    visit(light.radiance, light.spectrum);
  ForEachDeltaList(scene, [&](auto& lights) {
    for (auto& light : lights)
      visit(light.Strength(), light.spectrum);
  });
  for (auto& light : scene.infinite_lights)
    visit(light.radiance, light.spectrum);
}

bool HasLightPictures(const Scene& scene) {
  return std::ranges::any_of(scene.area_lights,
                             [](const auto& l) { return l.picture != nullptr; }) ||
         std::ranges::any_of(scene.infinite_lights,
                             [](const auto& l) { return l.map != nullptr; }) ||
         !scene.projection_lights.empty();
}

}  // namespace

ColorSpectrum ColorSpectrum::OfReflectance(Rgb rec709, const GivenSpectrum& given) {
  ColorSpectrum spectrum;
  spectrum.factor_ = 1;
  if (given.is_given()) {
    spectrum.kind_ = Kind::kCurve;
    spectrum.curve_ = given.curve;
    spectrum.factor_ = given.factor;
  } else if (lucerna::IsGray(rec709)) {
    spectrum.factor_ = rec709.g;
  } else {
    spectrum.kind_ = Kind::kPolynomial;
    spectrum.polynomial_ = FitReflectance(
        {std::min(rec709.r, 1.0F), std::min(rec709.g, 1.0F), std::min(rec709.b, 1.0F)});
  }
  return spectrum;
}

ColorSpectrum ColorSpectrum::OfUnbounded(Rgb rec709, const GivenSpectrum& given) {
  if (given.is_given() || lucerna::IsGray(rec709)) return OfReflectance(rec709, given);
  const float scale = 2 * MaxChannel(rec709);
  ColorSpectrum spectrum = OfReflectance(rec709 / scale);
  spectrum.factor_ = scale;
  return spectrum;
}

ColorSpectrum ColorSpectrum::OfConstant(Rgb rec709, const GivenSpectrum& given) {
  ColorSpectrum spectrum = OfUnbounded(rec709, given);
  if (given.is_given()) spectrum.kind_ = Kind::kClampedCurve;
  return spectrum;
}

ColorSpectrum ColorSpectrum::OfLight(Rgb rec709, const GivenSpectrum& given) {
  if (!given.is_given() || IsBlack(rec709)) return OfUnbounded(rec709);
  ColorSpectrum spectrum;
  spectrum.kind_ = Kind::kLight;
  spectrum.curve_ = given.curve;
  const double of_curve = LuminanceOf([&](double nm) { return given.curve->At(nm); });
  const double of_daylight = LuminanceOf(D65At);
  spectrum.factor_ =
      of_curve > 0
          ? static_cast<float>(static_cast<double>(Luminance(rec709)) * of_daylight / of_curve)
          : 0.0F;
  return spectrum;
}

Rgb ColorSpectrum::At(const PassWavelengths& wavelengths) const {
  const auto at = [this](double nm) -> float {
    switch (kind_) {
      case Kind::kGray:
        return factor_;
      case Kind::kPolynomial:
        return factor_ * polynomial_.At(static_cast<float>(PolynomialPlace(nm)));
      case Kind::kCurve:
        return factor_ * static_cast<float>(curve_->At(nm));
      case Kind::kClampedCurve:
        return factor_ * static_cast<float>(curve_->AtClamped(nm));
      case Kind::kLight:
        return factor_ * static_cast<float>(curve_->At(nm) / D65At(nm));
    }
    return 0;
  };
  return {at(wavelengths.nm[0]), at(wavelengths.nm[1]), at(wavelengths.nm[2])};
}

PassColors::PassColors(const Scene& working) {
  static const MaterialSpectra kNone;
  for (const Material& m : working.materials) {
    const MaterialSpectra& given = m.given.spectra == nullptr ? kNone : *m.given.spectra;
    OfMaterial& of = materials_.emplace_back();
    of.reflectance = m.reflectance;
    of.transmittance = m.transmittance;
    of.eta = m.eta;
    of.k = m.k;
    of.absorption = m.absorption;
    of.extinction = m.extinction;
    of.coat_albedo = m.coat_albedo;
    of.reflectance_spectrum =
        ColorSpectrum::OfReflectance(FromWorking(m.reflectance), given.reflectance);
    of.transmittance_spectrum =
        ColorSpectrum::OfReflectance(FromWorking(m.transmittance), given.transmittance);
    of.absorption_spectrum = ColorSpectrum::OfConstant(FromWorking(m.absorption), given.absorption);
    of.extinction_spectrum = ColorSpectrum::OfUnbounded(FromWorking(m.extinction));
    of.coat_albedo_spectrum = ColorSpectrum::OfReflectance(
        m.kind == Material::Kind::kCoatedConductor ? m.coat_albedo : FromWorking(m.coat_albedo));
    of.reflection_tint = m.reflection_tint;
    of.transmission_tint = m.transmission_tint;
    if (m.is_tinted) {
      of.reflection_tint_spectrum =
          ColorSpectrum::OfReflectance(FromWorking(m.reflection_tint), {});
      of.transmission_tint_spectrum =
          ColorSpectrum::OfReflectance(FromWorking(m.transmission_tint), {});
    }
    const bool is_metal =
        m.kind == Material::Kind::kConductor || m.kind == Material::Kind::kCoatedConductor;
    of.is_metal_of_reflectance =
        is_metal && m.eta == Gray(1) && !given.eta.is_given() && !given.k.is_given();
    if (of.is_metal_of_reflectance) {
      of.reflectance_spectrum = ColorSpectrum::OfReflectance(ReflectanceOf(m.k), given.reflectance);
    } else if (is_metal) {
      of.eta_spectrum = ColorSpectrum::OfConstant(m.eta, given.eta);
      of.k_spectrum = ColorSpectrum::OfConstant(m.k, given.k);
    }
  }
  for (const Medium& m : working.media) {
    media_.push_back({m.absorption, m.scattering,
                      ColorSpectrum::OfConstant(FromWorking(m.absorption), m.absorption_spectrum),
                      ColorSpectrum::OfConstant(FromWorking(m.scattering), m.scattering_spectrum)});
  }
  bool is_any_colored = false;
  ForEachLight(working, [&](const Rgb& strength, const GivenSpectrum& given) {
    lights_.push_back({strength, ColorSpectrum::OfLight(FromWorking(strength), given)});
    is_any_colored = is_any_colored || !lights_.back().spectrum.IsGray();
  });
  if (HasLightPictures(working)) {
    // Of a saturated blue, whose luminance is a fourteenth of its channel.
    constexpr double kMostOfPixels = 32;
    largest_power_ = kMostOfPixels;
  }
  if (!is_any_colored) return;
  constexpr int kPlaces = 1024;
  // Lines of spectra lie between the places.
  constexpr double kBetween = 1.5;
  for (int i = 0; i <= kPlaces; ++i) {
    const PassWavelengths wavelengths = WavelengthsAt(static_cast<double>(i) / kPlaces);
    for (const OfLight& light : lights_) {
      const auto three = static_cast<double>(Luminance(light.strength));
      if (light.spectrum.IsGray() || !(three > 0)) continue;
      largest_power_ = std::max(
          largest_power_,
          kBetween * static_cast<double>(Luminance(light.spectrum.At(wavelengths))) / three);
    }
  }
}

void PassColors::SetAt(const PassWavelengths& wavelengths, Scene& scene) {
  uplift_.emplace(wavelengths);
  scene.uplift = &*uplift_;
  for (std::size_t i = 0; i < materials_.size(); ++i) {
    const OfMaterial& of = materials_[i];
    Material& m = scene.materials[i];
    m.is_at_wavelengths = true;
    m.reflectance = of.reflectance_spectrum.At(wavelengths);
    m.transmittance = of.transmittance_spectrum.At(wavelengths);
    if (of.is_metal_of_reflectance) {
      m.k = {AbsorptionFor(m.reflectance.r), AbsorptionFor(m.reflectance.g),
             AbsorptionFor(m.reflectance.b)};
    } else {
      m.eta = of.eta_spectrum.At(wavelengths);
      m.k = of.k_spectrum.At(wavelengths);
    }
    m.absorption = m.absorbs_for_reflectance ? HairAbsorption(m.reflectance, m.beta_n)
                                             : of.absorption_spectrum.At(wavelengths);
    m.extinction = of.extinction_spectrum.At(wavelengths);
    m.coat_albedo = of.coat_albedo_spectrum.At(wavelengths);
    if (m.is_tinted) {
      m.reflection_tint = of.reflection_tint_spectrum.At(wavelengths);
      m.transmission_tint = of.transmission_tint_spectrum.At(wavelengths);
    }
    if (m.measured != nullptr) m.measured_planes = m.measured->At(wavelengths.nm);
  }
  for (std::size_t i = 0; i < media_.size(); ++i) {
    scene.media[i].absorption = media_[i].absorption_spectrum.At(wavelengths);
    scene.media[i].scattering = media_[i].scattering_spectrum.At(wavelengths);
  }
  std::size_t number = 0;
  ForEachLight(scene, [&](Rgb& strength, const GivenSpectrum&) {
    strength = lights_[number++].spectrum.At(wavelengths);
  });
}

void PassColors::SetThree(Scene& scene) {
  scene.uplift = nullptr;
  for (std::size_t i = 0; i < materials_.size(); ++i) {
    const OfMaterial& of = materials_[i];
    Material& m = scene.materials[i];
    m.is_at_wavelengths = false;
    m.reflectance = of.reflectance;
    m.transmittance = of.transmittance;
    m.eta = of.eta;
    m.k = of.k;
    m.absorption = of.absorption;
    m.extinction = of.extinction;
    m.coat_albedo = of.coat_albedo;
    m.reflection_tint = of.reflection_tint;
    m.transmission_tint = of.transmission_tint;
    if (m.measured != nullptr) m.measured_planes = m.measured->WorkingSpace();
  }
  for (std::size_t i = 0; i < media_.size(); ++i) {
    scene.media[i].absorption = media_[i].absorption;
    scene.media[i].scattering = media_[i].scattering;
  }
  std::size_t number = 0;
  ForEachLight(scene,
               [&](Rgb& strength, const GivenSpectrum&) { strength = lights_[number++].strength; });
}

}  // namespace lucerna
