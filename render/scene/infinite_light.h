// Light from everywhere that no shape covers. Several of them add up.
//
// A kind is one row of LUCERNA_INFINITE_LIGHTS, with its numbers below where there are none for
// them yet, and two files: how pbrt files give it in render/formats/pbrt/light_NAME.cc, with a row
// for its reader in lights.cc, and its radiance, sampling and spectrum in
// render/transport/infinite_NAME.cc (docs/adding.md).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "render/math/rgb.h"
#include "render/scene/given_spectrum.h"
#include "render/scene/shape_traits.h"
#include "render/scene/texture.h"

// ROW(Name, name): InfiniteLight::Kind::kName, and its name in messages.
#define LUCERNA_INFINITE_LIGHTS(ROW)          \
  ROW(Infinite, "constant environment light") \
  ROW(Environment, "environment map")         \
  ROW(Portal, "environment light behind a portal")

namespace lucerna {

// A rectangle through which light comes: corner + s·along_x + t·along_y for s and t in [0, 1].
// Light goes against along_x × along_y. As in pbrt-v4, a point on the other side sees none, and
// neither do rays that begin there.
struct Portal {
  Vec3 corner;
  Vec3 along_x, along_y;  // at right angles, not zero
};

struct InfiniteLight {
#define LUCERNA_KIND(Name, name) k##Name,
  enum class Kind : std::uint8_t { LUCERNA_INFINITE_LIGHTS(LUCERNA_KIND) };
#undef LUCERNA_KIND

  Rgb radiance;  // the same everywhere, or what the pixels of `map` are multiplied by
  // A square: its equal-area octahedral map to the sphere of directions is that of
  // math/equal_area_square.h, each pixel an even patch. Row 0 is v = 0.
  std::shared_ptr<const Picture> map = nullptr;
  ShapeAxes axes = {};          // of the map, in the world
  Kind kind = Kind::kInfinite;  // the same everywhere; kEnvironment: a map; kPortal: either
  std::optional<Portal> portal = std::nullopt;  // of kPortal
  GivenSpectrum spectrum = {};                  // of the radiance, up to a factor

  // Whether it is brighter from some directions than from others.
  [[nodiscard]] bool HasDetail() const {
    return kind != Kind::kInfinite;
  }
};

}  // namespace lucerna
