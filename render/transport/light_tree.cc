#include "render/transport/light_tree.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <numbers>

#include "render/base/status.h"

namespace lucerna {
namespace {

// A cone of directions, in double while it grows.
struct Cone {
  Vec3 axis;
  double angle = -1;  // none yet
};

// The smallest cone that holds both, or all directions.
Cone Union(const Cone& a, const Cone& b) {
  if (a.angle < 0) return b;
  if (a.angle >= std::numbers::pi) return a;
  if (b.angle < 0) return a;
  const double between = std::acos(std::clamp(static_cast<double>(Dot(a.axis, b.axis)), -1.0, 1.0));
  if (std::min(between + b.angle, std::numbers::pi) <= a.angle) return a;
  if (std::min(between + a.angle, std::numbers::pi) <= b.angle) return b;
  const double angle = (a.angle + between + b.angle) / 2;
  const Vec3 across = b.axis - a.axis * Dot(a.axis, b.axis);
  const float length = Length(across);
  if (angle >= std::numbers::pi || !(length > 0)) return {a.axis, std::numbers::pi};
  // The axis turns from a towards b.
  const double turn = angle - a.angle;
  return {Normalize(a.axis * static_cast<float>(std::cos(turn)) +
                    across * static_cast<float>(std::sin(turn) / static_cast<double>(length))),
          angle};
}

// What a node knows of some lights together.
TreeLight Together(std::span<const TreeLight> lights, std::span<const std::uint32_t> numbers) {
  if (numbers.size() == 1) return lights[numbers[0]];
  Bounds bounds;
  Cone facing;
  TreeLight all;
  all.cos_reach = 1;
  for (const std::uint32_t number : numbers) {
    const TreeLight& light = lights[number];
    const Vec3 reach = {light.radius, light.radius, light.radius};
    bounds.Add(light.center - reach);
    bounds.Add(light.center + reach);
    facing = Union(
        facing,
        {light.axis, std::acos(std::clamp(static_cast<double>(light.cos_facing), -1.0, 1.0))});
    all.intensity += light.intensity;
    all.cos_reach = std::min(all.cos_reach, light.cos_reach);
  }
  all.center = bounds.Center();
  for (const std::uint32_t number : numbers)
    all.radius =
        std::max(all.radius, Length(lights[number].center - all.center) + lights[number].radius);
  all.axis = facing.axis;
  // Rounded away from the normals.
  all.cos_facing = static_cast<float>(std::cos(std::min(facing.angle + 1e-6, std::numbers::pi)));
  return all;
}

// With `beside`, of what has no child.
float SumOf(std::span<const float> weights, float beside) {
  for (const float weight : weights)
    beside += weight;
  return beside;
}

float Along(Vec3 p, int axis) {
  return axis == 0 ? p.x : axis == 1 ? p.y : p.z;
}

// Reorders lights into two parts, both not empty, and returns the size of the first.
std::size_t Cut(std::span<const TreeLight> lights, std::span<std::uint32_t> numbers,
                bool by_place) {
  Bounds centers;
  for (const std::uint32_t number : numbers)
    centers.Add(lights[number].center);
  const Vec3 extent = centers.high - centers.low;
  const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
  if (by_place) {
    const float middle = Along(centers.Center(), axis);
    const auto second = std::ranges::stable_partition(
        numbers, [&](std::uint32_t number) { return Along(lights[number].center, axis) < middle; });
    const std::size_t first = numbers.size() - second.size();
    if (first > 0 && first < numbers.size()) return first;
  }
  std::ranges::stable_sort(
      numbers, {}, [&](std::uint32_t number) { return Along(lights[number].center, axis); });
  return numbers.size() / 2;
}

}  // namespace

LightTree::LightTree(std::vector<TreeLight> lights)
    : paths_(lights.size()), weight_of_distant_(lights.size()) {
  LUCERNA_CHECK(!lights.empty() && lights.size() < kLight);
  // In a unit of their own, so that no scene is too bright or too dark for a float.
  double largest = 0;
  for (const TreeLight& light : lights)
    largest = std::max(largest, light.intensity);
  std::vector<std::uint32_t> placed;
  for (std::uint32_t number = 0; number < lights.size(); ++number) {
    TreeLight& light = lights[number];
    if (largest > 0) light.intensity /= largest;
    if (!light.is_at_infinity) {
      placed.push_back(number);
      continue;
    }
    distant_.push_back(number);
    distant_weights_.push_back(static_cast<float>(light.intensity));
    weight_of_distant_[number] = distant_weights_.back();
    distant_sum_ += distant_weights_.back();
  }
  if (placed.empty()) {
    nodes_.emplace_back();
  } else {
    Build(lights, placed, 0, 0);
  }
}

std::uint32_t LightTree::Build(std::span<const TreeLight> lights, std::span<std::uint32_t> numbers,
                               unsigned int level, std::uint64_t path) {
  LUCERNA_CHECK(level < kMostLevels);
  const bool by_place = level < kLevelsByPlace;
  // Of the parts the one that spreads its light farthest is cut next.
  struct Part {
    std::span<std::uint32_t> numbers;
    TreeLight together;
  };
  std::vector<Part> parts = {{numbers, Together(lights, numbers)}};
  while (parts.size() < kWidth) {
    const auto cost = [&](const Part& part) {
      if (part.numbers.size() == 1) return -1.0;
      if (!by_place) return static_cast<double>(part.numbers.size());
      const auto radius = static_cast<double>(part.together.radius);
      return part.together.intensity * radius * radius;
    };
    const auto widest = std::ranges::max_element(parts, {}, cost);
    if (cost(*widest) < 0) break;
    const std::span<std::uint32_t> all = widest->numbers;
    const std::size_t first = Cut(lights, all, by_place);
    *widest = {all.first(first), Together(lights, all.first(first))};
    parts.push_back({all.subspan(first), Together(lights, all.subspan(first))});
  }
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  for (std::size_t slot = 0; slot < parts.size(); ++slot) {
    const TreeLight& together = parts[slot].together;
    const std::uint64_t below = path | (std::uint64_t{slot} << (kSlotBits * level));
    std::uint32_t child = 0;
    if (parts[slot].numbers.size() == 1) {
      const std::uint32_t light = parts[slot].numbers[0];
      child = kLight | light;
      paths_[light] = below;
    } else {
      child = Build(lights, parts[slot].numbers, level + 1, below);
    }
    Node& node = nodes_[number];
    node.x[slot] = together.center.x;
    node.y[slot] = together.center.y;
    node.z[slot] = together.center.z;
    node.radius[slot] = together.radius;
    node.axis_x[slot] = together.axis.x;
    node.axis_y[slot] = together.axis.y;
    node.axis_z[slot] = together.axis.z;
    node.cos_facing[slot] = together.cos_facing;
    node.sin_facing[slot] =
        std::sqrt(std::max(0.0F, 1 - together.cos_facing * together.cos_facing));
    node.cos_reach[slot] = together.cos_reach;
    node.intensity[slot] = static_cast<float>(together.intensity);
    node.child[slot] = child;
  }
  return number;
}

LightTree::Lanes LightTree::Weights(const Node& node, const LitPoint& from) {
  // Of a node's children the sum stays finite.
  constexpr float kLargestWeight = 1e37F;
  const bool has_normal = LengthSquared(from.normal) > 0;
  Lanes weights;
  for (std::size_t i = 0; i < kWidth; ++i) {
    const float x = node.x[i] - from.position.x;
    const float y = node.y[i] - from.position.y;
    const float z = node.z[i] - from.position.z;
    const float distance2 = x * x + y * y + z * z;
    const float radius2 = node.radius[i] * node.radius[i];
    const float inverse = 1 / std::sqrt(std::max(distance2, FLT_MIN));
    // Of the angle under which the ball is seen from the point, and the point from the ball.
    const float sin_ball = std::min(node.radius[i] * inverse, 1.0F);
    const float cos_ball = std::sqrt(1 - sin_ball * sin_ball);
    const bool is_inside = distance2 <= radius2;
    // Of `angle` less `less`, at least 0: cosine and sine.
    const auto cosine_of_rest = [](float cosine, float sine, float cos_less, float sin_less) {
      return cosine >= cos_less ? 1.0F : cosine * cos_less + sine * sin_less;
    };
    const auto sine_of_rest = [](float cosine, float sine, float cos_less, float sin_less) {
      return cosine >= cos_less ? 0.0F : sine * cos_less - cosine * sin_less;
    };
    const float cosine = -(x * node.axis_x[i] + y * node.axis_y[i] + z * node.axis_z[i]) * inverse;
    const float sine = std::sqrt(std::max(0.0F, 1 - cosine * cosine));
    const float from_normals = cosine_of_rest(cosine, sine, node.cos_facing[i], node.sin_facing[i]);
    const float sine_from_normals =
        sine_of_rest(cosine, sine, node.cos_facing[i], node.sin_facing[i]);
    float leaving = cosine_of_rest(from_normals, sine_from_normals, cos_ball, sin_ball);
    if (is_inside) leaving = 1;
    if (leaving < node.cos_reach[i]) leaving = 0;
    float arriving = (x * from.normal.x + y * from.normal.y + z * from.normal.z) * inverse;
    const float sine_arriving = std::sqrt(std::max(0.0F, 1 - arriving * arriving));
    arriving = cosine_of_rest(arriving, sine_arriving, cos_ball, sin_ball);
    if (is_inside || !has_normal) arriving = 1;
    const float weight = node.intensity[i] * leaving * std::max(arriving, 0.0F) /
                         std::max(std::max(distance2, radius2), FLT_MIN);
    weights[i] = std::min(weight, kLargestWeight);
  }
  return weights;
}

std::optional<LightTree::Choice> LightTree::Draw(const LitPoint& from, double u) const {
  float probability = 1;
  std::uint32_t number = 0;
  for (bool is_root = true;; is_root = false) {
    const Node& node = nodes_[number];
    const Lanes weights = Weights(node, from);
    const float sum = SumOf(weights, is_root ? distant_sum_ : 0);
    if (!(sum > 0)) return std::nullopt;
    double rest = u * static_cast<double>(sum);
    // Rounding may leave the end to none: the last one that may be drawn has it.
    std::optional<std::size_t> slot;
    for (std::size_t i = 0; i < kWidth; ++i) {
      if (!(weights[i] > 0)) continue;
      if (slot && rest < static_cast<double>(weights[*slot])) break;
      if (slot) rest -= static_cast<double>(weights[*slot]);
      slot = i;
    }
    if (is_root && !distant_.empty() && (!slot || rest >= static_cast<double>(weights[*slot]))) {
      if (slot) rest -= static_cast<double>(weights[*slot]);
      std::size_t i = 0;
      while (i + 1 < distant_.size() && rest >= static_cast<double>(distant_weights_[i]))
        rest -= static_cast<double>(distant_weights_[i++]);
      return Choice{distant_[i], distant_weights_[i] / sum};
    }
    const float weight = weights[*slot];
    probability *= weight / sum;
    if ((node.child[*slot] & kLight) != 0) return Choice{node.child[*slot] & ~kLight, probability};
    number = node.child[*slot];
    u = std::min(rest / static_cast<double>(weight), 1 - 0x1p-53);
  }
}

float LightTree::Probability(const LitPoint& from, std::uint32_t light) const {
  float probability = 1;
  std::uint32_t number = 0;
  std::uint64_t path = paths_[light];
  for (bool is_root = true;; is_root = false) {
    const Node& node = nodes_[number];
    const Lanes weights = Weights(node, from);
    const float sum = SumOf(weights, is_root ? distant_sum_ : 0);
    if (!(sum > 0)) return 0;
    if (weight_of_distant_[light] > 0) return weight_of_distant_[light] / sum;
    const std::size_t slot = path & (kWidth - 1);
    if (!(weights[slot] > 0)) return 0;
    probability *= weights[slot] / sum;
    if ((node.child[slot] & kLight) != 0) {
      return (node.child[slot] & ~kLight) == light ? probability : 0;
    }
    number = node.child[slot];
    path >>= kSlotBits;
  }
}

}  // namespace lucerna
