// Random walks of light through a dielectric coat, the layer in it, and what is under it.
// Directions have z > 0 on the side of the surface that light comes from, or, in a layer, z up.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "render/math/rng.h"
#include "render/math/sobol.h"
#include "render/math/vector.h"
#include "render/scene/coat_table.h"
#include "render/scene/material.h"
#include "render/transport/coat.h"
#include "render/transport/microfacet.h"

namespace lucerna {

// Walks for each cosine outside.
inline constexpr int kCoatWalks = 4096;

[[nodiscard]] Vec3 DirectionAt(float cosine, float azimuth);

// One crossing of the coat's surface, at the facet that two numbers draw for `w`, w.z > 0 on the
// side that light comes from; `index`: beyond over here. The shares of flux that go on, and their
// directions, each on its side with z > 0; a share of 0 has no direction.
struct Crossed {
  float reflected = 0, transmitted = 0;
  Vec3 back, beyond;
};
[[nodiscard]] Crossed CrossSurface(const MaterialNumbers& material, Vec3 w, float index, float u1,
                                   float u2);
[[nodiscard]] Crossed CrossSurface(const MaterialNumbers& material, Vec3 w, float index,
                                   KeyedRng& rng);

// Powers of the albedos of a table's rows: of one more scattering at each step.
class AlbedoWeights {
 public:
  AlbedoWeights() { weights_.fill(1); }
  void Scatter() {
    for (int row = 0; row < CoatTable::kAlbedos; ++row)
      weights_[static_cast<std::size_t>(row)] *= static_cast<double>(CoatTable::AlbedoOf(row));
  }
  [[nodiscard]] double operator[](std::size_t row) const { return weights_[row]; }

 private:
  std::array<double, CoatTable::kAlbedos> weights_{};
};

// A walk in the layer under a coat's surface, which scatters or absorbs, until it comes to the
// base. z is up.
class LayerWalk {
 public:
  // Below the surface, or above the base.
  LayerWalk(const MaterialNumbers& material, Vec3 direction, double weight, KeyedRng& rng)
      : material_(material), rng_(rng), direction_(direction), weight_(weight) {
    depth_ = direction.z < 0 ? 0.0F : material.thickness;
  }

  // Light that leaves the coat: visit(share of flux, weights).
  template <typename Visit>
  bool ToBase(const Visit& visit) {
    constexpr double kLeastWeight = 1e-4;
    while (weight_ > kLeastWeight && events_ < MostEvents()) {
      const float cosine = std::max(std::abs(direction_.z), 1e-6F);
      const float way = direction_.z < 0 ? material_.thickness - depth_ : depth_;
      const float free = -std::log1p(-rng_.Uniform()) * cosine;
      if (free < way) {
        Scatter(free);
        continue;
      }
      if (direction_.z < 0) return true;
      // Seen from below, where light comes from is (-x, -y, z) of where it goes.
      const Crossed crossed = CrossSurface(material_, {-direction_.x, -direction_.y, direction_.z},
                                           1 / material_.ior, rng_);
      visit(weight_ * static_cast<double>(crossed.transmitted), albedos_);
      weight_ *= static_cast<double>(crossed.reflected);
      direction_ = {crossed.back.x, crossed.back.y, -crossed.back.z};
      depth_ = 0;
      ++events_;
    }
    return false;
  }
  // Requires a walk that has just begun: it is scattered before it has crossed the layer, its
  // weight is the share that is.
  void ScatterFirst();
  // From the base.
  void GoUp(Vec3 direction, float factor) {
    direction_ = direction;
    weight_ *= static_cast<double>(factor);
    depth_ = material_.thickness;
    ++events_;
  }
  [[nodiscard]] Vec3 direction() const { return direction_; }
  [[nodiscard]] double weight() const { return weight_; }
  [[nodiscard]] const AlbedoWeights& albedos() const { return albedos_; }
  [[nodiscard]] bool is_scattered() const { return is_scattered_; }
  [[nodiscard]] int events() const { return events_; }

 private:
  // As pbrt's maxdepth.
  [[nodiscard]] int MostEvents() const {
    // A thick layer that absorbs nothing would hold a process for minutes.
    constexpr int kMostEvents = 1024;
    return std::min(material_.base_hits, kMostEvents / 2) * 2;
  }
  void Scatter(float along);

  const MaterialNumbers& material_;
  KeyedRng& rng_;
  Vec3 direction_;
  double weight_;
  float depth_ = 0;
  int events_ = 0;
  bool is_scattered_ = false;
  AlbedoWeights albedos_;
};

// The numbers of one of the walks from a node. Those of the first way down, to the metal and out
// are spread evenly over all walks: one Sobol' sequence, shifted for each node (Cranley & Patterson
// 1976).
class WalkNumbers {
 public:
  WalkNumbers(int walk, int node);

  float Next() { return next_ < even_.size() ? even_[next_++] : rng_.Uniform(); }
  // For walks through a layer that scatters.
  KeyedRng& rng() { return rng_; }

 private:
  SobolPoint even_ = {};
  std::size_t next_ = 0;
  KeyedRng rng_;
};

// Of CoatTable::kMetalCosines, and 0: Lagrange's polynomials, that of 0 left out.
using CosineSums = std::array<double, CoatTable::kMetalCosines.size()>;
[[nodiscard]] CosineSums LagrangeAt(float cosine);
void Add(const CosineSums& sums, double factor, CosineSums& to);

// A walk from a direction at `cosine` outside through a coat to a metal that reflects all.
class MetalWalk {
 public:
  // Keeps a reference to the material.
  MetalWalk(const MaterialNumbers& material, float cosine, const WalkNumbers& numbers);

  // Through a layer that does not scatter, to at most so many meetings with the metal. What leaves
  // after each: visit(meetings, share of flux, direction outside).
  template <typename Visit>
  void Through(int most_meetings, const Visit& visit) {
    constexpr float kLeastWeight = 1e-4F;
    float weight = first_.transmitted;
    Vec3 down = first_.beyond;  // as seen from above: where light comes from is (-x, -y, z)
    for (int hit = 0; hit < most_meetings && weight > kLeastWeight; ++hit) {
      const Vec3 from = {-down.x, -down.y, down.z};
      weight *= CoatCrossing(material_, from.z);
      Vec3 up;
      float factor = 0;
      if (!Reflect(from, up, factor)) return;
      weight *= factor;
      weight *= CoatCrossing(material_, up.z);
      // Seen from below, where light comes from is (-x, -y, z) of where it goes.
      const Crossed crossed = Cross({-up.x, -up.y, up.z}, 1 / material_.ior);
      visit(hit + 1, static_cast<double>(weight * crossed.transmitted), crossed.beyond);
      weight *= crossed.reflected;
      down = crossed.back;
    }
  }
  // Sums over the meetings so far of Lagrange's polynomials at the cosine of the facet.
  [[nodiscard]] const CosineSums& cosines() const { return cosines_; }
  // Through one that scatters: visit(meetings, share of flux, weights). Returns the events.
  template <typename Visit>
  int ThroughHaze(const Visit& visit) {
    LayerWalk in_layer(material_, {first_.beyond.x, first_.beyond.y, -first_.beyond.z},
                       static_cast<double>(first_.transmitted), numbers_.rng());
    for (int hit = 0;; ++hit) {
      const bool is_at_base = in_layer.ToBase(
          [&](double left, const AlbedoWeights& albedos) { visit(hit, left, albedos); });
      Vec3 up;
      float factor = 0;
      if (!is_at_base || hit >= material_.base_hits ||
          !Reflect(-in_layer.direction(), up, factor)) {
        return in_layer.events();
      }
      in_layer.GoUp(up, factor);
    }
  }

 private:
  Crossed Cross(Vec3 w, float index);
  // `from`: where light comes from at the metal. False: nothing is reflected.
  bool Reflect(Vec3 from, Vec3& up, float& factor);

  const MaterialNumbers& material_;
  WalkNumbers numbers_;
  Ggx metal_;
  Crossed first_;
  CosineSums cosines_{};
};

}  // namespace lucerna
