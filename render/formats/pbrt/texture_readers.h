// The readers of each kind of texture, defined in texture_NAME.cc, and what they share.
//
// A reader adds to `textures` what the texture is made of. Readers read textures of colours and of
// numbers alike, unless they say that there is only one of the two.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "render/formats/asset_reader.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/formats/pbrt/textures.h"
#include "render/math/transform.h"
#include "render/scene/texture.h"

namespace lucerna {

// What the readers of all kinds of texture are given.
struct TextureInput {
  ParameterList& parameters;
  const DeclaredTextures& declared;
  bool is_number;
  const Transform& to_world;
  AssetReader& assets;
  std::vector<Texture>& textures;
};

#define LUCERNA_DECLARE(Name, name) \
  [[nodiscard]] NamedTexture Read##Name##Texture(const TextureInput& input);
LUCERNA_TEXTURES(LUCERNA_DECLARE)
#undef LUCERNA_DECLARE

// The values between which a texture's are.
struct ValueRange {
  float least = 0, largest = 1;

  // The smallest range with all products of one of each.
  [[nodiscard]] ValueRange operator*(const ValueRange& other) const;
  // The smallest one with both.
  [[nodiscard]] ValueRange Joined(const ValueRange& other) const;
};
[[nodiscard]] ValueRange RangeOf(const NamedTexture& texture);

// A texture that is an error where something uses it.
[[nodiscard]] NamedTexture UnusableTexture(std::string why_not);
// The same of one whose directive has an error.
[[nodiscard]] NamedTexture FaultyTexture();
// Gives `texture`, which is made of `parts`, the next number.
[[nodiscard]] NamedTexture AppendTexture(Texture texture, ValueRange range,
                                         std::span<const NamedTexture> parts,
                                         const TextureInput& input);
// The same, with the numbers of `parts` as those of its parts; of the first that cannot be used,
// the reason in its place.
[[nodiscard]] NamedTexture AppendMade(Texture texture, ValueRange range,
                                      std::span<const NamedTexture> parts,
                                      const TextureInput& input);
// uv, planar, spherical or cylindrical.
[[nodiscard]] TextureMapping ReadMapping(const TextureInput& input);
// Of a texture in space.
[[nodiscard]] TextureMapping SpaceMapping(const TextureInput& input);
// A parameter that is a texture or a constant of the input's kind; `otherwise` where it is absent
// or wrong.
[[nodiscard]] NamedTexture ReadPart(std::string_view name, float otherwise,
                                    const TextureInput& input);
// The same of numbers, whatever the input is.
[[nodiscard]] NamedTexture ReadNumberPart(std::string_view name, float otherwise,
                                          const TextureInput& input);
// Of a texture of numbers alone, where colours are asked for, or the other way round.
[[nodiscard]] NamedTexture OnlyNumbers();
[[nodiscard]] NamedTexture OnlyColors();
// Warns of colours above 1.
void WarnOfBright(float largest, ParameterList& parameters);
// `octaves` and `roughness` of noise.
void ReadNoise(ParameterList& parameters, Texture& texture);
// Largest absolute value of FbmAt with these.
[[nodiscard]] float LargestNoise(const Texture& texture);

}  // namespace lucerna
