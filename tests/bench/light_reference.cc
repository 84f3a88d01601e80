// A reference image without the kernel's blur (tests/support/light_tracer.h), with its noise.
//
// Run: build/release/bin/lucerna-light-reference SCENE WIDTHxHEIGHT PHOTONS_PER_PIXEL PASSES OUT
//
// OUT is an EXR file; PASSES are those of either half.
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "render/base/files.h"
#include "render/film/reference.h"
#include "render/formats/read_scene.h"
#include "render/image/exr_file.h"
#include "render/scene/scene_files.h"
#include "tests/support/light_tracer.h"
#include "tests/support/local_render.h"

namespace lucerna {
namespace {

// Of all references of the convergence study.
constexpr std::uint64_t kSeed = 1000003;
// First radius of pixels that are not traced.
constexpr double kFootprints = 0.5;

void Main(const std::string& path, int width, int height, int photons, int passes,
          const std::string& out) {
  const std::size_t slash = path.rfind('/');
  DirectoryFiles files(slash == std::string::npos ? "." : path.substr(0, slash));
  const std::string main = path.substr(slash + 1);
  const ParsedScene parsed = ReadScene(files, main);
  LUCERNA_CHECK(parsed.ok());
  RenderOverrides overrides;
  overrides.width = width;
  overrides.height = height;
  overrides.photons_per_pass = std::int64_t{photons} * width * height;
  overrides.initial_footprints = kFootprints;
  std::vector<Image> halves;
  for (const std::uint64_t seed : SeedsOfHalves(kSeed)) {
    overrides.seed = seed;
    LightTracedImage half = TraceLight(parsed.scene, SettingsFor(parsed.scene, overrides), passes);
    std::printf("seed %llu: %zu of %d pixels by light tracing\n",
                static_cast<unsigned long long>(seed), half.traced_pixels, width * height);
    half.image.metadata = {{"lucerna.scene_digest", files.Manifest(main).SceneDigest().Hex()},
                           {"lucerna.seed", std::to_string(seed)},
                           {"lucerna.passes", std::to_string(passes)},
                           {"lucerna.photons", std::to_string(half.photons)}};
    halves.push_back(std::move(half.image));
  }
  Image reference = MakeReference(halves[0], halves[1]).value();
  LUCERNA_CHECK(WriteFile(out, EncodeExr(reference).value()).ok());
  std::printf("squared noise %s, without the worst thousandth of the pixels %s\n",
              reference.metadata["lucerna.reference.rel_mse"].c_str(),
              reference.metadata["lucerna.reference.rel_mse_trimmed"].c_str());
}

}  // namespace
}  // namespace lucerna

int main(int argc, char** argv) {
  int width = 0;
  int height = 0;
  if (argc != 6 || std::sscanf(argv[2], "%dx%d", &width, &height) != 2) {
    std::fprintf(stderr, "usage: %s SCENE WIDTHxHEIGHT PHOTONS_PER_PIXEL PASSES OUT\n", argv[0]);
    return 2;
  }
  lucerna::Main(argv[1], width, height, std::atoi(argv[3]), std::atoi(argv[4]), argv[5]);
  return 0;
}
