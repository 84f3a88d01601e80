// One colour everywhere.
#include "render/scene/texture.h"

namespace lucerna {

TextureStep LookUpConstant(const Texture& texture, Vec2 /*uv*/) {
  return {.color = texture.color};
}

}  // namespace lucerna
