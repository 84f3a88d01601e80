// Which layers does an image have?
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/parallel.h"
#include "render/image/image.h"

namespace lucerna {

// What layers are made of, for one pixel. Radiance times exposure, Rec. 709; lengths in the unit
// that the scene is rendered in.
struct PixelValues {
  std::array<double, 3> direct{}, photons{};
  double limit = 1;  // factor that keeps the beauty image below the film's maximum
  std::array<double, 3> albedo{}, normal{};
  double distance = 0;  // from the camera; infinite where nothing was hit
  double coverage = 0;  // of the pixel's paths, which share hit a surface
  double radius = 0, photon_count = 0;
  // What the radius controller predicts; 0 where it predicts nothing.
  double bandwidth = 0, min_radius = 0, relative_bias = 0;
  // From the differences between passes.
  double noise = 0, bias = 0;
  std::array<double, 3> denoised{};
};

// How values change with the unit of length and with the power of the lights.
enum class LayerUnit : std::uint8_t { kNone, kRadiance, kLength, kPerLength };
// Which images have the layer: all; those that were asked for it; those of controllers that predict
// bandwidths; those of two passes or more; finished ones of jobs that asked for it.
enum class LayerSource : std::uint8_t { kEveryImage, kCoverage, kPredictions, kPasses, kDenoised };

struct Layer {
  std::string_view name;      // of the EXR layer; the beauty image has none
  std::string_view channels;  // one letter each; none: a single channel named as the layer
  LayerUnit unit;
  LayerSource source;
  double (*value)(const PixelValues& pixel, std::size_t channel);

  [[nodiscard]] std::size_t channel_count() const { return channels.empty() ? 1 : channels.size(); }
  // As EXR names it: "R", "direct.G", "radius".
  [[nodiscard]] std::string ChannelName(std::size_t channel) const;
};

// The layer of a channel, or nullptr. All layers: one row each in layers.cc.
[[nodiscard]] const Layer* LayerOfChannel(std::string_view channel);

// Adds the layers of `source`, of so many pixels, by the threads of `team`; `values_of` gives the
// values of a pixel and may run beside itself.
void AddLayers(LayerSource source, const std::function<PixelValues(std::size_t)>& values_of,
               std::size_t pixels, ThreadTeam& team, std::vector<ImageChannel>& channels);

// Turns lengths from the unit that the scene is rendered in to that of the scene's file, which are
// `unit` of it.
void ToFileUnit(std::vector<ImageChannel>& channels, double unit);

}  // namespace lucerna
