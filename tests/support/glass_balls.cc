#include "tests/support/glass_balls.h"

#include <cstdint>
#include <string_view>
#include <vector>

#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

// The same ball in both scenes.
std::int32_t AddBall(Scene& scene, const Material& glass) {
  AddSphere(scene, {0, 0, 1.3F}, 1, AddMaterial(scene, glass));
  return AddMaterial(scene, DiffuseMaterial(0.7F));
}

}  // namespace

Scene FocusOfBall(const Material& glass) {
  Scene scene;
  const std::int32_t white = AddBall(scene, glass);
  AddQuad(scene, {-4, -4, 0}, {8, 0, 0}, {0, 8, 0}, white);
  scene.spot_lights.push_back({.position = {0, 0, 9},
                               .direction = {0, 0, -1},
                               .intensity = Gray(50),
                               .cos_falloff_start = 0.991F,
                               .cos_total_width = 0.99F});
  SetCamera(scene, {0, -6, 6}, {0, 0, 0}, {0, 0, 1}, 3, 12);
  return scene;
}

Scene WallThroughBall(const Material& glass) {
  Scene scene;
  const std::int32_t white = AddBall(scene, glass);
  AddQuad(scene, {-8, 4, -8}, {9, 0, 0}, {0, 0, 16}, white);
  AddQuad(scene, {1, 4, -8}, {7, 0, 0}, {0, 0, 16}, AddMaterial(scene, DiffuseMaterial(0)));
  scene.point_lights.push_back({.position = {0, 3, 6}, .intensity = Gray(50)});
  SetCamera(scene, {0, -6, 1.3}, {0, 0, 1.3}, {0, 0, 1}, 16, 32);
  return scene;
}

Halves HalvesOf(const Image& image) {
  constexpr std::array<std::string_view, 3> kChannels = {"R", "G", "B"};
  Halves halves{};
  for (std::size_t c = 0; c < 3; ++c) {
    const std::vector<float>& pixels = image.Find(kChannels[c])->pixels;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const auto width = static_cast<std::size_t>(image.width);
      halves[c + (i % width * 2 >= width ? 3 : 0)] +=
          static_cast<double>(pixels[i]) * 2 / static_cast<double>(pixels.size());
    }
  }
  return halves;
}

}  // namespace lucerna
