// A reference image without the kernel's blur, with its noise.
//
// Run: build/release/bin/lucerna-unblurred-reference SCENE WIDTHxHEIGHT OUT METHOD
//
// OUT is an EXR file. METHOD is one of
//   closed-form                      tests/support/closed_form_render.h: no noise
//   light PHOTONS_PER_PIXEL PASSES   tests/support/light_tracer.h
//   fine PHOTONS_PER_PIXEL PASSES    tests/support/fine_render.h: a blur of an eighth of a pixel
// PASSES are those of either half, and PHOTONS_PER_PIXEL those of a pass.
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "render/base/files.h"
#include "render/film/reference.h"
#include "render/formats/read_scene.h"
#include "render/image/exr_file.h"
#include "render/scene/scene_files.h"
#include "tests/support/closed_form_render.h"
#include "tests/support/fine_render.h"
#include "tests/support/light_tracer.h"
#include "tests/support/local_render.h"

namespace lucerna {
namespace {

// Of all references of the convergence study.
constexpr std::uint64_t kSeed = 1000003;
// First radius of pixels that are not traced.
constexpr double kFootprints = 0.5;
constexpr int kSmallPixels = 8;  // along the side of a pixel

struct Request {
  std::string scene, out;
  std::string_view method;
  int width = 0, height = 0;
  int photons = 0, passes = 0;
};

struct Half {
  Image image;
  std::uint64_t photons = 0;
};

Half Render(const Request& request, const Scene& scene, RenderOverrides overrides) {
  const auto photons = static_cast<std::uint64_t>(overrides.photons_per_pass.value_or(0));
  if (request.method == "closed-form")
    return {RenderClosedForm(scene, SettingsFor(scene, overrides)), 0};
  if (request.method == "fine") {
    return {RenderFinely(scene, overrides, kSmallPixels, request.passes),
            photons * static_cast<std::uint64_t>(request.passes)};
  }
  overrides.initial_footprints = kFootprints;
  LightTracedImage traced = TraceLight(scene, SettingsFor(scene, overrides), request.passes);
  std::printf("%zu of %d pixels by light tracing\n", traced.traced_pixels,
              request.width * request.height);
  return {std::move(traced.image), traced.photons};
}

void Main(const Request& request) {
  const std::size_t slash = request.scene.rfind('/');
  DirectoryFiles files(slash == std::string::npos ? "." : request.scene.substr(0, slash));
  const std::string main = request.scene.substr(slash + 1);
  const ParsedScene parsed = ReadScene(files, main);
  LUCERNA_CHECK(parsed.ok());
  RenderOverrides overrides;
  overrides.width = request.width;
  overrides.height = request.height;
  if (request.photons > 0)
    overrides.photons_per_pass = std::int64_t{request.photons} * request.width * request.height;
  std::vector<Image> halves;
  for (const std::uint64_t seed : SeedsOfHalves(kSeed)) {
    overrides.seed = seed;
    Half half = Render(request, parsed.scene, overrides);
    half.image.metadata = {{"lucerna.scene_digest", files.Manifest(main).SceneDigest().Hex()},
                           {"lucerna.seed", std::to_string(seed)},
                           {"lucerna.passes", std::to_string(request.passes)},
                           {"lucerna.photons", std::to_string(half.photons)}};
    halves.push_back(std::move(half.image));
  }
  Image reference = MakeReference(halves[0], halves[1]).value();
  LUCERNA_CHECK(WriteFile(request.out, EncodeExr(reference).value()).ok());
  std::printf("squared noise %s, without the worst thousandth of the pixels %s\n",
              reference.metadata["lucerna.reference.rel_mse"].c_str(),
              reference.metadata["lucerna.reference.rel_mse_trimmed"].c_str());
}

// Whether the arguments are as said above.
bool Read(int argc, char** argv, Request& request) {
  if (argc < 5) return false;
  request.scene = argv[1];
  request.out = argv[3];
  request.method = argv[4];
  if (std::sscanf(argv[2], "%dx%d", &request.width, &request.height) != 2) return false;
  if (request.method == "closed-form") return argc == 5;
  if ((request.method != "light" && request.method != "fine") || argc != 7) return false;
  request.photons = std::atoi(argv[5]);
  request.passes = std::atoi(argv[6]);
  return request.photons > 0 && request.passes > 0;
}

}  // namespace
}  // namespace lucerna

int main(int argc, char** argv) {
  lucerna::Request request;
  if (!lucerna::Read(argc, argv, request)) {
    std::fprintf(stderr,
                 "usage: %s SCENE WIDTHxHEIGHT OUT closed-form | (light | fine) "
                 "PHOTONS_PER_PIXEL PASSES\n",
                 argv[0]);
    return 2;
  }
  lucerna::Main(request);
  return 0;
}
