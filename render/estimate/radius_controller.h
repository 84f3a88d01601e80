// From what a pixel's photons were, how large is its next radius?
//
// A controller is a pure rule, applied to every pixel after each round (estimate/rounds.h), in
// order. Radii are in units that the pass fixes per hitpoint (see EyePass::unit_radii).
// It names the columns of evidence it uses (estimate/evidence.h) and for as many numbers of
// memory a pixel as it needs; most use neither.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "render/estimate/rounds.h"
#include "render/scene/render_settings.h"

namespace lucerna {

// What is shared by all hitpoints that a pixel ever had (Hachisuka & Jensen 2009, "Stochastic
// Progressive Photon Mapping").
struct PixelRadius {
  // In double: late passes shrink a radius by less than a float can tell, and add fewer photons to
  // N than it can count.
  double radius = 0;   // in unit radii
  double photons = 0;  // N, photons counted as kept so far
};

// What one round brought to one pixel: sums over its passes.
struct RoundEvidence {
  double photons = 0;  // M, found with the radius below
  double radius = 0;   // in unit radii; radii lag, so that PixelRadius::radius may differ
  // One number a column, in the controller's order of columns.
  std::span<const double> columns;
  // What the kernel makes of light that is not even, as kBlurColumn measures it: estimate less
  // truth [luminance flux relative to the scene's power, per squared unit radius].
  double blur = 0;
  std::uint64_t rounds = 1;  // so far, with this one
  double noise_share = 1;    // as PhotonNoiseShare has it, or what is assumed
  double scale = 1;          // as RadiusScale has it, or 1
  // What kernels changed in the pixel, summed over the even passes and over the odd ones
  // [luminance].
  double even_bias = 0, odd_bias = 0;
  double photons_per_pass = 1;
};

// What a frequency controller predicts for a pixel.
struct BandwidthPrediction {
  double trace = 0;       // of the spatial spectral covariance [1/unit radius²]
  double min_radius = 0;  // that keeps the bias within the tolerance [unit radii]
};

// What a factor for the radii of the whole image (estimate/radius_scale.h) does to a pixel's. Radii
// are relative to the one that it would have without a factor.
struct ScaledRadius {
  double most = 1;  // that the pixel's own evidence allows, at most 1
  // Two means of those that the passes so far had: of inverse sixth powers, as noise counts them,
  // and of fourth powers, each pass by its photons, as squared bias does.
  double use = 1, blurred = 1;
  // What the kernel changes at a radius without a factor, as the even passes and the odd ones have
  // it [luminance of a pass].
  double even_bias = 0, odd_bias = 0;
};

// The passes whose evidence a controller has taken in.
struct PassesTaken {
  std::uint64_t passes = 0, rounds = 0;
  double photons = 0;  // of all of them
};

// The powers of the photon count with which two parts of the mean squared error of converging
// images fall, by theory.
struct TheorySlopes {
  double noise = 0;
  double squared_bias = 0;
};

inline constexpr double kMostOfFirst = 2;

class RadiusController {
 public:
  virtual ~RadiusController() = default;
  // Numbers of memory a pixel, zero before the first pass.
  [[nodiscard]] virtual std::size_t MemoryPerPixel() const { return 0; }
  // The state after the round `passes` brought `evidence`, which follows all passes before it. A
  // radius is at most kMostOfFirst times the first one.
  [[nodiscard]] virtual PixelRadius Next(const PixelRadius& now, const RoundEvidence& evidence,
                                         const PassRange& passes,
                                         std::span<double> memory) const = 0;
  // Whether blur that photons surely show is taken off the image (estimate/without_blur.h).
  [[nodiscard]] virtual bool RemovesBlur() const { return false; }
  // Absent when the controller scales no radii, or not yet.
  [[nodiscard]] virtual std::optional<ScaledRadius> Scaled(std::span<const double> /*memory*/,
                                                           const PassesTaken& /*taken*/) const {
    return std::nullopt;
  }
  // Whether Predict ever says anything.
  [[nodiscard]] virtual bool Predicts() const { return false; }
  // Absent when the controller makes none, or has too little evidence for the pixel yet.
  [[nodiscard]] virtual std::optional<BandwidthPrediction> Predict(
      std::span<const double> /*memory*/) const {
    return std::nullopt;
  }
  // Absent when no theory says.
  [[nodiscard]] virtual std::optional<TheorySlopes> Slopes() const { return std::nullopt; }
};

// By what factor a radius shrinks in `passes` on a schedule that is the same for every pixel.
// Source: Knaus & Zwicker 2011, "Progressive Photon Mapping: A Probabilistic Approach", eq. (18).
[[nodiscard]] double ScheduledShrink(double alpha, const PassRange& passes);

// The controller that `settings` name. `initial_radius` in unit radii.
[[nodiscard]] std::unique_ptr<RadiusController> MakeRadiusController(const RenderSettings& settings,
                                                                     float initial_radius);
// One controller each, defined in its own file in estimate/controllers/; called by the above alone.
#define LUCERNA_DECLARE(Name, name, evidence)                                                \
  [[nodiscard]] std::unique_ptr<RadiusController> Make##Name(const RenderSettings& settings, \
                                                             float initial_radius);
LUCERNA_RADIUS_CONTROLLERS(LUCERNA_DECLARE)
#undef LUCERNA_DECLARE

}  // namespace lucerna
