// What colour, or which number, has a surface at a place of its texture?
//
// A kind of texture is one row of LUCERNA_TEXTURES, with its numbers below where there are none for
// them yet, and three files: lookup in render/scene/texture_NAME.cc, how pbrt files give it in
// render/formats/pbrt/texture_NAME.cc, and its detail in worker/texture_detail_NAME.cc
// (docs/adding.md). Functions that differ between kinds are declared from the rows, here, in
// formats/pbrt/texture_readers.h and in worker/texture_detail.h. Colours are linear Rec. 709, as
// everything in a Scene. Textures of numbers have three equal channels, which may have any sign and
// size. v points upwards, while row 0 of a picture is its top.
//
// Looking up is plain float arithmetic: the same bits on every machine of one numeric profile.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "render/math/rgb.h"
#include "render/math/transform.h"
#include "render/math/vector.h"

// The kinds of texture, in the order of Texture::Kind.
// ROW(Name, name): Texture::Kind::kName, and its name in pbrt files.
#define LUCERNA_TEXTURES(ROW)         \
  ROW(Picture, "imagemap")            \
  ROW(Constant, "constant")           \
  ROW(Scaled, "scale")                \
  ROW(Checkerboard, "checkerboard")   \
  ROW(Mixed, "mix")                   \
  ROW(DirectionMixed, "directionmix") \
  ROW(Bilinear, "bilerp")             \
  ROW(Dots, "dots")                   \
  ROW(Fbm, "fbm")                     \
  ROW(Wrinkled, "wrinkled")           \
  ROW(Windy, "windy")                 \
  ROW(Marble, "marble")               \
  ROW(VertexColor, "vertexcolor")

namespace lucerna {

// The pixels that a file brings. Those of 8-bit files stay bytes, and a table says what they mean.
struct Picture {
  int width = 0, height = 0;  // [pixels], at least 1
  int channels = 3;           // 3, or 1: grey
  // One of the two holds [height × width × channels] values; those of `linear` are finite, and of
  // colours >= 0.
  std::vector<std::uint8_t> coded;
  std::vector<float> linear;
  std::array<float, 256> decoded{};  // what a byte of `coded` is, in [0, 1]

  // Requires a pixel of the picture.
  [[nodiscard]] Rgb At(int x, int y) const {
    const std::size_t first = (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                               static_cast<std::size_t>(x)) *
                              static_cast<std::size_t>(channels);
    const auto value = [&](std::size_t i) {
      return linear.empty() ? decoded[coded[first + i]] : linear[first + i];
    };
    return channels == 1 ? Gray(value(0)) : Rgb{value(0), value(1), value(2)};
  }
  // The largest and the smallest value of any channel.
  [[nodiscard]] float Largest() const;
  [[nodiscard]] float Smallest() const;
};

// A place on a surface.
struct TexturePlace {
  Vec2 uv;
  Vec3 position;                 // world
  Vec3 normal;                   // world, geometric, unit
  Rgb vertex_color = {1, 1, 1};  // between the vertices of a mesh that has colours
};

// From a place to a texture's own coordinates, as in pbrt-v4.
struct TextureMapping {
  enum class Kind : std::uint8_t {
    kUv,           // (scale_u · u + delta_u, scale_v · v + delta_v)
    kUvAffine,     // (axis_u · (u, v, 0) + delta_u, axis_v · (u, v, 0) + delta_v)
    kPlanar,       // (axis_u · p + delta_u, axis_v · p + delta_v)
    kSpherical,    // p's angle from +z over π, and around z over 2π
    kCylindrical,  // p's angle around z from -x over 2π, and its z
  };

  float scale_u = 1, scale_v = 1, delta_u = 0, delta_v = 0;
  Kind kind = Kind::kUv;
  Vec3 axis_u = {1, 0, 0}, axis_v = {0, 1, 0};
  Transform from_world;  // to the space of p, and of textures in space

  // Returns 0 for a coordinate so far from the origin that neighbouring floats there are more than
  // a texture apart, or that is no number; every result fits into an int.
  [[nodiscard]] Vec2 Map(const TexturePlace& place) const;
  // The same for a place in space.
  [[nodiscard]] Vec3 MapToSpace(const TexturePlace& place) const;
  // Whether it follows from u and v alone.
  [[nodiscard]] bool IsOfUv() const { return kind == Kind::kUv || kind == Kind::kUvAffine; }

  bool operator==(const TextureMapping&) const = default;
};

// Only the members that the kind names are meaningful.
struct Texture {
#define LUCERNA_KIND(Name, name) k##Name,
  enum class Kind : std::uint8_t { LUCERNA_TEXTURES(LUCERNA_KIND) };
#undef LUCERNA_KIND
  enum class Wrap : std::uint8_t { kRepeat, kClamp, kBlack, kMirror };

  Kind kind = Kind::kConstant;
  // Picture: what lies beyond its edges, along u and along v.
  Wrap wrap_u = Wrap::kRepeat, wrap_v = Wrap::kRepeat;
  bool is_inverted = false;  // picture: 1 - colour, after `scale`
  bool is_number = false;    // picture: numbers, which are not held in [0, 1]
  bool is_in_space = false;  // checkerboard: of cubes
  bool is_nearest = false;   // picture: not interpolated, but the nearest pixel
  Rgb color;                 // constant
  Rgb tint = {1, 1, 1};      // picture of colours: the factor of each channel, beside `scale`
  float scale = 1;           // picture, scaled, marble
  TextureMapping mapping;
  // Numbers of other textures, below its own. Scaled: of what is scaled, and of the numbers by
  // which, or none. Checkerboard: where the sum of the whole parts of the coordinates is even, and
  // where it is odd. Mixed: the first, the second, and the share of the second. Direction-mixed:
  // along the direction, and across it. Bilinear: at (0, 0), (0, 1), (1, 0) and (1, 1). Dots: in
  // dots, and between them. Vertex colour: what the colour between the vertices is multiplied by,
  // or none.
  std::array<std::int32_t, 4> parts = {-1, -1, -1, -1};
  Vec3 direction = {0, 1, 0};  // direction-mixed: world, unit
  std::int32_t octaves = 8;    // of noise
  float roughness = 0.5F;      // of noise: the amplitude of an octave over that of the one before
  float variation = 0.2F;      // marble
  std::shared_ptr<const Picture> picture;
};

inline constexpr std::int32_t kNoTexture = -1;

// A picture at (u, v), interpolated between the centres of its four nearest pixels.
[[nodiscard]] Rgb PictureColor(const Picture& picture, Vec2 uv, Texture::Wrap wrap_u,
                               Texture::Wrap wrap_v);
// The pixel of a column, or row, of which there are `count`, that continues a picture beyond its
// edges; -1 where all is black.
[[nodiscard]] int WrappedIndex(int index, int count, Texture::Wrap wrap);

// What each kind of texture is at a place. `textures` are those of the scene, of which its parts
// are some.
#define LUCERNA_DECLARE(Name, name)                                                         \
  [[nodiscard]] Rgb LookUp##Name(std::span<const Texture> textures, const Texture& texture, \
                                 const TexturePlace& place);
LUCERNA_TEXTURES(LUCERNA_DECLARE)
#undef LUCERNA_DECLARE

// The colour of texture `number`, in [0, 1]. Pictures are interpolated between the centres of their
// four nearest pixels.
[[nodiscard]] Rgb TextureColor(std::span<const Texture> textures, std::int32_t number,
                               const TexturePlace& place);
// The number that texture `number` of numbers has there: finite.
[[nodiscard]] float TextureNumber(std::span<const Texture> textures, std::int32_t number,
                                  const TexturePlace& place);
// By how much to shift a place along u and v for the slope of a texture of numbers: a quarter of
// the smallest pixel of the pictures that it is made of, at most pbrt-v4's 0.0005.
[[nodiscard]] Vec2 SlopeStep(std::span<const Texture> textures, std::int32_t number);

}  // namespace lucerna
