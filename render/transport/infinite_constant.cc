// Light that is the same from everywhere.
#include "render/math/warp.h"
#include "render/transport/infinite_emission.h"

namespace lucerna {
namespace {

class ConstantSpectrum final : public InfiniteSpectrum {
 public:
  [[nodiscard]] Spectrum Source(Vec3 /*direction*/, const SpectrumLimits& limits) const override {
    // No structure in place or direction.
    return EnvironmentSource(0, 1, 1, 1, limits);
  }
};

Rgb SumOf(const std::vector<InfiniteLight>& lights) {
  Rgb radiance;
  for (const InfiniteLight& light : lights) {
    if (light.kind == InfiniteLight::Kind::kInfinite) radiance += light.radiance;
  }
  return radiance;
}

class ConstantEmission final : public InfiniteEmission {
 public:
  explicit ConstantEmission(Rgb radiance) : radiance_(radiance) {}

  [[nodiscard]] EmitterKind kind() const override { return EmitterKind::kInfinite; }
  void TakeColors(const std::vector<InfiniteLight>& lights, const Uplift* /*uplift*/) override {
    radiance_ = SumOf(lights);
  }
  [[nodiscard]] Rgb Radiance(Vec3 /*from*/, Vec3 /*direction*/) const override { return radiance_; }
  [[nodiscard]] Rgb MeanRadiance() const override { return radiance_; }
  [[nodiscard]] float LargestRadiance() const override { return MaxChannel(radiance_); }
  [[nodiscard]] bool Sample(Vec3 /*from*/, float u1, float u2, Vec3& direction) const override {
    direction = SquareToSphere(u1, u2);
    return true;
  }
  [[nodiscard]] float Density(Vec3 /*from*/, Vec3 /*direction*/, float choice) const override {
    return choice / (4 * kPi);
  }
  [[nodiscard]] bool SampleEmission(const Emitter& /*emitter*/, const BoundingSphere& scene,
                                    const EmissionNumbers& u, Emission& emission) const override {
    SetEnteringRay(-SquareToSphere(u.direction1, u.direction2), scene, u, emission.ray);
    return true;
  }
  [[nodiscard]] EmissionNumbers FindNumbers(const BoundingSphere& scene, Vec3 point,
                                            Vec3 direction) const override {
    const Vec2 place = EnteringPlace(direction, scene, point);
    const Vec2 numbers = SphereToSquare(-direction);
    return {place.x, place.y, numbers.x, numbers.y};
  }
  [[nodiscard]] std::unique_ptr<const InfiniteSpectrum> MeasureSpectrum() const override {
    return std::make_unique<ConstantSpectrum>();
  }

 private:
  Rgb radiance_;
};

}  // namespace

InfiniteEmissions MakeInfiniteEmissions(const std::vector<InfiniteLight>& lights) {
  const Rgb radiance = SumOf(lights);
  if (IsBlack(radiance)) return {};
  return {std::make_shared<ConstantEmission>(radiance)};
}

}  // namespace lucerna
