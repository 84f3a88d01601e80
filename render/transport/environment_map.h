// Environment maps: an infinite light with a picture.
//
// Each pixel of an infinite light's square is an even patch of sky. Directions are drawn in
// proportion to the luminance of the patches, so all light that is drawn carries about the same
// flux. Directions are unit, in the world, and point towards the sky.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "render/math/piecewise_constant.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"
#include "render/scene/scene.h"
#include "render/transport/infinite_emission.h"

namespace lucerna {

class EnvironmentMap final : public InfiniteEmission {
 public:
  // Requires a light with a map, of that number among the scene's infinite lights.
  explicit EnvironmentMap(const InfiniteLight& light, std::size_t number = 0);

  [[nodiscard]] EmitterKind kind() const override { return EmitterKind::kEnvironment; }
  void TakeColors(const std::vector<InfiniteLight>& lights, const Uplift* uplift) override {
    scale_now_ = lights[number_].radiance;
    uplift_ = uplift;
  }
  [[nodiscard]] Rgb Radiance(Vec3 direction) const;
  [[nodiscard]] Rgb Radiance(Vec3 /*from*/, Vec3 direction) const override {
    return Radiance(direction);
  }
  [[nodiscard]] Rgb MeanRadiance() const override { return mean_; }
  [[nodiscard]] float LargestRadiance() const override { return largest_; }

  // Zero where the sky is black. Requires a map that is not all black.
  [[nodiscard]] float PdfSolidAngle(Vec3 direction) const;
  // Draws a direction with that density.
  [[nodiscard]] Vec3 Sample(float u1, float u2) const;
  [[nodiscard]] bool Sample(Vec3 /*from*/, float u1, float u2, Vec3& direction) const override {
    direction = Sample(u1, u2);
    return true;
  }
  [[nodiscard]] float Density(Vec3 /*from*/, Vec3 direction, float choice) const override {
    return choice * PdfSolidAngle(direction);
  }
  [[nodiscard]] bool SampleEmission(const Emitter& emitter, const BoundingSphere& scene,
                                    const EmissionNumbers& u, Emission& emission) const override;
  [[nodiscard]] EmissionNumbers FindNumbers(const BoundingSphere& scene, Vec3 point,
                                            Vec3 direction) const override;
  [[nodiscard]] std::unique_ptr<const InfiniteSpectrum> MeasureSpectrum() const override;

  // [pixels] of a side.
  [[nodiscard]] int size() const { return size_; }
  // Where on the square a direction lies, in [0, 1]².
  [[nodiscard]] Vec2 PlaceOf(Vec3 direction) const;
  [[nodiscard]] float TexelLuminance(int x, int y) const { return Luminance(RadianceOf({x, y})); }

 private:
  struct Texel {
    int x, y;
  };
  [[nodiscard]] Texel TexelOf(Vec3 direction) const;
  // Its three colours, by which directions are drawn, and those that it has now.
  [[nodiscard]] Rgb RadianceOf(Texel texel) const;
  [[nodiscard]] Rgb RadianceNow(Texel texel) const;

  std::shared_ptr<const Picture> map_;
  std::size_t number_;
  Rgb scale_, scale_now_;
  const Uplift* uplift_ = nullptr;
  ShapeAxes axes_;
  int size_;
  Rgb mean_;
  float largest_ = 0;
  double mean_luminance_ = 0;
  PiecewiseConstant2D texels_;  // by luminance
};

}  // namespace lucerna
