#include "render/film/layers.h"

namespace lucerna {
namespace {

using Unit = LayerUnit;
using Source = LayerSource;
using Pixel = const PixelValues&;

// One row for each layer.
constexpr std::array kLayers = {
    Layer{"", "RGB", Unit::kRadiance, Source::kEveryImage,
          [](Pixel p, std::size_t c) { return (p.direct[c] + p.photons[c]) * p.limit; }},
    Layer{"direct", "RGB", Unit::kRadiance, Source::kEveryImage,
          [](Pixel p, std::size_t c) { return p.direct[c] * p.limit; }},
    Layer{"photons", "RGB", Unit::kRadiance, Source::kEveryImage,
          [](Pixel p, std::size_t c) { return p.photons[c] * p.limit; }},
    Layer{"albedo", "RGB", Unit::kNone, Source::kEveryImage,
          [](Pixel p, std::size_t c) { return p.albedo[c]; }},
    Layer{"N", "XYZ", Unit::kNone, Source::kEveryImage,
          [](Pixel p, std::size_t c) { return p.normal[c]; }},
    Layer{"Z", "", Unit::kLength, Source::kEveryImage,
          [](Pixel p, std::size_t) { return p.distance; }},
    Layer{"radius", "", Unit::kLength, Source::kEveryImage,
          [](Pixel p, std::size_t) { return p.radius; }},
    Layer{"photon_count", "", Unit::kNone, Source::kEveryImage,
          [](Pixel p, std::size_t) { return p.photon_count; }},
    Layer{"A", "", Unit::kNone, Source::kCoverage, [](Pixel p, std::size_t) { return p.coverage; }},
    // The square root of the spectral trace.
    Layer{"bandwidth", "", Unit::kPerLength, Source::kPredictions,
          [](Pixel p, std::size_t) { return p.bandwidth; }},
    // The radius that keeps the bias within the tolerance.
    Layer{"min_radius", "", Unit::kLength, Source::kPredictions,
          [](Pixel p, std::size_t) { return p.min_radius; }},
    // The bias expected at the last radius.
    Layer{"relative_bias", "", Unit::kNone, Source::kPredictions,
          [](Pixel p, std::size_t) { return p.relative_bias; }},
    Layer{"noise", "", Unit::kRadiance, Source::kPasses,
          [](Pixel p, std::size_t) { return p.noise; }},
    Layer{"bias", "", Unit::kRadiance, Source::kPasses,
          [](Pixel p, std::size_t) { return p.bias; }},
    Layer{"denoised", "RGB", Unit::kRadiance, Source::kDenoised,
          [](Pixel p, std::size_t c) { return p.denoised[c] * p.limit; }},
};

}  // namespace

std::string Layer::ChannelName(std::size_t channel) const {
  if (channels.empty()) return std::string(name);
  return std::string(name) + (name.empty() ? "" : ".") + channels[channel];
}

const Layer* LayerOfChannel(std::string_view channel) {
  for (const Layer& layer : kLayers) {
    for (std::size_t c = 0; c < layer.channel_count(); ++c) {
      if (layer.ChannelName(c) == channel) return &layer;
    }
  }
  return nullptr;
}

void AddLayers(LayerSource source, const std::function<PixelValues(std::size_t)>& values_of,
               std::size_t pixels, ThreadTeam& team, std::vector<ImageChannel>& channels) {
  const std::size_t first = channels.size();
  for (const Layer& layer : kLayers) {
    if (layer.source != source) continue;
    for (std::size_t c = 0; c < layer.channel_count(); ++c)
      channels.push_back({layer.ChannelName(c), std::vector<float>(pixels)});
  }
  constexpr std::size_t kPixelsAtOnce = 4096;
  team.For(pixels, kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t pixel = begin; pixel < end; ++pixel) {
      const PixelValues values = values_of(pixel);
      std::size_t number = first;
      for (const Layer& layer : kLayers) {
        if (layer.source != source) continue;
        for (std::size_t c = 0; c < layer.channel_count(); ++c)
          channels[number++].pixels[pixel] = static_cast<float>(layer.value(values, c));
      }
    }
  });
}

void ToFileUnit(std::vector<ImageChannel>& channels, double unit) {
  if (unit == 1) return;
  for (ImageChannel& channel : channels) {
    const Layer* layer = LayerOfChannel(channel.name);
    if (layer == nullptr) continue;
    if (layer->unit != LayerUnit::kLength && layer->unit != LayerUnit::kPerLength) continue;
    const double factor = layer->unit == LayerUnit::kLength ? unit : 1 / unit;
    for (float& value : channel.pixels)
      value = static_cast<float>(static_cast<double>(value) * factor);
  }
}

}  // namespace lucerna
