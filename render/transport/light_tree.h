// Which of many lights matters at a point?
//
// A tree over lights. A node has up to kWidth children and knows of each a ball around its lights,
// a cone around the directions in which they face, and their intensity. A walk from the root
// chooses children in proportion to about the irradiance that they bring when nothing is in the
// way, down to a single light. So with up to kWidth lights each is judged by itself, and of
// thousands a few dozen are looked at. Lights at infinity have no place: they are weighed beside
// the root's children with the irradiance that they bring everywhere.
//
// Source: Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree
// Splitting", with wide nodes in place of splitting.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "render/math/vector.h"

namespace lucerna {

// Where light arrives.
struct LitPoint {
  Vec3 position;
  // Unit, of an opaque surface: light from behind it does not count. Zero: light counts from all
  // directions alike.
  Vec3 normal = {};
};

// What a tree knows of a light.
struct TreeLight {
  // Largest intensity in any direction [W·sr⁻¹]; at infinity the irradiance on a plane that faces
  // the light [W·m⁻²]. Not negative.
  double intensity = 0;
  bool is_at_infinity = false;  // then the members below are meaningless
  Vec3 center;                  // of a ball that holds the light
  float radius = 0;
  // All its normals are within the angle of this cosine around `axis`, unit; light leaves normals
  // with their cosine.
  Vec3 axis = {0, 0, 1};
  float cos_facing = -1;
  // No light leaves farther than the angle of this cosine from all normals, at least 0.
  float cos_reach = 0;
};

class LightTree {
 public:
  // Lights are numbered as they stand in `lights`. Requires that there are some.
  explicit LightTree(std::vector<TreeLight> lights);

  struct Choice {
    std::uint32_t light = 0;
    float probability = 0;
  };
  // Draws a light; `u` in [0, 1). Absent where none brings anything.
  [[nodiscard]] std::optional<Choice> Draw(const LitPoint& from, double u) const;
  // With what probability Draw gives this light.
  [[nodiscard]] float Probability(const LitPoint& from, std::uint32_t light) const;

 private:
  static constexpr std::size_t kWidth = 8;
  static constexpr unsigned int kSlotBits = 3;
  // Nodes above each other, at most: their slots fill the 64 bits of a path.
  static constexpr unsigned int kMostLevels = 21;
  // From this level on lights are cut into halves by number, which ends within the levels left.
  static constexpr unsigned int kLevelsByPlace = 10;

  using Lanes = std::array<float, kWidth>;
  struct Node {
    // Empty slots have no intensity.
    Lanes x{}, y{}, z{}, radius{}, axis_x{}, axis_y{}, axis_z{}, cos_facing{}, sin_facing{},
        cos_reach{}, intensity{};
    // Another node, or a light: kLight and its number.
    std::array<std::uint32_t, kWidth> child{};
  };
  static constexpr std::uint32_t kLight = 1U << 31;

  // Adds a node for some of the lights, reorders them, and returns its number.
  std::uint32_t Build(std::span<const TreeLight> lights, std::span<std::uint32_t> numbers,
                      unsigned int level, std::uint64_t path);
  // What the children of a node bring to a point, about [irradiance over the unit of intensity].
  [[nodiscard]] static Lanes Weights(const Node& node, const LitPoint& from);

  std::vector<Node> nodes_;             // the root first
  std::vector<std::uint64_t> paths_;    // [lights] slots from the root on, the lowest bits first
  std::vector<std::uint32_t> distant_;  // lights at infinity
  std::vector<float> distant_weights_;  // [distant_]
  float distant_sum_ = 0;
  std::vector<float> weight_of_distant_;  // [lights], 0 of those that have a place
};

}  // namespace lucerna
