// How true is the error estimate?
//
// Renders every scene many times, small, and compares the estimate with the true error at every
// checkpoint: estimated over true, in how many renders the intervals held the truth at all
// checkpoints, and what comes of stopping on it. References are kept in a folder, so that a change
// of the estimate is judged in minutes.
// Run: build/release/bin/lucerna-error-check [--side N] [--renders N] [--passes N]
//        [--photons N] [--reference-passes N] [--reference-photons N] [--references DIR] SCENE...
// where photons are per pixel and pass.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "render/base/files.h"
#include "render/film/image_metrics.h"
#include "render/image/exr_file.h"
#include "tests/support/error_study.h"
#include "tests/support/local_render.h"

namespace lucerna {
namespace {

struct CheckOptions {
  StudySize size = {.side = 48, .renders = 8, .passes = 48};
  int reference_passes = 400;  // of each half
  int reference_photons = 10;  // per pixel and pass
  std::string references;      // folder; empty: none are kept
  std::vector<std::string> scenes;
};

// The scene's name: its file without folder and ending.
std::string NameOf(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  std::string name = slash == std::string::npos ? path : path.substr(slash + 1);
  return name.substr(0, name.rfind('.'));
}

Image ReferenceOf(const Scene& scene, const std::string& name, const CheckOptions& options) {
  const auto make = [&] {
    return HalvedReference(scene, options.size.side, options.reference_passes,
                           options.reference_photons);
  };
  if (options.references.empty()) return make();
  const std::string path = options.references + "/" + name + "-" +
                           std::to_string(options.size.side) + "-" +
                           std::to_string(options.reference_passes) + "x" +
                           std::to_string(options.reference_photons) + ".exr";
  if (const auto bytes = ReadFile(path); bytes.ok()) return DecodeExr(*bytes).value();
  Image reference = make();
  const Status written = WriteFile(path, EncodeExr(reference).value());
  if (!written.ok()) std::fprintf(stderr, "%s\n", std::string(written.message()).c_str());
  return reference;
}

// Of squared errors: the root, as a percentage.
double Percent(double square) {
  return 100 * std::sqrt(std::max(square, 0.0));
}

void PrintHead() {
  std::printf(
      "| scene | true %% | true noise, bias %% | estimated noise, bias %% | luminance bias: true, "
      "by kernels | estimated/true first, "
      "half-way, last | renders outside at any checkpoint | truth below, above (checkpoints) | "
      "width | stop: "
      "stopped, kept, spent |\n|---|---|---|---|---|---|---|---|---|---|\n");
}

void PrintRow(const std::string& name, const ErrorStudy& study) {
  const std::vector<double> ratios = study.Ratios();
  const std::size_t last = ratios.size() - 1;
  const std::size_t middle = last / 2;
  const double renders = static_cast<double>(study.renders.size());
  double truth = 0, middle_truth = 0, width = 0;
  int below = 0, above = 0;
  for (const std::vector<StudiedLook>& looks : study.renders) {
    const StudiedLook& end = looks[last];
    truth += end.truth / renders;
    middle_truth += looks[middle].truth / renders;
    width += std::sqrt(end.high / end.low) / renders;
    for (const StudiedLook& look : looks) {
      below += look.truth < look.low ? 1 : 0;
      above += look.truth > look.high ? 1 : 0;
    }
  }
  // A target that is there to be reached.
  const StopOutcome stop = StopAt(study, std::sqrt(middle_truth));
  const StudiedParts& parts = study.parts;
  std::printf(
      "| %s | %.2f | %.2f, %.2f | %.2f, %.2f | %.2f, %.2f | %.2f, %.2f, %.2f | %d of %zu | %d, %d "
      "| "
      "%.2f | %d, %d, %.2f |\n",
      name.c_str(), Percent(truth), Percent(parts.true_noise), Percent(parts.true_bias),
      Percent(parts.estimated_noise), Percent(parts.estimated_bias),
      Percent(parts.true_luminance_bias), Percent(parts.kernel_bias), ratios.front(),
      ratios[middle], ratios[last], static_cast<int>(study.renders.size()) - study.Covered(),
      study.renders.size(), below, above, width, stop.stopped, stop.kept, stop.mean_spent);
  std::fflush(stdout);
}

int Run(const CheckOptions& options) {
  PrintHead();
  int outside = 0, renders = 0, ratios_off = 0, ratios = 0;
  for (const std::string& path : options.scenes) {
    const Scene scene = LoadScene(path);
    const std::string name = NameOf(path);
    const Image reference = ReferenceOf(scene, name, options);
    const ErrorStudy study = StudyErrors(scene, reference, options.size);
    PrintRow(name, study);
    renders += static_cast<int>(study.renders.size());
    outside += static_cast<int>(study.renders.size()) - study.Covered();
    for (const double ratio : study.Ratios()) {
      ++ratios;
      ratios_off += ratio >= 0.8 && ratio <= 1.25 ? 0 : 1;
    }
  }
  std::printf(
      "\nintervals held the truth at all checkpoints in %d of %d renders; estimated/true "
      "within 0.8 to 1.25 at %d of %d checkpoints\n",
      renders - outside, renders, ratios - ratios_off, ratios);
  return 0;
}

}  // namespace
}  // namespace lucerna

int main(int argc, char** argv) {
  lucerna::CheckOptions options;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (!argument.starts_with("--")) {
      options.scenes.push_back(argument);
      continue;
    }
    const std::string value = i + 1 < argc ? argv[++i] : "";
    const int number = std::atoi(value.c_str());
    if (argument == "--references") {
      options.references = value;
      continue;
    }
    int* const target = argument == "--side"                ? &options.size.side
                        : argument == "--renders"           ? &options.size.renders
                        : argument == "--passes"            ? &options.size.passes
                        : argument == "--photons"           ? &options.size.photons_per_pixel
                        : argument == "--reference-passes"  ? &options.reference_passes
                        : argument == "--reference-photons" ? &options.reference_photons
                                                            : nullptr;
    if (target == nullptr || number < 1) {
      std::fprintf(stderr, "%s %s: not understood\n", argument.c_str(), value.c_str());
      return 2;
    }
    *target = number;
  }
  if (options.scenes.empty()) {
    std::fprintf(stderr, "usage: %s [options] SCENE...; see the head of its source\n", argv[0]);
    return 2;
  }
  return lucerna::Run(options);
}
