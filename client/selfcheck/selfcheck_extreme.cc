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

#include "client/selfcheck/selfcheck.h"
#include "client/selfcheck/selfcheck_means.h"

namespace lucerna {
namespace {

CaseRun IsBlackAndFinite(std::string text) {
  return [=](SelfcheckBench& bench) -> StatusOr<CaseOutcome> {
    LUCERNA_ASSIGN_OR_RETURN(const SelfcheckRender* render,
                             bench.Render(text, SmallRender(3, 1000, 5)));
    int bright = 0;
    for (const std::string_view name : {"R", "G", "B"}) {
      for (const float value : render->image.Find(name)->pixels)
        bright += value == 0 ? 0 : 1;
    }
    return AtMost(bright + NotFinite(render->image), 0, "values that are not 0, or no numbers");
  };
}

// --- scene texts -------------------------------------------------------------------------------

// A closed sphere whose inside shines.
std::string Furnace(double reflectance, double radiance, int side = 6) {
  return absl::StrCat(
      HeadText("0 0 0.3  1 0.2 0  0 1 0", 80, side),
      absl::StrFormat("ReverseOrientation\nMaterial \"diffuse\" \"rgb reflectance\" [%.17g %.17g "
                      "%.17g]\nAreaLightSource \"diffuse\" \"rgb L\" [%.17g %.17g %.17g]\n"
                      "Translate 0.5 0 0\nShape \"sphere\" \"float radius\" [2]\n",
                      reflectance, reflectance, reflectance, radiance, radiance, radiance));
}

constexpr char kGray[] = "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n";
constexpr char kFloor[] = "-3 -3 0  3 -3 0  3 3 0  -3 3 0";
constexpr char kAtOrigin[] = "2.5 0 1  0 0 0  0 0 1";

// The camera sees next to nothing but the origin of a floor.
std::string FloorUnder(const std::string& lights) {
  return absl::StrCat(HeadText(kAtOrigin, 0.05, 32), lights, kGray, QuadText(kFloor));
}

std::string InsideGlass() {
  return absl::StrCat(HeadText("0.3 0.2 0  1 1 1  0 1 0", 90, 16),
                      "LightSource \"infinite\" \"rgb L\" [1 1 1]\n"
                      "Material \"dielectric\" \"float eta\" [1.5]\nShape \"sphere\"\n");
}

// The pane is met at 89.99 degrees; the light is seen through it, and only so.
std::string GrazingPane() {
  return absl::StrCat(
      HeadText("0 0 1  10000 0 0  0 0 1", 1e-3, 4),
      LampText("20000 -5000 -100  20000 -5000 -0.5  20000 5000 -0.5  20000 5000 -100", 1),
      "Material \"dielectric\" \"float eta\" [1]\n",
      QuadText("0 -5000 0  40000 -5000 0  40000 5000 0  0 5000 0"));
}

// A slab from z = 0 to 1 with a light across its end, and a camera in it that points along 45
// degrees: beyond the critical angle, a bounce for every metre.
std::string ThousandBounces() {
  return absl::StrCat(HeadText("0.25 0 0.5  1.25 0 1.5  0 1 0", 0.05, 4),
                      LampText("1000 -5 -0.5  1000 -5 1.5  1000 5 1.5  1000 5 -0.5", 1),
                      "Material \"dielectric\" \"float eta\" [1.5]\n",
                      QuadText("-10 -5 1  1010 -5 1  1010 5 1  -10 5 1"),
                      QuadText("-10 -5 0  -10 5 0  1010 5 0  1010 -5 0"));
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
      absl::StrCat(LampText("-5e-7 -5e-7 1  -5e-7 5e-7 1  5e-7 5e-7 1  5e-7 -5e-7 1", 1e12),
                   LampText("-500 -500 1000  -500 500 1000  500 500 1000  500 -500 1000", 1)));
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
                      kGray, QuadText(kFloor));
}

// --- cases that are no mean --------------------------------------------------------------------

// Emission and direct light are left, 1 + 1/2, when the disc holds no photon or spreads them over
// all the world.
StatusOr<CaseOutcome> EveryRadius(SelfcheckBench& bench) {
  double worst = 0;
  int not_finite = 0;
  for (const std::string_view controller : RadiusControllerNames()) {
    for (const double radius : {1e-18, 1e-9, 1e9, 1e18}) {
      RenderOverrides overrides = SmallRender(4, 500, 20);
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

// A light next door that has 1e20 times the power: what is seen directly stays.
// Its light is unreachable behind the walls, so no photon starts there.
std::string BrighterNextDoor() {
  return absl::StrCat(Furnace(0.5, 1e-10, 1),
                      "Translate 20 0 0\nAreaLightSource \"diffuse\" \"rgb L\" [1e10 1e10 1e10]\n"
                      "Shape \"sphere\" \"float radius\" [2]\n");
}

StatusOr<CaseOutcome> FaintLightIsTold(SelfcheckBench& bench) {
  const auto point = [](double intensity) {
    return absl::StrFormat("LightSource \"point\" \"point3 from\" [0 0 1] \"rgb I\" [%g %g %g]\n",
                           intensity, intensity, intensity);
  };
  LUCERNA_ASSIGN_OR_RETURN(
      const SelfcheckRender* render,
      bench.Render(FloorUnder(absl::StrCat(point(2), point(2e-20))), SmallRender(4, 1000, 5)));
  // Photons of the faint one are too faint to count, and that must be said.
  const bool is_said = std::ranges::any_of(render->job.warnings(), [](const std::string& warning) {
    return warning.find("less than 4e-15 of the scene's power") != std::string::npos;
  });
  // A twentieth of the 4096 samples is drawn from it in vain: five deviations of what that loses.
  return AtMost(std::abs(MeanOf(render->image) * std::numbers::pi - 1) + (is_said ? 0 : 1), 0.02,
                "relative difference to the other light's, and 1 without a warning");
}

}  // namespace

std::vector<SelfcheckCase> ExtremeCases() {
  const RenderOverrides direct = SmallRender(16, 1, 1);
  return {
      {"extreme-no-light", "a room without light is black", IsBlackAndFinite(Furnace(0.5, 0))},
      {"extreme-no-surface", "a camera that sees no surface has a black image",
       IsBlackAndFinite(absl::StrCat(HeadText("0 0 0  0 0 1  0 1 0", 40, 8),
                                     LampText("-1 -1 -3  1 -1 -3  1 1 -3  -1 1 -3", 1)))},
      {"extreme-black-furnace", "in a shining room of black walls L = Le",
       MeanIs(Furnace(0, 1), SmallRender(2, 1000, 5), 1)},
      {"extreme-white-furnace", "with walls of albedo 1 and depth 10 L = 11 Le",
       MeanIs(Furnace(1, 1), SmallRender(4, 20000, 10), 11)},
      {"extreme-deep-furnace", "with walls of albedo 1 and depth 10000 the job ends, L = 10001 Le",
       MeanIs(Furnace(1, 1, 16), SmallRender(1, 60, 10000), 10001)},
      {"extreme-flat-furnace", "with depth 1 L = Le + direct light",
       MeanIs(Furnace(0.5, 1), SmallRender(2, 1000, 1), 1.5)},
      {"extreme-one-pixel", "an image of one pixel in a room of albedo 1/2: L = 2 Le",
       MeanIs(Furnace(0.5, 1, 1), WithRadius(SmallRender(16, 8000, 40), 0.3), 2)},
      {"extreme-one-photon", "passes of one photon, direct light and emission stay",
       [](SelfcheckBench& bench) -> StatusOr<CaseOutcome> {
         LUCERNA_ASSIGN_OR_RETURN(const SelfcheckRender* render,
                                  bench.Render(Furnace(0.5, 1), SmallRender(64, 1, 1)));
         return AtMost(std::abs(MeanOf(render->image) / 1.5 - 1) + NotFinite(render->image),
                       kRounding, "relative difference to 1.5");
       }},
      {"extreme-inside-glass", "seen from inside a glass ball an even sky is n² times as bright",
       MeanIs(InsideGlass(), SmallRender(64, 100, 100), 2.25)},
      {"extreme-same-index", "a pane of index 1 met at 89.99 degrees is not seen",
       MeanIs(GrazingPane(), SmallRender(8, 100, 8), 1)},
      {"extreme-total-reflection", "1000 total reflections keep the radiance",
       MeanIs(ThousandBounces(), SmallRender(4, 1, 2000), 1)},
      {"extreme-grazing-sun", "light from 89.9999 degrees gives its cosine",
       MeanIs(GrazingSun(89.9999), direct,
              3 * std::cos(89.9999 * std::numbers::pi / 180) * 0.5 / std::numbers::pi)},
      {"extreme-light-areas", "lights of areas 1e-12 and 1e6 add up",
       MeanIs(TinyAndHugeLamp(), SmallRender(32, 1, 1), TinyAndHugeRadiance())},
      {"extreme-next-door", "a light 1e20 times as strong next door changes nothing: L = 2 Le",
       MeanIs(BrighterNextDoor(), WithRadius(SmallRender(16, 8000, 40), 0.3), 2e-10)},
      {"extreme-faint", "a light of 1e-20 of the power is warned of", FaintLightIsTold},
      {"extreme-bad-triangles",
       "needles, faces without area or twice there, zero normals: no change",
       MeansAgree(FloorWith(kBadTriangles), FloorWith(""),
                  WithRadius(SmallRender(4, 50000, 5), 0.3))},
      {"extreme-radii", "radii from 1e-18 to 1e18 give finite images with every controller",
       EveryRadius},
      {"extreme-large-film", "3 x 3 pixels of 16384 x 16384 are those of a film of their own",
       MeansAgree(PartOfLargeFilm(true), PartOfLargeFilm(false), direct)},
  };
}

}  // namespace lucerna
