// What colour has a surface at a place of its texture?
//
// A kind of texture is one row of LUCERNA_TEXTURES, with its numbers below where there are none for
// them yet, and three files: lookup in render/scene/texture_NAME.cc, how pbrt files give it in
// render/formats/pbrt/texture_NAME.cc, and its detail in worker/texture_detail_NAME.cc
// (docs/adding.md). Functions that differ between kinds are declared from the rows, here, in
// formats/pbrt/texture_readers.h and in worker/texture_detail.h. Colours are linear Rec. 709, as
// everything in a Scene. A place is (u, v), with v upwards, while row 0 of a picture is its top.
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
#include "render/math/vector.h"

// The kinds of texture, in the order of Texture::Kind.
// ROW(Name, name): Texture::Kind::kName, and its name in pbrt files.
#define LUCERNA_TEXTURES(ROW) \
  ROW(Picture, "imagemap")    \
  ROW(Constant, "constant")   \
  ROW(Scaled, "scale")        \
  ROW(Checkerboard, "checkerboard")

namespace lucerna {

// The pixels that a file brings. Those of 8-bit files stay bytes, and a table says what they mean.
struct Picture {
  int width = 0, height = 0;  // [pixels], at least 1
  int channels = 3;           // 3, or 1: grey
  // One of the two holds [height × width × channels] values; those of `linear` are finite, >= 0.
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
  // The largest value of any channel.
  [[nodiscard]] float Largest() const;
};

// (u, v) -> (scale_u · u + delta_u, scale_v · v + delta_v).
struct UvMapping {
  float scale_u = 1, scale_v = 1, delta_u = 0, delta_v = 0;

  // Returns 0 for a coordinate so far from the origin that neighbouring floats there are more than
  // a texture apart, or that is no number; every result fits into an int.
  [[nodiscard]] Vec2 Map(Vec2 uv) const;

  bool operator==(const UvMapping&) const = default;
};

// Only the members that the kind names are meaningful.
struct Texture {
#define LUCERNA_KIND(Name, name) k##Name,
  enum class Kind : std::uint8_t { LUCERNA_TEXTURES(LUCERNA_KIND) };
#undef LUCERNA_KIND
  enum class Wrap : std::uint8_t { kRepeat, kClamp, kBlack };

  Kind kind = Kind::kConstant;
  Wrap wrap = Wrap::kRepeat;  // picture: what lies beyond its edges
  bool is_inverted = false;   // picture: 1 - colour, after `scale`
  Rgb color;                  // constant, in [0, 1]
  float scale = 1;            // picture, scaled; >= 0
  UvMapping mapping;          // picture, checkerboard
  // Numbers of other textures, below its own: of what is scaled, or of the squares where
  // floor(u) + floor(v) is even and where it is odd.
  std::array<std::int32_t, 2> parts = {-1, -1};
  std::shared_ptr<const Picture> picture;
};

inline constexpr std::int32_t kNoTexture = -1;

// What one kind of texture makes of a lookup: a colour in [0, 1], or that of another texture times
// a factor.
struct TextureStep {
  std::int32_t next = kNoTexture;  // the other texture
  float factor = 1;
  Rgb color;

  // The colour, each channel held in [0, 1].
  [[nodiscard]] static TextureStep To(Rgb color);
};

#define LUCERNA_DECLARE(Name, name) \
  [[nodiscard]] TextureStep LookUp##Name(const Texture& texture, Vec2 uv);
LUCERNA_TEXTURES(LUCERNA_DECLARE)
#undef LUCERNA_DECLARE

// The colour of texture `number` at `uv`, in [0, 1]. Pictures are interpolated between the centres
// of their four nearest pixels.
[[nodiscard]] Rgb TextureColor(std::span<const Texture> textures, std::int32_t number, Vec2 uv);

}  // namespace lucerna
