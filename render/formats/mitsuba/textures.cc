// Textures.
#include <algorithm>
#include <array>
#include <functional>
#include <utility>

#include "render/base/text.h"
#include "render/formats/mitsuba/translator.h"

namespace lucerna {

std::optional<std::string> MitsubaTranslator::TextureOf(const MitsubaObject& texture,
                                                        Meaning meaning) {
  const TextureUse use = {&texture, meaning, returned_};
  const auto known = textures_.find(use);
  if (known != textures_.end()) return known->second;
  if (!Open(texture)) return std::nullopt;
  std::optional<std::string> name = TranslateTexture(texture, meaning);
  Close(texture);
  textures_.emplace(use, name);
  return name;
}

// Places in Mitsuba have v = 0 at the top of a picture, here at its bottom, where meshes are given
// v = 1 - v. A map of Mitsuba's v is turned over likewise.
TextureMapping MitsubaTranslator::MappingOf(const MitsubaObject& texture, ParameterList& list,
                                            double cells) {
  const double both = list.Float("uvscale", 1);
  // Of (u, v, 1).
  std::array<std::array<double, 3>, 2> rows = {
      {{list.Float("uscale", 1) * both, 0, list.Float("uoffset", 0)},
       {0, list.Float("vscale", 1) * both, list.Float("voffset", 0)}}};
  if (const auto found = texture.transforms.find("to_uv"); found != texture.transforms.end()) {
    for (std::size_t i = 0; i < 2; ++i) {
      const auto& row = found->second.rows()[i];
      // Of a transform of 3 x 3 the last column moves.
      rows[i] = {row[0], row[1], row[3] != 0 ? row[3] : row[2]};
    }
  }
  const auto number = [cells](double value) {
    return static_cast<float>(std::clamp(cells * value, -3e38, 3e38));
  };
  TextureMapping mapping;
  mapping.delta_u = number(rows[0][2] + rows[0][1]);
  mapping.delta_v = number(1 - rows[1][1] - rows[1][2]);
  if (rows[0][1] == 0 && rows[1][0] == 0) {
    mapping.scale_u = number(rows[0][0]);
    mapping.scale_v = number(rows[1][1]);
    return mapping;
  }
  mapping.kind = TextureMapping::Kind::kUvAffine;
  mapping.axis_u = {number(rows[0][0]), number(-rows[0][1]), 0};
  mapping.axis_v = {number(-rows[1][0]), number(rows[1][1]), 0};
  return mapping;
}

MitsubaTranslator::Placement MitsubaTranslator::WrappingOf(ParameterList& list) {
  const auto wrap = [&list](std::string_view name, Texture::Wrap otherwise) {
    const std::optional<std::string> mode = list.FindString(name);
    if (!mode.has_value()) return otherwise;
    if (*mode == "mirror") return Texture::Wrap::kMirror;
    if (*mode == "clamp") return Texture::Wrap::kClamp;
    if (*mode == "zero") return Texture::Wrap::kBlack;
    if (*mode != "repeat") list.Error(name, "must be repeat, mirror, clamp or zero");
    return Texture::Wrap::kRepeat;
  };
  Placement placement;
  const Texture::Wrap both = wrap("wrap_mode", Texture::Wrap::kRepeat);
  placement.wrap_u = wrap("wrap_mode_u", both);
  placement.wrap_v = wrap("wrap_mode_v", both);
  return placement;
}

// pbrt has no words for all of it.
void MitsubaTranslator::Place(const Placement& placement, std::size_t textures_before) {
  std::vector<Texture>& textures = reader_.scene().textures;
  if (textures.size() <= textures_before) return;  // there was an error
  Texture& made = textures.back();
  made.mapping = placement.mapping;
  made.wrap_u = placement.wrap_u;
  made.wrap_v = placement.wrap_v;
  made.tint = placement.tint;
  made.scale = placement.scale;
}

MitsubaTranslator::Placement MitsubaTranslator::TranslateBitmap(const MitsubaObject& texture,
                                                                ParameterList& list,
                                                                MadeDirective& made) {
  made.strings.emplace_back("imagemap");
  Placement placement = WrappingOf(list);
  placement.mapping = MappingOf(texture, list, 1);
  const std::optional<std::string> file = list.FindString("filename");
  if (!file.has_value()) {
    list.Error("needs <string name=\"filename\">");
    return placement;
  }
  made.parameters.push_back(MakeString("filename", *file, texture.location));
  const double gamma = list.Float("gamma", -1);
  std::string encoding = "sRGB";
  if (list.Bool("raw", false) || gamma == 1) encoding = "linear";
  if (gamma > 0 && gamma != 1) encoding = Concat("gamma ", gamma);
  made.parameters.push_back(MakeString("encoding", encoding, texture.location));
  // So that the range of the texture's values has 0 too.
  const bool is_black =
      placement.wrap_u == Texture::Wrap::kBlack || placement.wrap_v == Texture::Wrap::kBlack;
  made.parameters.push_back(MakeString("wrap", is_black ? "black" : "repeat", texture.location));
  if (list.String("filter_type", "bilinear") == "nearest")
    made.parameters.push_back(MakeString("filter", "point", texture.location));
  for (const std::string_view name : {"max_anisotropy", "cache", "format"})
    list.Ignore(name);
  return placement;
}

MitsubaTranslator::Placement MitsubaTranslator::TranslateCheckerboard(const MitsubaObject& texture,
                                                                      ParameterList& list,
                                                                      Meaning meaning,
                                                                      MadeDirective& made) {
  made.strings.emplace_back("checkerboard");
  constexpr std::array<std::array<std::string_view, 2>, 2> kNames = {
      {{"color0", "tex1"}, {"color1", "tex2"}}};
  constexpr std::array kOtherwise = {0.4F, 0.2F};
  for (std::size_t i = 0; i < 2; ++i) {
    const std::string as(kNames[i][1]);
    const auto part = Find(texture, list, kNames[i][0], as, meaning);
    made.parameters.push_back(
        part.value_or(meaning == Meaning::kColor
                          ? MakeColor(as, Gray(kOtherwise[i]), texture.location)
                          : MakeNumber(as, static_cast<double>(kOtherwise[i]), texture.location)));
  }
  Placement placement;
  // Two cells to a unit, counted from the other end.
  placement.mapping = MappingOf(texture, list, 2);
  placement.mapping.delta_v += 1;
  return placement;
}

std::optional<MitsubaTranslator::Placement> MitsubaTranslator::TranslateScale(
    const MitsubaObject& texture, ParameterList& list, Meaning meaning, MadeDirective& made) {
  const MitsubaObject* inner = ChildOf(texture, "texture");
  if (inner == nullptr) {
    list.Error("needs a texture");
    return std::nullopt;
  }
  for (const MitsubaObject& child : texture.children)
    list.Ignore(child.name);
  Parameter scale = MakeNumber("scale", 1, texture.location);
  const Parameter* given = list.FindWhole("scale");
  if (given != nullptr && given->type != "texture") scale = *given;
  const bool is_color = scale.type == "rgb" && scale.numbers.size() == 3;
  if (meaning == Meaning::kColor && is_color &&
      std::ranges::adjacent_find(scale.numbers, std::not_equal_to()) != scale.numbers.end()) {
    const auto [least, largest] = std::ranges::minmax(scale.numbers);
    if (inner->type != "bitmap" || least < 0) {
      list.Error("scale", least < 0 ? "must not be negative"
                                    : "of three numbers is for a texture of type bitmap alone");
      return std::nullopt;
    }
    ParameterList of_inner = ListOf(*inner);
    Placement placement = TranslateBitmap(*inner, of_inner, made);
    of_inner.WarnOfUnread();
    made.parameters.push_back(MakeNumber("scale", largest, texture.location));
    placement.scale = static_cast<float>(largest);
    placement.tint = {static_cast<float>(scale.numbers[0] / largest),
                      static_cast<float>(scale.numbers[1] / largest),
                      static_cast<float>(scale.numbers[2] / largest)};
    return placement;
  }
  made.strings.emplace_back("scale");
  const auto inner_name = TextureOf(*inner, meaning);
  if (!inner_name.has_value()) return std::nullopt;
  Parameter part = MakeString("tex", *inner_name, texture.location);
  part.type = "texture";
  made.parameters.push_back(std::move(part));
  if (scale.type == "integer") scale.type = "float";
  made.parameters.push_back(ParameterOf(std::move(scale), "scale", Meaning::kNumber));
  return Placement();
}

std::optional<std::string> MitsubaTranslator::TranslateTexture(const MitsubaObject& texture,
                                                               Meaning meaning) {
  MadeDirective made = Directive("Texture", texture);
  ParameterList list = ListOf(texture);
  const std::string name = NewName(texture);
  made.strings = {name, meaning == Meaning::kColor ? "spectrum" : "float"};
  std::optional<Placement> placement;
  if (texture.type == "bitmap") {
    placement = TranslateBitmap(texture, list, made);
  } else if (texture.type == "checkerboard") {
    placement = TranslateCheckerboard(texture, list, meaning, made);
  } else if (texture.type == "scale") {
    placement = TranslateScale(texture, list, meaning, made);
    if (!placement.has_value()) return std::nullopt;
  } else if (texture.type == "mesh_attribute" && meaning == Meaning::kColor) {
    if (const std::string attribute = list.String("name", ""); attribute != "vertex_color") {
      list.Error("name", Concat("is ", Quoted(attribute), "; meshes have vertex_color alone"));
      return std::nullopt;
    }
    made.strings.emplace_back("vertexcolor");
    made.parameters.push_back(MakeColor("tex", Gray(1), texture.location));
  } else if (std::optional<Parameter> everywhere = SpectrumOf(texture); everywhere.has_value()) {
    made.strings.emplace_back("constant");
    made.parameters.push_back(ParameterOf(*std::move(everywhere), "value", meaning));
    reader_.CarryOut(std::move(made));
    return name;
  } else {
    list.Error(
        "is not supported; there are bitmap, checkerboard, scale, mesh_attribute of colours, srgb, "
        "uniform, d65, blackbody, "
        "irregular and regular");
    return std::nullopt;
  }
  list.WarnOfUnread();
  if (texture.type == "scale") {
    RefuseOthers(texture, {"texture"});
  } else {
    RefuseOthers(texture, {});
  }
  const std::size_t textures_before = reader_.scene().textures.size();
  const bool is_placed = made.strings.back() != "scale" && made.strings.back() != "vertexcolor";
  reader_.CarryOut(std::move(made));
  if (is_placed) Place(*placement, textures_before);
  return name;
}

}  // namespace lucerna
