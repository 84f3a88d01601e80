// Do scenes of extreme sizes, distances and brightness come out as a formula says?
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "client/selfcheck.h"

namespace lucerna {
namespace {

using CaseRun = std::function<StatusOr<CaseOutcome>(SelfcheckBench& bench)>;

// Renders of a scene whose spread tells how sure their mean is.
constexpr int kSeeds = 8;
// Student's t with seven degrees of freedom, two-sided at 1e-4.
constexpr double kQuantile = 7.885;
// Floats along a path, relative.
constexpr double kRounding = 2e-5;

RenderOverrides Small(int passes, std::int64_t photons, int max_depth) {
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

struct Mean {
  double value = 0;
  double standard_error = 0;
};

double MeanOf(const Image& image) {
  const std::vector<float>& pixels = image.Find("G")->pixels;
  double sum = 0;
  for (const float pixel : pixels)
    sum += static_cast<double>(pixel);
  return sum / static_cast<double>(pixels.size());
}

// How many values are no numbers. The distance of a pixel that sees nothing is infinite.
int NotFinite(const Image& image) {
  int count = 0;
  for (const ImageChannel& channel : image.channels) {
    for (const float value : channel.pixels)
      count += channel.name != "Z" && !std::isfinite(value) ? 1 : 0;
  }
  return count;
}

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

CaseRun IsBlackAndFinite(std::string text) {
  return [=](SelfcheckBench& bench) -> StatusOr<CaseOutcome> {
    LUCERNA_ASSIGN_OR_RETURN(const SelfcheckRender* render, bench.Render(text, Small(3, 1000, 5)));
    int bright = 0;
    for (const std::string_view name : {"R", "G", "B"}) {
      for (const float value : render->image.Find(name)->pixels)
        bright += value == 0 ? 0 : 1;
    }
    return AtMost(bright + NotFinite(render->image), 0, "values that are not 0, or no numbers");
  };
}

// --- scene texts -------------------------------------------------------------------------------

std::string Head(const std::string& look_at, double fov_deg, int side) {
  return absl::StrFormat(
      "LookAt %s\nCamera \"perspective\" \"float fov\" [%.17g]\nFilm \"rgb\""
      " \"integer xresolution\" [%d] \"integer yresolution\" [%d]\nPixelFilter "
      "\"box\"\nWorldBegin\n",
      look_at, fov_deg, side, side);
}

// A closed sphere whose inside shines.
std::string Furnace(double reflectance, double radiance, int side = 6) {
  return absl::StrCat(
      Head("0 0 0.3  1 0.2 0  0 1 0", 80, side),
      absl::StrFormat("ReverseOrientation\nMaterial \"diffuse\" \"rgb reflectance\" [%.17g %.17g "
                      "%.17g]\nAreaLightSource \"diffuse\" \"rgb L\" [%.17g %.17g %.17g]\n"
                      "Translate 0.5 0 0\nShape \"sphere\" \"float radius\" [2]\n",
                      reflectance, reflectance, reflectance, radiance, radiance, radiance));
}

std::string Quad(const std::string& corners) {
  return absl::StrCat("Shape \"trianglemesh\" \"point3 P\" [", corners,
                      "] \"integer indices\" [0 1 2 0 2 3]\n");
}
std::string Lamp(const std::string& corners, double radiance) {
  return absl::StrFormat(
      "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [0 0 0]\nAreaLightSource "
      "\"diffuse\" \"rgb L\" [%.17g %.17g %.17g]\n%sAttributeEnd\n",
      radiance, radiance, radiance, Quad(corners));
}

constexpr char kGray[] = "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n";
constexpr char kFloor[] = "-3 -3 0  3 -3 0  3 3 0  -3 3 0";
constexpr char kAtOrigin[] = "2.5 0 1  0 0 0  0 0 1";

// The camera sees next to nothing but the origin of a floor.
std::string FloorUnder(const std::string& lights) {
  return absl::StrCat(Head(kAtOrigin, 0.05, 32), lights, kGray, Quad(kFloor));
}

std::string InsideGlass() {
  return absl::StrCat(Head("0.3 0.2 0  1 1 1  0 1 0", 90, 16),
                      "LightSource \"infinite\" \"rgb L\" [1 1 1]\n"
                      "Material \"dielectric\" \"float eta\" [1.5]\nShape \"sphere\"\n");
}

// The pane is met at 89.99 degrees; the lamp is seen through it, and only so.
std::string GrazingPane() {
  return absl::StrCat(
      Head("0 0 1  10000 0 0  0 0 1", 1e-3, 4),
      Lamp("20000 -5000 -100  20000 -5000 -0.5  20000 5000 -0.5  20000 5000 -100", 1),
      "Material \"dielectric\" \"float eta\" [1]\n",
      Quad("0 -5000 0  40000 -5000 0  40000 5000 0  0 5000 0"));
}

// A slab from z = 0 to 1 with a lamp across its end, and a camera in it that looks along 45
// degrees: beyond the critical angle, a bounce for every metre.
std::string ThousandBounces() {
  return absl::StrCat(Head("0.25 0 0.5  1.25 0 1.5  0 1 0", 0.05, 4),
                      Lamp("1000 -5 -0.5  1000 -5 1.5  1000 5 1.5  1000 5 -0.5", 1),
                      "Material \"dielectric\" \"float eta\" [1.5]\n",
                      Quad("-10 -5 1  1010 -5 1  1010 5 1  -10 5 1"),
                      Quad("-10 -5 0  -10 5 0  1010 5 0  1010 -5 0"));
}

std::string GrazingSun(double angle_deg) {
  constexpr double kRadians = std::numbers::pi / 180;
  return FloorUnder(
      absl::StrFormat("LightSource \"distant\" \"point3 from\" [%.17g 0 %.17g]"
                      " \"point3 to\" [0 0 0] \"rgb L\" [3 3 3]\n",
                      -std::sin(angle_deg * kRadians), std::cos(angle_deg * kRadians)));
}

// Squares of sides 1e-6 and 1000, about as bright at the origin.
std::string TinyAndHugeLamp() {
  return FloorUnder(
      absl::StrCat(Lamp("-5e-7 -5e-7 1  -5e-7 5e-7 1  5e-7 5e-7 1  5e-7 -5e-7 1", 1e12),
                   Lamp("-500 -500 1000  -500 500 1000  500 500 1000  500 -500 1000", 1)));
}
double TinyAndHugeRadiance() {
  // Four times a quarter of the large square, from below a corner of it.
  const double side = 0.5 / std::sqrt(1.25);
  return 0.5 / std::numbers::pi * (1 + 4 * side * std::atan(side));
}

// Faces that have no area or next to none, lie in the floor or twice in the same place, and normals
// that point nowhere.
constexpr char kBadTriangles[] =
    "Shape \"trianglemesh\" \"point3 P\" [0 0 0  0 0 0  0 0 0] \"integer indices\" [0 1 2]\n"
    "Shape \"trianglemesh\" \"point3 P\" [-1 0 0  0 0 0  1 0 0] \"integer indices\" [0 1 2]\n"
    "Shape \"trianglemesh\" \"point3 P\" [-1 0 0  1 1e-7 0  1 0 0] \"integer indices\" [0 1 2]\n"
    "Shape \"trianglemesh\" \"point3 P\" [-1 0 0  1 1e-20 0  1 0 0] \"integer indices\" [0 1 2]\n"
    "Shape \"trianglemesh\" \"point3 P\" [-3 -3 0  3 -3 0  3 3 0] \"normal N\" [0 0 0  0 0 0  0 0 "
    "0]"
    " \"integer indices\" [0 1 2 0 1 2]\n";

std::string FloorWith(const std::string& more) {
  return absl::StrCat(FloorUnder("LightSource \"point\" \"point3 from\" [0 0 1] \"rgb I\" [2 2 2]\n"
                                 "AttributeBegin\nMaterial \"dielectric\" \"float eta\" [1]\n"
                                 "Translate 0 0 1\nShape \"sphere\" \"float radius\" [0.2]\n"
                                 "AttributeEnd\n"),
                      more);
}

// Three by three pixels of 16384 x 16384, and the same as a film of its own.
std::string PartOfLargeFilm(bool as_crop) {
  constexpr int kSide = 16384;
  constexpr int kLow = 8127;
  constexpr int kHigh = 8130;
  const double low = 2.0 * kLow / kSide - 1;
  const double high = 2.0 * kHigh / kSide - 1;
  const std::string film = absl::StrFormat(
      "Film \"rgb\" \"integer xresolution\" [%d] \"integer yresolution\" [%d]%s\n",
      as_crop ? kSide : kHigh - kLow, as_crop ? kSide : kHigh - kLow,
      as_crop ? absl::StrFormat(" \"integer pixelbounds\" [%d %d %d %d]", kLow, kHigh, kLow, kHigh)
              : "");
  const std::string window =
      as_crop ? ""
              : absl::StrFormat(" \"float screenwindow\" [%.17g %.17g %.17g %.17g]", low, high,
                                -high, -low);
  return absl::StrCat("LookAt 0.001 0 1  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [90]",
                      window, "\n", film,
                      "PixelFilter \"box\"\nWorldBegin\nLightSource \"point\" \"point3 from\""
                      " [0 0 0.01] \"rgb I\" [1e-4 1e-4 1e-4]\n",
                      kGray, Quad(kFloor));
}

// --- cases that are no mean --------------------------------------------------------------------

// Emission and direct light are left, 1 + 1/2, when the disc holds no photon or spreads them over
// all the world.
StatusOr<CaseOutcome> EveryRadius(SelfcheckBench& bench) {
  double worst = 0;
  int not_finite = 0;
  for (const std::string_view controller : RadiusControllerNames()) {
    for (const double radius : {1e-18, 1e-9, 1e9, 1e18}) {
      RenderOverrides overrides = Small(4, 500, 20);
      overrides.initial_radius = radius;
      LUCERNA_ASSIGN_OR_RETURN(overrides.radius_controller, ParseRadiusController(controller));
      LUCERNA_ASSIGN_OR_RETURN(const SelfcheckRender* render,
                               bench.Render(Furnace(0.5, 1), overrides));
      not_finite += NotFinite(render->image);
      worst = std::max(worst, std::abs(MeanOf(render->image) / 1.5 - 1));
    }
  }
  return AtMost(worst + not_finite, kRounding, "largest relative difference to 1.5");
}

// A lamp next door that has 1e20 times the power: what is seen directly stays.
StatusOr<CaseOutcome> BrighterNextDoor(SelfcheckBench& bench) {
  const std::string text =
      absl::StrCat(Furnace(0, 1e-10),
                   "Translate 20 0 0\nAreaLightSource \"diffuse\" \"rgb L\" [1e10 1e10 1e10]\n"
                   "Shape \"sphere\" \"float radius\" [2]\n");
  LUCERNA_ASSIGN_OR_RETURN(const SelfcheckRender* render, bench.Render(text, Small(4, 1000, 5)));
  return AtMost(std::abs(MeanOf(render->image) / 1e-10 - 1), kRounding,
                "relative difference to the lamp's own radiance");
}

}  // namespace

std::vector<SelfcheckCase> ExtremeCases() {
  const RenderOverrides direct = Small(16, 1, 1);
  return {
      {"extreme-no-light", "a room without light is black", IsBlackAndFinite(Furnace(0.5, 0))},
      {"extreme-no-surface", "a camera that sees no surface has a black image",
       IsBlackAndFinite(absl::StrCat(Head("0 0 0  0 0 1  0 1 0", 40, 8),
                                     Lamp("-1 -1 -3  1 -1 -3  1 1 -3  -1 1 -3", 1)))},
      {"extreme-black-furnace", "in a shining room of black walls L = Le",
       MeanIs(Furnace(0, 1), Small(2, 1000, 5), 1)},
      {"extreme-white-furnace", "with walls of albedo 1 and depth 10 L = 11 Le",
       MeanIs(Furnace(1, 1), Small(4, 20000, 10), 11)},
      {"extreme-deep-furnace", "with walls of albedo 1 and depth 10000 the job ends, L = 10001 Le",
       MeanIs(Furnace(1, 1, 16), Small(1, 60, 10000), 10001)},
      {"extreme-flat-furnace", "with depth 1 L = Le + direct light",
       MeanIs(Furnace(0.5, 1), Small(2, 1000, 1), 1.5)},
      {"extreme-one-pixel", "an image of one pixel in a room of albedo 1/2: L = 2 Le",
       MeanIs(Furnace(0.5, 1, 1), WithRadius(Small(16, 8000, 40), 0.3), 2)},
      {"extreme-one-photon", "passes of one photon, direct light and emission stay",
       [](SelfcheckBench& bench) -> StatusOr<CaseOutcome> {
         LUCERNA_ASSIGN_OR_RETURN(const SelfcheckRender* render,
                                  bench.Render(Furnace(0.5, 1), Small(64, 1, 1)));
         return AtMost(std::abs(MeanOf(render->image) / 1.5 - 1) + NotFinite(render->image),
                       kRounding, "relative difference to 1.5");
       }},
      {"extreme-inside-glass", "seen from inside a glass ball an even sky is n² times as bright",
       MeanIs(InsideGlass(), Small(64, 100, 100), 2.25)},
      {"extreme-same-index", "a pane of index 1 met at 89.99 degrees is not seen",
       MeanIs(GrazingPane(), Small(8, 100, 8), 1)},
      {"extreme-total-reflection", "1000 total reflections keep the radiance",
       MeanIs(ThousandBounces(), Small(4, 1, 2000), 1)},
      {"extreme-grazing-sun", "light from 89.9999 degrees gives its cosine",
       MeanIs(GrazingSun(89.9999), direct,
              3 * std::cos(89.9999 * std::numbers::pi / 180) * 0.5 / std::numbers::pi)},
      {"extreme-lamp-areas", "lamps of areas 1e-12 and 1e6 add up",
       MeanIs(TinyAndHugeLamp(), Small(32, 1, 1), TinyAndHugeRadiance())},
      {"extreme-next-door", "a lamp 1e20 times as strong next door changes nothing seen",
       BrighterNextDoor},
      {"extreme-bad-triangles",
       "needles, faces without area or twice there, zero normals: no change",
       MeansAgree(FloorWith(kBadTriangles), FloorWith(""), WithRadius(Small(4, 50000, 5), 0.3))},
      {"extreme-radii", "radii from 1e-18 to 1e18 give finite images with every controller",
       EveryRadius},
      {"extreme-large-film", "3 x 3 pixels of 16384 x 16384 are those of a film of their own",
       MeansAgree(PartOfLargeFilm(true), PartOfLargeFilm(false), direct)},
  };
}

}  // namespace lucerna
