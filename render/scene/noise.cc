#include "render/scene/noise.h"

#include <array>
#include <cmath>
#include <cstdint>

namespace lucerna {
namespace {

// A permutation of 0 to 255: Perlin's.
constexpr std::array<std::uint8_t, 256> kPermutation = {
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103,
    30,  69,  142, 8,   99,  37,  240, 21,  10,  23,  190, 6,   148, 247, 120, 234, 75,  0,   26,
    197, 62,  94,  252, 219, 203, 117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174,
    20,  125, 136, 171, 168, 68,  175, 74,  165, 71,  134, 139, 48,  27,  166, 77,  146, 158, 231,
    83,  111, 229, 122, 60,  211, 133, 230, 220, 105, 92,  41,  55,  46,  245, 40,  244, 102, 143,
    54,  65,  25,  63,  161, 1,   216, 80,  73,  209, 76,  132, 187, 208, 89,  18,  169, 200, 196,
    135, 130, 116, 188, 159, 86,  164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250, 124,
    123, 5,   202, 38,  147, 118, 126, 255, 82,  85,  212, 207, 206, 59,  227, 47,  16,  58,  17,
    182, 189, 28,  42,  223, 183, 170, 213, 119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101,
    155, 167, 43,  172, 9,   129, 22,  39,  253, 19,  98,  108, 110, 79,  113, 224, 232, 178, 185,
    112, 104, 218, 246, 97,  228, 251, 34,  242, 193, 238, 210, 144, 12,  191, 179, 162, 241, 81,
    51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,  181, 199, 106, 157, 184, 84,  204, 176,
    115, 121, 50,  45,  127, 4,   150, 254, 138, 236, 205, 93,  222, 114, 67,  29,  24,  72,  243,
    141, 128, 195, 78,  66,  215, 61,  156, 180};
// Of the features of an octave over those of the next; not 2, so that lattices do not coincide.
constexpr float kLacunarity = 1.99F;

int Permuted(int i) {
  return kPermutation[static_cast<std::size_t>(i & 255)];
}

// The height at (x, y, z) from a corner of the lattice of the plane that slopes there towards one
// of the edges of a cube: pbrt-v4's sixteen choices, which differ from Perlin's in four.
float SlopeAt(int corner_x, int corner_y, int corner_z, float x, float y, float z) {
  const int edge = Permuted(Permuted(Permuted(corner_x) + corner_y) + corner_z) & 15;
  const float u = edge < 8 || edge == 12 || edge == 13 ? x : y;
  const float v = edge < 4 || edge == 12 || edge == 13 ? y : z;
  return ((edge & 1) != 0 ? -u : u) + ((edge & 2) != 0 ? -v : v);
}

float Smoothed(float t) {
  return t * t * t * (t * (t * 6 - 15) + 10);
}

float Between(float t, float a, float b) {
  return (1 - t) * a + t * b;
}

template <typename Octave>
float SumOfOctaves(Vec3 p, float omega, int octaves, float& amplitude, const Octave& octave) {
  float sum = 0;
  float frequency = 1;
  amplitude = 1;
  for (int i = 0; i < octaves; ++i) {
    sum += amplitude * octave(NoiseAt(p * frequency));
    frequency *= kLacunarity;
    amplitude *= omega;
  }
  return sum;
}

}  // namespace

float NoiseAt(Vec3 p) {
  // Octaves may leave the range of whole numbers.
  constexpr float kFarthest = 0x1p30F;
  const auto place = [](float coordinate, int& cell) {
    const float within = std::fmod(coordinate, kFarthest);
    const float below = std::floor(within);
    cell = static_cast<int>(below);
    return within - below;
  };
  int i = 0;
  int j = 0;
  int k = 0;
  const float x = place(p.x, i);
  const float y = place(p.y, j);
  const float z = place(p.z, k);
  const float wx = Smoothed(x);
  const float wy = Smoothed(y);
  const auto along_x = [&](int dj, int dk) {
    const float below_y = y - static_cast<float>(dj);
    const float below_z = z - static_cast<float>(dk);
    return Between(wx, SlopeAt(i, j + dj, k + dk, x, below_y, below_z),
                   SlopeAt(i + 1, j + dj, k + dk, x - 1, below_y, below_z));
  };
  return Between(Smoothed(z), Between(wy, along_x(0, 0), along_x(1, 0)),
                 Between(wy, along_x(0, 1), along_x(1, 1)));
}

float FbmAt(Vec3 p, float omega, int octaves) {
  float amplitude = 1;
  return SumOfOctaves(p, omega, octaves, amplitude, [](float noise) { return noise; });
}

float TurbulenceAt(Vec3 p, float omega, int octaves) {
  constexpr float kMeanAbsolute = 0.2F;
  float amplitude = 1;
  const float sum =
      SumOfOctaves(p, omega, octaves, amplitude, [](float noise) { return std::abs(noise); });
  return sum + amplitude * kMeanAbsolute;
}

}  // namespace lucerna
