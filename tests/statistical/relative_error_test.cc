// A scene whose light is scaled by any factor has the same relative error.
#include <cmath>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"

#include "render/film/image_metrics.h"
#include "tests/support/local_render.h"

namespace lucerna {
namespace {

struct Errors {
  SquaredError estimate;
  double between_seeds = 0;  // relMSE
};

Errors ErrorsWithLightTimes(float factor) {
  Scene scene = LoadScene("glass-box.pbrt");
  for (AreaLight& light : scene.area_lights)
    light.radiance *= factor;
  RenderOverrides overrides;
  overrides.width = 48;
  overrides.height = 48;
  overrides.photons_per_pass = 48 * 48;
  overrides.max_depth = 8;
  const auto render = [&](std::uint64_t seed) {
    overrides.seed = seed;
    LocalRender rendered(scene, SettingsFor(scene, overrides));
    for (int pass = 0; pass < 8; ++pass)
      rendered.AddPass();
    return rendered;
  };
  const LocalRender first = render(1);
  const LocalRender second = render(2);
  return {first.EstimateError(1).relative,
          Compare(first.MakeImage(), second.MakeImage()).value().rel_mse};
}

// Keys are the same, so photons go the same ways but where the rounding of a float decides: about
// one choice in 2^23, of 18,000 photons with less than a hundred choices each. Were one photon in
// 2000 another one, squared errors would change by about that share. With an absolute floor of
// 0.01 relMSE between the seeds grows 500-fold from the first factor to the last.
//
// What kernels changed is a statistic of 8 significant bits, and a factor that is no power of two
// decides which way it is rounded: by a share of 2^-8 at most, so that products of two of them,
// which intervals are made of and the part of an image that blur is taken off, change by 2^-7 at
// most.
TEST(RelativeErrorTest, IsTheSameWhateverFactorScalesAllLight) {
  const Errors base = ErrorsWithLightTimes(1);
  EXPECT_GT(base.estimate.total(), 1e-4);
  for (const float factor : {0x1p-80F, 0.4F, 7.0F, 1000.0F, 40000.0F, 0x1p60F}) {
    int exponent = 0;
    const double rounding = std::frexp(factor, &exponent) == 0.5F ? 0 : 0x1p-7;
    const Errors scaled = ErrorsWithLightTimes(factor);
    RecordProperty(absl::StrCat("estimate_", factor),
                   std::to_string(scaled.estimate.total() / base.estimate.total()));
    RecordProperty(absl::StrCat("seeds_", factor),
                   std::to_string(scaled.between_seeds / base.between_seeds));
    EXPECT_NEAR(scaled.estimate.noise / base.estimate.noise, 1, 1.0 / 2000) << factor;
    EXPECT_NEAR(scaled.estimate.high / base.estimate.high, 1, 1.0 / 2000 + rounding) << factor;
    EXPECT_NEAR(scaled.between_seeds / base.between_seeds, 1, 1.0 / 2000 + rounding) << factor;
  }
}

}  // namespace
}  // namespace lucerna
