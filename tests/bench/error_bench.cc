// How true is the error estimate?
//
// Renders a scene many times, small, and prints how the estimate compares with the true error at
// every look, in how many renders the intervals held it at all looks, and what comes of stopping
// on it.
// Run: build/release/bin/lucerna-error-check SCENE [side [renders [passes]]]
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "tests/support/error_study.h"
#include "tests/support/local_render.h"

int main(int argc, char** argv) {
  using namespace lucerna;
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s SCENE [side [renders [passes]]]\n", argv[0]);
    return 2;
  }
  StudySize size;
  if (argc > 2) size.side = std::atoi(argv[2]);
  if (argc > 3) size.renders = std::atoi(argv[3]);
  if (argc > 4) size.passes = std::atoi(argv[4]);
  const Scene scene = LoadScene(argv[1]);
  const ErrorStudy study = StudyErrors(scene, StudyReference(scene, size.side), size);

  std::printf("%s, %d x %d, %d renders\nintervals held the truth at all looks: %d\n", argv[1],
              size.side, size.side, size.renders, study.Covered());
  const std::vector<double> ratios = study.Ratios();
  std::printf("| passes | true error | estimated over true | upper end over true |\n");
  std::vector<double> truths;
  for (std::size_t look = 0; look < ratios.size(); ++look) {
    double truth = 0;
    double high = 0;
    for (const std::vector<StudiedLook>& looks : study.renders) {
      truth += looks[look].truth / size.renders;
      high += std::sqrt(looks[look].high / looks[look].truth) / size.renders;
    }
    truths.push_back(std::sqrt(truth));
    std::printf("| %d | %.4f | %.2f | %.2f |\n", study.renders.front()[look].passes, truths.back(),
                ratios[look], high);
  }
  // A target that is there to be reached: what was true after a third of the passes.
  for (std::size_t look = 0; look < truths.size(); ++look) {
    if (study.renders.front()[look].passes * 3 < size.passes) continue;
    const StopOutcome outcome = StopAt(study, truths[look]);
    std::printf(
        "stop at %.4f: %d stopped, %d of them at or below it; spent %.2f times the photons "
        "needed, %d at most twice\n",
        outcome.target, outcome.stopped, outcome.kept, outcome.mean_spent, outcome.within_two);
    break;
  }
}
