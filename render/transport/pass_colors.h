// Which values have a scene's colours at the three wavelengths of a pass?
//
// Spectra that files give are taken as they are, all other colours get smooth ones (math/uplift.h),
// made once. A scene that is ready for paths (transport/working_space.h) has its colours replaced
// by their values at one pass's wavelengths and, between passes, its three colours back. Everything
// that is drawn by the strength of lights is drawn by their three colours, in all passes.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "render/math/pass_wavelengths.h"
#include "render/math/rgb.h"
#include "render/math/uplift.h"
#include "render/scene/scene.h"

namespace lucerna {

// A colour as a function of the wavelength.
class ColorSpectrum {
 public:
  // Of linear Rec. 709, where no spectrum is `given`.
  [[nodiscard]] static ColorSpectrum OfReflectance(Rgb rec709, const GivenSpectrum& given = {});
  [[nodiscard]] static ColorSpectrum OfUnbounded(Rgb rec709, const GivenSpectrum& given = {});
  // A curve that goes on as it ends, as those of optical constants do.
  [[nodiscard]] static ColorSpectrum OfConstant(Rgb rec709, const GivenSpectrum& given);
  // Relative to daylight, of a luminance of that of `rec709`.
  [[nodiscard]] static ColorSpectrum OfLight(Rgb rec709, const GivenSpectrum& given);

  [[nodiscard]] Rgb At(const PassWavelengths& wavelengths) const;
  // Whether it is the same at all wavelengths.
  [[nodiscard]] bool IsGray() const { return kind_ == Kind::kGray; }

 private:
  enum class Kind : std::uint8_t { kGray, kPolynomial, kCurve, kClampedCurve, kLight };

  Kind kind_ = Kind::kGray;
  SigmoidPolynomial polynomial_;
  std::shared_ptr<const WavelengthCurve> curve_;
  float factor_ = 0;
};

class PassColors {
 public:
  // Of a scene in the working space.
  explicit PassColors(const Scene& working);

  // Replaces the colours of that scene by their values, and sets its `uplift`, which lasts until
  // the next call.
  void SetAt(const PassWavelengths& wavelengths, Scene& scene);
  // Gives it its three colours back, to the bit.
  void SetThree(Scene& scene);

  // At least how many times its power [luminance] a light has in any pass; 1 where all light is
  // white, and so the same in every pass.
  [[nodiscard]] double largest_power() const { return largest_power_; }

 private:
  struct OfMaterial {
    Rgb reflectance, transmittance, eta, k, absorption, extinction, coat_albedo, reflection_tint,
        transmission_tint;  // the three colours
    ColorSpectrum reflectance_spectrum, transmittance_spectrum, eta_spectrum, k_spectrum,
        absorption_spectrum, extinction_spectrum, coat_albedo_spectrum, reflection_tint_spectrum,
        transmission_tint_spectrum;
    bool is_metal_of_reflectance = false;  // eta is 1, and k follows from the reflectance
  };
  struct OfMedium {
    Rgb absorption, scattering;
    ColorSpectrum absorption_spectrum, scattering_spectrum;
  };
  struct OfLight {
    Rgb strength;
    ColorSpectrum spectrum;
  };

  std::vector<OfMaterial> materials_;
  std::vector<OfMedium> media_;
  std::vector<OfLight> lights_;  // areas, delta lights, infinite lights
  double largest_power_ = 1;
  std::optional<Uplift> uplift_;
};

}  // namespace lucerna
