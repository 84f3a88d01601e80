// Is the `noise` layer the deviation of its pixels over seeds?
//
// Prints, for every decile of brightness, the deviation over renders of different seeds, the layer,
// their ratio, and the median ratio of single pixels, as rows of a Markdown table.
// Run: build/release/bin/lucerna-noise-check SIDE RENDERS PASSES SCENE...
#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/support/local_render.h"
#include "tests/support/noise_study.h"

int main(int argc, char** argv) {
  using namespace lucerna;
  if (argc < 5) {
    std::fprintf(stderr, "usage: %s SIDE RENDERS PASSES SCENE...\n", argv[0]);
    return 2;
  }
  const NoiseStudySize size = {
      .side = std::atoi(argv[1]), .renders = std::atoi(argv[2]), .passes = std::atoi(argv[3])};
  std::printf("| scene | 1 | 2 | 3 | 4 | 5 | 6 | 7 | 8 | 9 | 10 | median of pixels |\n");
  std::printf("|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (int i = 4; i < argc; ++i) {
    const std::string path = argv[i];
    // The folder's name where there is one.
    const std::string folder = path.substr(0, path.rfind('/'));
    std::printf("| %s |", folder.substr(folder.rfind('/') + 1).c_str());
    std::string medians;
    double least = HUGE_VAL;
    double most = 0;
    for (const NoiseDecile& decile : StudyNoise(LoadScene(path), size)) {
      if (!(decile.layer > 0)) {
        std::printf(" black |");
        continue;
      }
      std::printf(" %.2f |", decile.Ratio());
      least = std::min(least, decile.median_ratio);
      most = std::max(most, decile.median_ratio);
    }
    std::printf(" %.2f to %.2f |\n", least, most);
    std::fflush(stdout);
  }
}
