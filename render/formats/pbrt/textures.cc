#include "render/formats/pbrt/textures.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "render/base/text.h"
#include "render/formats/pbrt/kinds.h"
#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {
namespace {

// Of textures made of textures.
constexpr int kMaxDepth = 64;
constexpr int kMaxLookups = 1024;

using TextureReader = NamedTexture (*)(const TextureInput&);
#define LUCERNA_ROW(Name, name) {name, &Read##Name##Texture},
constexpr Kind<TextureReader> kKinds[] = {LUCERNA_TEXTURES(LUCERNA_ROW)};
#undef LUCERNA_ROW

// The range as it is used: nothing is not a number, as zero times infinity.
ValueRange Sorted(std::initializer_list<float> values) {
  ValueRange range = {HUGE_VALF, -HUGE_VALF};
  for (const float value : values) {
    const float held = std::isnan(value) ? 0 : value;
    range = {std::min(range.least, held), std::max(range.largest, held)};
  }
  return range;
}

// A constant colour or number, or the texture of that name.
NamedTexture ReadPartOf(std::string_view name, float otherwise, bool is_number,
                        const TextureInput& input) {
  ParameterList& parameters = input.parameters;
  Texture constant;
  constant.color = Gray(otherwise);
  if (parameters.IsTexture(name)) {
    const TextureNames& names = is_number ? input.declared.numbers : input.declared.colors;
    const std::optional<std::string> other = parameters.FindTexture(name);
    const auto found = other.has_value() ? names.find(*other) : names.end();
    if (found != names.end()) return found->second;
    if (other.has_value()) {
      parameters.Error(name, Concat("refers to the ", is_number ? "float" : "spectrum", " texture ",
                                    Quoted(*other), ", which is not defined before it"));
    }
  } else if (is_number) {
    constant.color =
        Gray(static_cast<float>(parameters.Float(name, static_cast<double>(otherwise))));
  } else {
    constant.color = parameters.FindReflectance(name).value_or(constant.color);
  }
  const float least = std::min({constant.color.r, constant.color.g, constant.color.b});
  return AppendTexture(constant, {least, MaxChannel(constant.color)}, {}, input);
}

}  // namespace

ValueRange ValueRange::operator*(const ValueRange& other) const {
  return Sorted(
      {least * other.least, least * other.largest, largest * other.least, largest * other.largest});
}

ValueRange ValueRange::Joined(const ValueRange& other) const {
  return {std::min(least, other.least), std::max(largest, other.largest)};
}

ValueRange RangeOf(const NamedTexture& texture) {
  return {texture.least, texture.largest};
}

NamedTexture UnusableTexture(std::string why_not) {
  NamedTexture texture;
  texture.why_not = std::move(why_not);
  return texture;
}

NamedTexture FaultyTexture() {
  return UnusableTexture("refers to a texture that has an error");
}

NamedTexture OnlyNumbers() {
  return UnusableTexture("refers to a texture of colours whose type gives numbers only");
}

NamedTexture OnlyColors() {
  return UnusableTexture("refers to a texture of numbers whose type gives colours only");
}

NamedTexture AppendTexture(Texture texture, ValueRange range, std::span<const NamedTexture> parts,
                           const TextureInput& input) {
  NamedTexture made;
  for (const NamedTexture& part : parts) {
    made.depth = std::max(made.depth, part.depth + 1);
    made.lookups = std::min(made.lookups + part.lookups, kMaxLookups + 1);
  }
  input.textures.push_back(std::move(texture));
  made.number = static_cast<std::int32_t>(input.textures.size()) - 1;
  made.least = range.least;
  made.largest = range.largest;
  return made;
}

NamedTexture AppendMade(Texture texture, ValueRange range, std::span<const NamedTexture> parts,
                        const TextureInput& input) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].number == kNoTexture) return parts[i];
    texture.parts[i] = parts[i].number;
  }
  return AppendTexture(std::move(texture), range, parts, input);
}

TextureMapping SpaceMapping(const TextureInput& input) {
  TextureMapping mapping;
  const StatusOr<Transform> from_world = input.to_world.Inverse();
  if (from_world.ok()) {
    mapping.from_world = *from_world;
  } else {
    input.parameters.Error("is flattened by its transform");
  }
  return mapping;
}

TextureMapping ReadMapping(const TextureInput& input) {
  ParameterList& parameters = input.parameters;
  const std::string kind = parameters.String("mapping", "uv");
  TextureMapping mapping;
  if (kind != "uv") mapping = SpaceMapping(input);
  if (kind == "planar") {
    mapping.kind = TextureMapping::Kind::kPlanar;
    mapping.axis_u = parameters.Vector("v1", {1, 0, 0});
    mapping.axis_v = parameters.Vector("v2", {0, 1, 0});
  } else if (kind == "spherical") {
    mapping.kind = TextureMapping::Kind::kSpherical;
  } else if (kind == "cylindrical") {
    mapping.kind = TextureMapping::Kind::kCylindrical;
  } else if (kind == "uv") {
    mapping.scale_u = static_cast<float>(parameters.Float("uscale", 1));
    mapping.scale_v = static_cast<float>(parameters.Float("vscale", 1));
  } else {
    parameters.Error("mapping", "must be uv, planar, spherical or cylindrical");
  }
  if (kind == "uv" || kind == "planar") {
    mapping.delta_u = static_cast<float>(parameters.Float("udelta", 0));
    mapping.delta_v = static_cast<float>(parameters.Float("vdelta", 0));
  }
  // Of other mappings.
  for (const std::string_view name : {"uscale", "vscale", "udelta", "vdelta", "v1", "v2"})
    parameters.Ignore(name);
  return mapping;
}

NamedTexture ReadPart(std::string_view name, float otherwise, const TextureInput& input) {
  return ReadPartOf(name, otherwise, input.is_number, input);
}

NamedTexture ReadNumberPart(std::string_view name, float otherwise, const TextureInput& input) {
  return ReadPartOf(name, otherwise, true, input);
}

void WarnOfBright(float largest, ParameterList& parameters) {
  // Of one without a bound nothing is known of what surfaces see of it.
  if (!(largest > 1) || std::isinf(largest)) return;
  parameters.Warning("", Concat("is up to ", largest, " and is held at 1: no surface reflects ",
                                "more light than it gets"));
}

void ReadNoise(ParameterList& parameters, Texture& texture) {
  texture.octaves =
      static_cast<std::int32_t>(parameters.FindInteger("octaves", {1, 64}).value_or(8));
  texture.roughness = static_cast<float>(parameters.Float("roughness", 0.5, {-100, 100}));
}

float LargestNoise(const Texture& texture) {
  float sum = 0;
  float amplitude = 1;
  for (int i = 0; i <= texture.octaves; ++i) {
    sum += amplitude;
    amplitude *= std::abs(texture.roughness);
  }
  return sum;
}

const NamedTexture* FindNumbers(std::string_view name, ParameterList& parameters,
                                const TextureNames& numbers) {
  const std::optional<std::string> texture = parameters.FindTexture(name);
  if (!texture.has_value()) return nullptr;
  const auto named = numbers.find(*texture);
  if (named == numbers.end()) {
    parameters.Error(name, Concat("refers to the float texture ", Quoted(*texture),
                                  ", which is not defined before it"));
    return nullptr;
  }
  if (named->second.number != kNoTexture) return &named->second;
  parameters.Error(name, named->second.why_not);
  return nullptr;
}

NamedTexture ReadTexture(std::string_view type, bool is_number, ParameterList& parameters,
                         const DeclaredTextures& declared, const Transform& to_world,
                         AssetReader& assets, std::vector<Texture>& textures) {
  const TextureReader read = FindReader<TextureReader>(kKinds, type);
  if (read == nullptr) {
    return UnusableTexture(Concat("refers to a texture of type ", Quoted(type),
                                  ", which is not supported; ",
                                  SupportedKinds<TextureReader>(kKinds)));
  }
  NamedTexture made = read({parameters, declared, is_number, to_world, assets, textures});
  if (made.depth > kMaxDepth) {
    parameters.Error(Concat("is made of textures more than ", kMaxDepth, " deep"));
    made = FaultyTexture();
  } else if (made.lookups > kMaxLookups) {
    parameters.Error(Concat("is made of more than ", kMaxLookups, " textures"));
    made = FaultyTexture();
  }
  parameters.WarnOfUnread();
  return made;
}

}  // namespace lucerna
