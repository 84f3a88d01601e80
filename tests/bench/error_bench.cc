// How true is the error estimate?
//
// Renders a scene in one process and compares, at every look, the estimated relMSE with the true one
// against a reference. The reference's own squared error may be given, to be taken off the truth.
// Run: build/release/bin/lucerna-error-check SCENE REFERENCE.exr [passes [controller [noise]]]
#include <cstdio>
#include <cstdlib>
#include <string>

#include "render/base/files.h"
#include "render/image/exr_file.h"
#include "render/film/image_metrics.h"
#include "tests/support/local_render.h"

int main(int argc, char** argv) {
  using namespace lucerna;
  if (argc < 3) {
    std::fprintf(stderr, "usage: %s SCENE REFERENCE.exr [passes [controller [noise]]]\n", argv[0]);
    return 2;
  }
  const Scene scene = LoadScene(argv[1]);
  const Image reference = DecodeExr(ReadFile(argv[2]).value()).value();
  const int passes = argc > 3 ? std::atoi(argv[3]) : 64;
  RenderOverrides overrides;
  overrides.width = reference.width;
  overrides.height = reference.height;
  overrides.photons_per_pass = reference.width * reference.height;
  overrides.initial_radius = 0;
  overrides.max_depth = 20;
  overrides.radius_controller = ParseRadiusController(argc > 4 ? argv[4] : "appm").value();
  const double own = argc > 5 ? std::atof(argv[5]) : 0;
  LocalRender render(scene, SettingsFor(scene, overrides));
  std::printf("| passes | true relMSE | estimate | noise | bias | low | high | estimate/true |\n");
  int look = 0;
  int next = 4;
  for (int pass = 1; pass <= passes; ++pass) {
    render.AddPass();
    if (pass != next) continue;
    next = std::max(next + 1, next * 3 / 2);
    const ErrorEstimate e = render.EstimateError(++look);
    const double truth = Compare(render.MakeImage(), reference, {}).value().rel_mse - own;
    std::printf("| %d | %.3e | %.3e | %.3e | %.3e | %.3e | %.3e | %.2f |\n", pass, truth,
                e.relative.total(), e.relative.noise, e.relative.bias, e.relative.low,
                e.relative.high, e.relative.total() / truth);
  }
}
