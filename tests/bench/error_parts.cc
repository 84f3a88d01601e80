// How much of a render's error is bias, how much is noise, and where?
//
// Renders that differ by their seeds alone have errors whose products, of one render with another,
// are bias only; what the renders differ by is noise. Two independent references keep the noise of
// the references out of the products. Pixels fall in three classes by what the camera sees first:
// smooth glass or metal; a surface within three footprints of a feature edge (the corner band);
// and the rest.
// Run: build/release/bin/lucerna-error-parts SCENE REFERENCE1.exr REFERENCE2.exr A.exr B.exr [...]
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>
#include <vector>

#include "render/base/files.h"
#include "render/geometry/feature_edges.h"
#include "render/geometry/intersector.h"
#include "render/image/exr_file.h"
#include "tests/support/local_render.h"

namespace lucerna {
namespace {

enum Class : std::uint8_t { kCorner, kGlass, kRest, kClasses };
constexpr std::array<const char*, kClasses + 1> kNames = {"corner band", "on glass", "rest", "all"};
constexpr float kFootprints = 3;
// Of the pixels of a class; one in a thousand of the greatest errors is left out in the second
// table.
constexpr double kTrim = 0.001;

Image ReadImage(const char* path) {
  StatusOr<std::string> bytes = ReadFile(path);
  LUCERNA_CHECK(bytes.ok());
  StatusOr<Image> image = DecodeExr(*bytes);
  LUCERNA_CHECK(image.ok());
  return *std::move(image);
}

std::vector<double> Luminances(const Image& image) {
  const auto* r = image.Find("R");
  const auto* g = image.Find("G");
  const auto* b = image.Find("B");
  LUCERNA_CHECK(r != nullptr && g != nullptr && b != nullptr);
  std::vector<double> out;
  for (std::size_t i = 0; i < r->pixels.size(); ++i) {
    out.push_back(0.2126 * static_cast<double>(r->pixels[i]) +
                  0.7152 * static_cast<double>(g->pixels[i]) +
                  0.0722 * static_cast<double>(b->pixels[i]));
  }
  return out;
}

// By the middle of each pixel and its corners: the first that is not kRest.
std::vector<Class> ClassesOf(const Scene& scene, int width, int height) {
  auto intersector = Intersector::Create(scene);
  LUCERNA_CHECK(intersector.ok());
  const FeatureEdges features(scene);
  const Window window = ScreenWindow(scene.camera, width, height);
  const double step = (window.high_x - window.low_x) / width;
  const Vec3 eye = scene.camera.camera_to_world.Point({});
  const auto class_at = [&](double x, double y) {
    const Vec3 ahead = {static_cast<float>(window.low_x + x * step),
                        static_cast<float>(window.high_y - y * step), 1};
    const Ray ray = {eye, Normalize(scene.camera.camera_to_world.Vector(ahead))};
    Hit hit;
    if (!(*intersector)->Intersect(ray, hit)) return kRest;
    const SurfacePoint point = (*intersector)->SurfaceAt(ray, hit);
    const Material& material = scene.materials[point.material];
    if (point.area_light != kNoAreaLight) return kRest;
    if (!Gathers(material)) return ScattersNothing(material) ? kRest : kGlass;
    const float reach = kFootprints * static_cast<float>(step) * hit.t / Length(ahead);
    return features.HasNear(point.position, reach) ? kCorner : kRest;
  };
  std::vector<Class> classes;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      Class worst = class_at(x + 0.5, y + 0.5);
      for (const auto& [dx, dy] : {std::pair(0.0, 0.0), {1.0, 0.0}, {0.0, 1.0}, {1.0, 1.0}}) {
        const Class at = class_at(x + dx, y + dy);
        if (worst == kRest || at == kGlass) worst = std::min(worst, at);
      }
      classes.push_back(worst);
    }
  }
  return classes;
}

struct Parts {
  double pixels = 0;
  double bias = 0, noise = 0;        // sums of squares, relative
  double value = 0, difference = 0;  // sums
};

int Main(int argc, char** argv) {
  if (argc < 6) {
    std::fprintf(stderr, "usage: %s SCENE REFERENCE1.exr REFERENCE2.exr A.exr B.exr [...]\n",
                 argv[0]);
    return 2;
  }
  const Scene scene = LoadScene(argv[1]);
  const Image first = ReadImage(argv[2]);
  const std::array<std::vector<double>, 2> reference = {Luminances(first),
                                                        Luminances(ReadImage(argv[3]))};
  std::vector<std::vector<double>> renders;
  for (int i = 4; i < argc; ++i)
    renders.push_back(Luminances(ReadImage(argv[i])));
  const std::size_t pixels = reference[0].size();
  for (const auto& render : renders)
    LUCERNA_CHECK(render.size() == pixels);
  const std::vector<Class> classes = ClassesOf(scene, first.width, first.height);

  std::vector<double> truth(pixels);
  for (std::size_t i = 0; i < pixels; ++i)
    truth[i] = (reference[0][i] + reference[1][i]) / 2;
  const double mean =
      std::accumulate(truth.begin(), truth.end(), 0.0) / static_cast<double>(pixels);
  const double floor = 0.01 * mean * mean;
  std::vector<Parts> of_pixel(pixels);
  std::vector<double> error(pixels);
  const auto n = static_cast<double>(renders.size());
  for (std::size_t i = 0; i < pixels; ++i) {
    Parts& part = of_pixel[i];
    const double scale = 1 / (truth[i] * truth[i] + floor);
    double one = 0;
    double other = 0;
    double product = 0;
    double squares = 0;
    double sum = 0;
    for (const auto& render : renders) {
      const double a = render[i] - reference[0][i];
      const double b = render[i] - reference[1][i];
      one += a;
      other += b;
      product += a * b;
      sum += render[i];
      squares += render[i] * render[i];
      error[i] += scale * (render[i] - truth[i]) * (render[i] - truth[i]) / n;
    }
    part = {1, scale * (one * other - product) / (n * (n - 1)),
            scale * (squares - sum * sum / n) / (n - 1), truth[i], sum / n - truth[i]};
  }
  for (const double trim : {0.0, kTrim}) {
    std::vector<std::size_t> order(pixels);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::sort(order, [&](std::size_t a, std::size_t b) { return error[a] < error[b]; });
    order.resize(pixels - static_cast<std::size_t>(trim * static_cast<double>(pixels)));
    std::array<Parts, kClasses + 1> parts = {};
    for (const std::size_t i : order) {
      for (const std::size_t c : {static_cast<std::size_t>(classes[i]), std::size_t{kClasses}}) {
        parts[c].pixels += 1;
        parts[c].bias += of_pixel[i].bias;
        parts[c].noise += of_pixel[i].noise;
        parts[c].value += of_pixel[i].value;
        parts[c].difference += of_pixel[i].difference;
      }
    }
    std::printf("\nwithout the worst %g %% of the pixels; parts of the relMSE of the image:\n\n",
                100 * trim);
    std::printf("| class | pixels %% | bias | noise | mean off by %% |\n|---|---|---|---|---|\n");
    for (std::size_t c = 0; c <= kClasses; ++c) {
      const double all = parts[kClasses].pixels;
      std::printf("| %s | %.1f | %.3e | %.3e | %+.3f |\n", kNames[c], 100 * parts[c].pixels / all,
                  parts[c].bias / all, parts[c].noise / all,
                  100 * parts[c].difference / parts[c].value);
    }
  }
  return 0;
}

}  // namespace
}  // namespace lucerna

int main(int argc, char** argv) {
  return lucerna::Main(argc, argv);
}
