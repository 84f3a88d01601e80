// The graphics state of a pbrt text, and the scopes that save and restore it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "render/base/status.h"
#include "render/formats/diagnostic.h"
#include "render/formats/pbrt/lights.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/math/transform.h"
#include "render/scene/scene.h"

namespace lucerna {

struct RgbSpace;

// What the directive Attribute gives default parameters to.
enum class AttributeTarget : std::uint8_t { kShape, kLight, kMaterial, kTexture, kMedium };
inline constexpr std::size_t kAttributeTargets = 5;

// Where something is at the beginning of a motion and at its end.
struct TransformPair {
  Transform start, end;
  // One of them was given with a fourth row that is not 0, 0, 0, 1, which is left out: without a
  // translation what it does to directions is right, and what it does to points is not.
  bool is_projective = false;

  [[nodiscard]] bool Moves() const { return start != end; }
  bool operator==(const TransformPair&) const = default;
};

[[nodiscard]] bool HasTranslation(const TransformPair& transforms);

// What AttributeBegin saves and AttributeEnd restores. Large parts are shared, so that a copy is
// small however much the text put into them.
struct GraphicsState {
  using Defaults = std::shared_ptr<const std::vector<Parameter>>;

  // At the first and the second of the TransformTimes; before WorldBegin: world to camera, as pbrt
  // writes it.
  TransformPair to_world;
  // Which of the two directives change (ActiveTransform).
  bool changes_start = true, changes_end = true;
  bool reverse_orientation = false;
  std::int32_t material = 0;
  std::shared_ptr<const AreaEmission> area_emission;
  std::int32_t area_light = kNoAreaLight;  // of an emission without power: the same everywhere
  // Of shapes, on the sides that their outward normals point away from and to; a camera and lights
  // without extent are in the outer one.
  std::int32_t medium_inside = kNoMedium, medium_outside = kNoMedium;
  std::array<Defaults, kAttributeTargets> defaults;
  const RgbSpace* rgb_space = nullptr;  // of colours given as rgb; nullptr: Rec. 709

  [[nodiscard]] Defaults& DefaultsOf(AttributeTarget target) {
    return defaults[static_cast<std::size_t>(target)];
  }
};

// The current state, and those that open scopes have saved.
class GraphicsStack {
 public:
  struct Scope {
    std::string_view begun_by;  // a directive
    SourceLocation location;
    GraphicsState saved;
  };

  [[nodiscard]] GraphicsState& state() { return state_; }
  [[nodiscard]] const std::vector<Scope>& open_scopes() const { return scopes_; }

  // Errors: RESOURCE_EXHAUSTED when scopes are nested too deep.
  [[nodiscard]] Status Begin(std::string_view directive, const SourceLocation& location);
  // Errors: INVALID_ARGUMENT when the innermost scope was not begun by `begun_by`.
  [[nodiscard]] Status End(std::string_view directive, std::string_view begun_by);

 private:
  GraphicsState state_;
  std::vector<Scope> scopes_;
};

}  // namespace lucerna
