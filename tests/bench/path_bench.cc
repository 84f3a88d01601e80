// Does an image of a scene agree with a path tracer that shares nothing with the estimator?
//
// Renders a scene small with both and prints the means over blocks of the image, their ratio, and
// the difference in standard errors. Point, spot and distant lights stand for small emitters in the
// path tracer: see tests/support/path_tracer.h.
// Run: build/release/bin/lucerna-path-check SCENE [side [passes [paths [parts [delta [depth
// [channel [radius]]]]]]]]
//   side     of the image [pixels], a multiple of 4 (32); passes of each part (64); paths of the
//   path tracer in millions (24); parts (16); radius of what stands for a point [scene units]
//   (0.02); greatest depth (the scene's); R, G or B (G);
//   first radius [widths of a pixel] (3)
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "render/scene/scene_at_time.h"
#include "tests/support/local_render.h"
#include "tests/support/path_comparison.h"

int main(int argc, char** argv) {
  using namespace lucerna;
  if (argc < 2) {
    std::fprintf(
        stderr,
        "usage: %s SCENE [side [passes [paths [parts [delta [depth [channel [radius]]]]]]]]\n",
        argv[0]);
    return 2;
  }
  const auto number = [&](int index, double otherwise) {
    return argc > index ? std::atof(argv[index]) : otherwise;
  };
  const int side = static_cast<int>(number(2, 32));
  Scene scene = LoadScene(std::filesystem::absolute(argv[1]).string());
  // The path tracer knows no motion: both see the scene as the shutter opens.
  ForgetMotion(scene);
  scene.filter = {PixelFilter::Kind::kBox, 0.5F, 0.5F};
  RenderOverrides overrides;
  overrides.width = overrides.height = side;
  if (argc > 7) overrides.max_depth = std::atoi(argv[7]);
  if (argc > 9) overrides.initial_footprints = std::atof(argv[9]);
  const RenderSettings settings = SettingsFor(scene, overrides);
  PathTracerSettings tracer;
  tracer.paths_per_replica = static_cast<int>(number(4, 24) * 1e6 / tracer.replicas);
  tracer.delta_radius = static_cast<float>(number(6, 0.02));
  tracer.delta_angle_rad = 0.02F;

  const char* channel = argc > 8 ? argv[8] : "G";
  const auto comparisons =
      CompareWithPaths(scene, settings, tracer, static_cast<int>(number(3, 64)),
                       static_cast<int>(number(5, 16)), 4, channel);
  std::printf("%s %s, depth %d\n| block | estimated | +- %% | traced | +- %% | ratio | z |\n",
              argv[1], channel, settings.max_depth);
  for (std::size_t i = 0; i < comparisons.size(); ++i) {
    const PathComparison& c = comparisons[i];
    std::printf("| %s | %.5f | %.2f | %.5f | %.2f | %.4f | %+.1f |\n",
                i == 0 ? "all" : std::to_string(i).c_str(), c.estimated.mean,
                100 * c.estimated.standard_error / c.estimated.mean, c.traced.mean,
                100 * c.traced.standard_error / c.traced.mean, c.Ratio(), c.Deviation());
  }
}
