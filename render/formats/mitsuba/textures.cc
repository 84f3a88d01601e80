// Textures.
#include <algorithm>
#include <array>

#include "render/base/text.h"
#include "render/formats/mitsuba/translator.h"

namespace lucerna {

std::optional<std::string> MitsubaTranslator::TextureOf(const MitsubaObject& texture,
                                                        Meaning meaning) {
  const TextureUse use = {&texture, meaning};
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
void MitsubaTranslator::AddPlacement(const MitsubaObject& texture, ParameterList& list,
                                     double cells, MadeDirective& made) {
  double scale_u = list.Float("uscale", 1) * list.Float("uvscale", 1);
  double scale_v = list.Float("vscale", 1) * list.Float("uvscale", 1);
  double delta_u = list.Float("uoffset", 0);
  double delta_v = list.Float("voffset", 0);
  if (const auto found = texture.transforms.find("to_uv"); found != texture.transforms.end()) {
    const auto& rows = found->second.rows();
    if (rows[0][1] != 0 || rows[1][0] != 0) {
      list.Error("to_uv that turns is not supported; scale and translate only");
      return;
    }
    scale_u = rows[0][0];
    scale_v = rows[1][1];
    // Of a transform of 3 x 3 the last column moves.
    delta_u = rows[0][3] != 0 ? rows[0][3] : rows[0][2];
    delta_v = rows[1][3] != 0 ? rows[1][3] : rows[1][2];
  }
  const auto add = [&](const char* name, double value) {
    made.parameters.push_back(MakeNumber(name, value, texture.location));
  };
  add("uscale", cells * scale_u);
  add("vscale", cells * scale_v);
  add("udelta", cells * delta_u);
  add("vdelta", cells * (1 - scale_v - delta_v));
}

void MitsubaTranslator::TranslateBitmap(const MitsubaObject& texture, ParameterList& list,
                                        MadeDirective& made) {
  made.strings.emplace_back("imagemap");
  const std::optional<std::string> file = list.FindString("filename");
  if (!file.has_value()) {
    list.Error("needs <string name=\"filename\">");
    return;
  }
  made.parameters.push_back(MakeString("filename", *file, texture.location));
  const double gamma = list.Float("gamma", -1);
  std::string encoding = "sRGB";
  if (list.Bool("raw", false) || gamma == 1) encoding = "linear";
  if (gamma > 0 && gamma != 1) encoding = Concat("gamma ", gamma);
  made.parameters.push_back(MakeString("encoding", encoding, texture.location));
  std::string wrap = list.String("wrap_mode", "repeat");
  if (wrap == "mirror") {
    list.Warning("wrap_mode", "mirror is rendered as repeat");
    wrap = "repeat";
  }
  if (wrap == "zero") wrap = "black";
  made.parameters.push_back(MakeString("wrap", wrap, texture.location));
  for (const std::string_view name : {"filter_type", "max_anisotropy", "cache", "format"})
    list.Ignore(name);
  AddPlacement(texture, list, 1, made);
}

void MitsubaTranslator::TranslateCheckerboard(const MitsubaObject& texture, ParameterList& list,
                                              Meaning meaning, MadeDirective& made) {
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
  // Two cells to a unit, counted from the other end.
  AddPlacement(texture, list, 2, made);
  made.parameters.back().numbers.front() += 1;
}

std::optional<std::string> MitsubaTranslator::TranslateTexture(const MitsubaObject& texture,
                                                               Meaning meaning) {
  MadeDirective made = Directive("Texture", texture);
  ParameterList list = ListOf(texture);
  const std::string name = NewName(texture);
  made.strings = {name, meaning == Meaning::kColor ? "spectrum" : "float"};
  if (texture.type == "bitmap") {
    TranslateBitmap(texture, list, made);
  } else if (texture.type == "checkerboard") {
    TranslateCheckerboard(texture, list, meaning, made);
  } else if (texture.type == "scale") {
    made.strings.emplace_back("scale");
    const MitsubaObject* inner = ChildOf(texture, "texture");
    const auto inner_name = inner == nullptr ? std::nullopt : TextureOf(*inner, meaning);
    if (!inner_name.has_value()) {
      if (inner == nullptr) list.Error("needs a texture");
      return std::nullopt;
    }
    Parameter part = MakeString("tex", *inner_name, texture.location);
    part.type = "texture";
    made.parameters.push_back(std::move(part));
    made.parameters.push_back(MakeNumber("scale", list.Float("scale", 1), texture.location));
  } else {
    list.Error("is not supported; there are bitmap, checkerboard and scale");
    return std::nullopt;
  }
  list.WarnOfUnread();
  RefuseOthers(texture, {"texture"});
  reader_.CarryOut(std::move(made));
  return name;
}

}  // namespace lucerna
