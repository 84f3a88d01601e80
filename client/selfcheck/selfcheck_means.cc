#include "client/selfcheck/selfcheck_means.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace lucerna {
namespace {

// Renders of a scene whose spread gives the standard error of their mean.
constexpr int kSeeds = 8;
// Student's t with seven degrees of freedom, two-sided at 1e-4.
constexpr double kQuantile = 7.885;
struct Mean {
  double value = 0;
  double standard_error = 0;
};

StatusOr<Mean> MeanOverSeeds(SelfcheckBench& bench, const std::string& text,
                             RenderOverrides overrides) {
  double sum = 0;
  double squares = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    overrides.seed = static_cast<std::uint64_t>(seed);
    LUCERNA_ASSIGN_OR_RETURN(const SelfcheckRender* render, bench.Render(text, overrides));
    const double mean = MeanOf(render->image);
    sum += mean;
    squares += mean * mean;
  }
  const double mean = sum / kSeeds;
  const double variance = std::max(0.0, squares / kSeeds - mean * mean) / (kSeeds - 1);
  return Mean{mean, std::sqrt(variance)};
}

// The relative difference to what a formula says. A bound above 5 % would say nothing.
CaseOutcome Agreement(const Mean& measured, double expected, double expected_error = 0) {
  const double error = std::hypot(measured.standard_error, expected_error);
  const double bound = kRounding + kQuantile * error / expected;
  CaseOutcome outcome =
      AtMost(std::abs(measured.value / expected - 1), bound,
             absl::StrFormat("relative difference of %.6g to %.6g", measured.value, expected));
  outcome.holds = outcome.holds && bound <= 0.05;
  return outcome;
}

}  // namespace

RenderOverrides SmallRender(int passes, std::int64_t photons, int max_depth) {
  RenderOverrides overrides;
  overrides.passes = passes;
  overrides.photons_per_pass = photons;
  overrides.max_depth = max_depth;
  overrides.seed = 1;
  return overrides;
}

RenderOverrides WithRadius(RenderOverrides overrides, double radius) {
  overrides.initial_radius = radius;
  return overrides;
}

double MeanOf(const Image& image) {
  const std::vector<float>& pixels = image.Find("G")->pixels;
  double sum = 0;
  for (const float pixel : pixels)
    sum += static_cast<double>(pixel);
  return sum / static_cast<double>(pixels.size());
}

int NotFinite(const Image& image) {
  int count = 0;
  for (const ImageChannel& channel : image.channels) {
    for (const float value : channel.pixels)
      count += channel.name != "Z" && !std::isfinite(value) ? 1 : 0;
  }
  return count;
}

CaseRun MeanIs(std::string text, RenderOverrides overrides, double expected) {
  return [=](SelfcheckBench& bench) -> StatusOr<CaseOutcome> {
    LUCERNA_ASSIGN_OR_RETURN(const Mean mean, MeanOverSeeds(bench, text, overrides));
    return Agreement(mean, expected);
  };
}

CaseRun MeansAgree(std::string text, std::string other, RenderOverrides overrides) {
  return [=](SelfcheckBench& bench) -> StatusOr<CaseOutcome> {
    LUCERNA_ASSIGN_OR_RETURN(const Mean mean, MeanOverSeeds(bench, text, overrides));
    LUCERNA_ASSIGN_OR_RETURN(const Mean as, MeanOverSeeds(bench, other, overrides));
    return Agreement(mean, as.value, as.standard_error);
  };
}

std::string HeadText(const std::string& look_at, double fov_deg, int side) {
  return absl::StrFormat(
      "LookAt %s\nCamera \"perspective\" \"float fov\" [%.17g]\nFilm \"rgb\""
      " \"integer xresolution\" [%d] \"integer yresolution\" [%d]\nPixelFilter "
      "\"box\"\nWorldBegin\n",
      look_at, fov_deg, side, side);
}

std::string QuadText(const std::string& corners) {
  return absl::StrCat("Shape \"trianglemesh\" \"point3 P\" [", corners,
                      "] \"integer indices\" [0 1 2 0 2 3]\n");
}
std::string LampText(const std::string& corners, double radiance) {
  return absl::StrFormat(
      "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [0 0 0]\nAreaLightSource "
      "\"diffuse\" \"rgb L\" [%.17g %.17g %.17g]\n%sAttributeEnd\n",
      radiance, radiance, radiance, QuadText(corners));
}

}  // namespace lucerna
