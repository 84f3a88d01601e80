// A metal that is given by wavelength has its colour in daylight where three channels stand for it.
#include "render/formats/pbrt/metal_fit.h"

#include <array>
#include <string>

#include "gtest/gtest.h"

#include "render/math/color_matching.h"
#include "render/transport/bsdf.h"
#include "tests/support/pbrt_text.h"

namespace lucerna {
namespace {

struct MetalCurves {
  WavelengthCurve eta, k;
};
MetalCurves CurvesOf(const std::string& name) {
  return {*MetalSpectrumNamed("metal-" + name + "-eta").curve,
          *MetalSpectrumNamed("metal-" + name + "-k").curve};
}

// Rec. 709 in D65, white having 1; under a dielectric of that index.
std::array<double, 3> ColorOf(const MetalCurves& metal, float cosine, float index) {
  std::array<double, 3> sum{};
  std::array<double, 3> white{};
  for (double nm = 380; nm <= 780; nm += 1) {
    const auto n = static_cast<float>(metal.eta.AtClamped(nm)) / index;
    const auto k = static_cast<float>(metal.k.AtClamped(nm)) / index;
    const auto reflected = static_cast<double>(FresnelConductor(cosine, Gray(n), Gray(k)).g);
    const std::array<double, 3> seen = Rec709(CieObserver(nm));
    for (std::size_t c = 0; c < 3; ++c) {
      sum[c] += seen[c] * D65At(nm) * reflected;
      white[c] += seen[c] * D65At(nm);
    }
  }
  return {sum[0] / white[0], sum[1] / white[1], sum[2] / white[2]};
}

void ExpectColor(const MetalConstants& fitted, const MetalCurves& metal,
                 const std::array<double, 3>& tolerance, const std::string& name) {
  for (const float index : {1.0F, 1.5F}) {
    for (const float cosine : {1.0F, 0.7F, 0.5F, 0.3F, 0.15F}) {
      const std::array<double, 3> color = ColorOf(metal, cosine, index);
      const Rgb ours = FresnelConductor(cosine, fitted.eta * (1 / index), fitted.k * (1 / index));
      for (int c = 0; c < 3; ++c) {
        const auto channel = static_cast<std::size_t>(c);
        EXPECT_NEAR(static_cast<double>(ours[c]) / color[channel], 1, tolerance[channel])
            << name << ", channel " << c << ", cosine " << cosine << ", index " << index;
      }
    }
  }
}

// At angles that had no part in the fit, too.
TEST(MetalFitTest, HasTheColourOfTheCurvesAtAllAngles) {
  const MetalConstants anywhere = {Gray(1), Gray(3)};
  for (const std::string name : {"Ag", "Al"}) {
    const MetalCurves metal = CurvesOf(name);
    ExpectColor(FitMetal(metal.eta, metal.k, anywhere), metal, {1e-3, 1e-3, 1e-3}, name);
  }
  const MetalCurves copper = CurvesOf("Cu");
  ExpectColor(FitMetal(copper.eta, copper.k, anywhere), copper, {6e-3, 2e-3, 2e-3}, "Cu");
  // At right angles it has 1.022 of red.
  const MetalCurves gold = CurvesOf("Au");
  EXPECT_GT(ColorOf(gold, 1, 1)[0], 1.02);
  ExpectColor(FitMetal(gold.eta, gold.k, anywhere), gold, {0.025, 3e-3, 0.012}, "Au");
}

// Constants that do not depend on wavelength are their own fit, with absorption and without.
TEST(MetalFitTest, FlatCurvesStayAsTheyAre) {
  const auto flat = [](double value) { return WavelengthCurve{{300, 900}, {value, value}}; };
  for (const auto& [n, k] :
       {std::pair{0.4, 2.5}, {1.5, 7.0}, {2.9, 3.1}, {30.0, 30.0}, {1.7, 0.0}, {50.0, 0.0}}) {
    const MetalConstants fitted = FitMetal(flat(n), flat(k), {Gray(2), Gray(k > 0 ? 2.0F : 0)});
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(static_cast<double>(fitted.eta[c]), n, 1e-3 * n) << n << " " << k;
      EXPECT_NEAR(static_cast<double>(fitted.k[c]), k, 1e-3 * k + 1e-9) << n << " " << k;
    }
  }
  // What reflects nothing has no relative errors.
  EXPECT_EQ(FitMetal(flat(1), flat(0), {Gray(1), Gray(0)}).eta, Gray(1));
}

TEST(MetalFitTest, MaterialsOfFilesHaveIt) {
  const auto normal_color = [](const std::string& parameters) {
    const Scene scene = ReadWorld("Material " + parameters + " Shape \"sphere\"");
    const Material& material = scene.materials.at(1);
    return FresnelConductor(1, material.eta, material.k);
  };
  const std::array<double, 3> copper = ColorOf(CurvesOf("Cu"), 1, 1);
  for (const char* const parameters :
       {"\"conductor\"", "\"conductor\" \"spectrum eta\" \"metal-Cu-eta\"",
        "\"coatedconductor\""}) {
    const Rgb color = normal_color(parameters);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(static_cast<double>(color[c]), copper[static_cast<std::size_t>(c)], 5e-3);
  }
  // Given by three numbers, it keeps them.
  const Scene scene = ReadWorld(
      "Material \"conductor\" \"rgb eta\" [0.2 0.9 1.1] \"rgb k\" [3.9 2.4 2.2] Shape \"sphere\"");
  EXPECT_EQ(scene.materials.at(1).eta, (Rgb{0.2F, 0.9F, 1.1F}));
}

}  // namespace
}  // namespace lucerna
