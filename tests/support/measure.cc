#include "tests/support/measure.h"

#include <vector>

#include "render/base/status.h"
#include "tests/support/local_render.h"

namespace lucerna {

double ChannelMean(const Image& image, std::string_view channel) {
  const ImageChannel* found = image.Find(channel);
  LUCERNA_CHECK(found != nullptr);
  double sum = 0;
  for (const float pixel : found->pixels)
    sum += static_cast<double>(pixel);
  return sum / static_cast<double>(found->pixels.size());
}

MeasuredMean Measure(const Scene& scene, RenderSettings settings, int passes, int parts,
                     std::string_view channel) {
  std::vector<double> means;
  for (int part = 0; part < parts; ++part) {
    settings.seed = 1000 + static_cast<std::uint64_t>(part);
    means.push_back(ChannelMean(RenderLocally(scene, settings, passes), channel));
  }
  return MeanOf(means);
}

}  // namespace lucerna
