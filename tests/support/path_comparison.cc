#include "tests/support/path_comparison.h"

#include <cmath>

#include "render/base/status.h"
#include "render/image/image.h"
#include "render/transport/working_space.h"
#include "tests/support/local_render.h"

namespace lucerna {
namespace {

double MeanOver(const ImageChannel& channel, int width, const PixelBlock& block) {
  double sum = 0;
  for (int y = block.y0; y < block.y1; ++y) {
    for (int x = block.x0; x < block.x1; ++x)
      sum += static_cast<double>(channel.pixels[static_cast<std::size_t>(y * width + x)]);
  }
  return sum / ((block.x1 - block.x0) * (block.y1 - block.y0));
}

}  // namespace

double PathComparison::StandardError() const {
  return std::hypot(estimated.standard_error, traced.standard_error);
}

double PathComparison::Deviation() const {
  const double difference = estimated.mean - traced.mean;
  return difference == 0 ? 0 : difference / StandardError();
}

std::vector<PathComparison> EstimateBlocks(const Scene& scene, RenderSettings settings, int passes,
                                           int parts, int side, std::string_view channel,
                                           int threads) {
  const int width = settings.width;
  const int height = settings.height;
  LUCERNA_CHECK(width % side == 0 && height % side == 0 && settings.crop_width() == width &&
                settings.crop_height() == height);
  // As the path tracer has them.
  settings.spectral = false;
  std::vector<PathComparison> blocks;
  blocks.push_back({{0, 0, width, height}, {}, {}});
  for (int i = 0; side > 1 && i < side * side; ++i) {
    const int x = i % side * (width / side);
    const int y = i / side * (height / side);
    blocks.push_back({{x, y, x + width / side, y + height / side}, {}, {}});
  }

  // Tables of its materials are in memory as long as this is: all parts share them.
  const Scene with_tables = InWorkingSpace(scene, threads);
  std::vector<std::vector<double>> means(blocks.size());
  const std::uint64_t first_seed = settings.seed;
  for (int part = 0; part < parts; ++part) {
    settings.seed = first_seed + static_cast<std::uint64_t>(part);
    const Image image = RenderLocally(scene, settings, passes, threads);
    const ImageChannel* found = image.Find(channel);
    LUCERNA_CHECK(found != nullptr);
    for (std::size_t i = 0; i < blocks.size(); ++i)
      means[i].push_back(MeanOver(*found, width, blocks[i].block));
  }
  for (std::size_t i = 0; i < blocks.size(); ++i)
    blocks[i].estimated = MeanOf(means[i]);
  return blocks;
}

std::vector<PathComparison> CompareWithPaths(const Scene& scene, const RenderSettings& settings,
                                             PathTracerSettings tracer, int passes, int parts,
                                             int side, std::string_view channel) {
  std::vector<PathComparison> comparisons =
      EstimateBlocks(scene, settings, passes, parts, side, channel, tracer.threads);
  tracer.width = settings.width;
  tracer.height = settings.height;
  tracer.max_depth = settings.max_depth;
  const TracedImage traced = TracePaths(scene, tracer);
  const int number = channel == "R" ? 0 : channel == "G" ? 1 : 2;
  for (PathComparison& comparison : comparisons)
    comparison.traced = traced.MeanOver(comparison.block, number);
  return comparisons;
}

}  // namespace lucerna
