// Material "mix": two named materials, mixed by a number or a texture of numbers.
#include <algorithm>

#include "render/base/text.h"
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {

void ReadMix(const MaterialInput& input, Material& material) {
  constexpr std::int32_t kMaxDepth = 64;
  ParameterList& parameters = input.parameters;
  material.mixed = {0, 0};
  const std::span<const std::string> names = parameters.Strings("materials");
  if (!parameters.Has("materials")) {
    parameters.Error("needs \"string materials\", the names of two materials");
  } else if (names.size() != 2) {
    parameters.Error("materials", "must be the names of two materials");
  } else {
    for (std::size_t i = 0; i < 2; ++i) {
      const auto named = input.from.names.find(names[i]);
      if (named == input.from.names.end()) {
        parameters.Error("materials", Concat("refers to the material ", Quoted(names[i]),
                                             ", which is not defined before it"));
        continue;
      }
      const Material& part = input.from.materials[static_cast<std::size_t>(named->second)];
      if (part.kind == Material::Kind::kInterface) {
        parameters.Error("materials", Concat("must not name ", Quoted(names[i]),
                                             ", an interface: it cannot be part of a mix"));
      }
      material.mixed[i] = named->second;
      material.mix_depth = std::max(material.mix_depth, part.mix_depth + 1);
    }
  }
  if (material.mix_depth > kMaxDepth) {
    parameters.Error(Concat("is made of mixes more than ", kMaxDepth, " deep"));
  }
  if (parameters.IsTexture("amount")) {
    if (const NamedTexture* amount =
            FindNumbers("amount", parameters, input.from.declared.numbers)) {
      material.amount_texture = amount->number;
    }
  } else {
    material.amount = static_cast<float>(parameters.Float("amount", 0.5));
  }
}

}  // namespace lucerna
