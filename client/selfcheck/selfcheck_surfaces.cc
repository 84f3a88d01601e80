// Do glass, mirrors, metal and meshes keep light at the ends of their ranges?
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "client/selfcheck/selfcheck.h"
#include "client/selfcheck/selfcheck_means.h"

namespace lucerna {
namespace {

constexpr double kPi = std::numbers::pi;

std::string InAttribute(const std::string& text) {
  return absl::StrCat("AttributeBegin\n", text, "AttributeEnd\n");
}
std::string Diffuse(double reflectance) {
  return absl::StrFormat("Material \"diffuse\" \"rgb reflectance\" [%.17g %.17g %.17g]\n",
                         reflectance, reflectance, reflectance);
}
std::string Glass(double index) {
  return absl::StrFormat("Material \"dielectric\" \"float eta\" [%.17g]\n", index);
}
std::string Ball(const std::string& center, double radius) {
  return absl::StrFormat(
      "AttributeBegin\nTranslate %s\nShape \"sphere\" \"float radius\" [%.17g]\n"
      "AttributeEnd\n",
      center, radius);
}
// Around the axis z, without its sides.
std::string Slab(double half_width, double low, double high) {
  const double w = half_width;
  return absl::StrCat(QuadText(absl::StrFormat("%.17g %.17g %.17g  %.17g %.17g %.17g  %.17g %.17g "
                                               "%.17g  %.17g %.17g %.17g",
                                               -w, -w, high, w, -w, high, w, w, high, -w, w, high)),
                      QuadText(absl::StrFormat("%.17g %.17g %.17g  %.17g %.17g %.17g  %.17g %.17g "
                                               "%.17g  %.17g %.17g %.17g",
                                               -w, -w, low, -w, w, low, w, w, low, w, -w, low)));
}
// A beam of intensity 1, times `intensity`.
std::string Beam(const std::string& from, const std::string& to, double cos_angle,
                 double intensity) {
  return absl::StrFormat(
      "LightSource \"spot\" \"point3 from\" [%s] \"point3 to\" [%s] \"float coneangle\" [%.17g]"
      " \"float conedeltaangle\" [0] \"rgb I\" [%.17g %.17g %.17g]\n",
      from, to, std::acos(cos_angle) * 180 / kPi, intensity, intensity, intensity);
}

// --- glass -------------------------------------------------------------------------------------

std::string RoomWith(const std::string& more) {
  return absl::StrCat(HeadText("0 -2 1  0 0 0  0 0 1", 12, 8), Diffuse(0.5),
                      QuadText("-1 -1 0  1 -1 0  1 1 0  -1 1 0"),
                      LampText("-0.3 -0.3 1.5  -0.3 0.3 1.5  0.3 0.3 1.5  0.3 -0.3 1.5", 3), more);
}

// Two panes with a gap of 10 microns between them and a light.
std::string Panes() {
  return absl::StrCat(HeadText("0 0 0.1  0 0 1  0 1 0", 0.05, 16),
                      LampText("-1 -1 3  -1 1 3  1 1 3  1 -1 3", 1), Glass(1.5), Slab(3, 1, 1.5),
                      Slab(3, 1.50001, 2));
}

// Balls in and beside a ball, all lit by one beam, in a ball of black walls.
StatusOr<CaseOutcome> NestedBalls(SelfcheckBench& bench) {
  const std::string text = absl::StrCat(
      HeadText("-1.5 1 1.5  -3 2 3  0 1 0", 10, 2), Beam("0 -1.7 0", "0 0 0", 0.82, 1),
      InAttribute(absl::StrCat("ReverseOrientation\n", Diffuse(1e-6), Ball("0 0 0", 4))),
      Glass(1.5), Ball("0 0 0", 1), Ball("0 2 0", 1), Glass(1.33 / 1.5), Ball("0.25 0 0", 0.5),
      Ball("-0.75 0 0", 0.25), Glass(1.5 / 1.33), Ball("0.25 0 0", 0.25));
  LUCERNA_ASSIGN_OR_RETURN(const SelfcheckRender* render,
                           bench.Render(text, WithRadius(SmallRender(1, 200000, 1000), 0.1)));
  const v1::Tally& tally = render->job.progress().tally();
  const v1::Energy& energy = tally.energy();
  // What is cut off goes round in a ball for ever: reflected by one inside it, totally since then.
  constexpr double kTrapped = 1e-4;
  const double emitted = static_cast<double>(energy.emitted());
  CaseOutcome outcome =
      AtMost(static_cast<double>(energy.escaped()) / emitted + static_cast<double>(tally.dropped()),
             0, "share of the power that went past the walls");
  outcome.holds = outcome.holds && static_cast<double>(energy.cut_off()) <= kTrapped * emitted;
  return outcome;
}

// --- metal and mirrors -------------------------------------------------------------------------

std::string MetalUnder(const std::string& light, double alpha) {
  return absl::StrCat(
      HeadText("2 0 2  0 0 0  0 0 1", 0.02, 16), light,
      absl::StrFormat("Material \"conductor\" \"rgb eta\" [0.2 0.2 0.2] \"rgb k\" [3 3 3]"
                      " \"float roughness\" [%.17g] \"bool remaproughness\" [false]\n",
                      alpha),
      QuadText("-3 -3 0  3 -3 0  3 3 0  -3 3 0"));
}
constexpr char kSky[] = "LightSource \"infinite\" \"rgb L\" [1 1 1]\n";
constexpr char kShell[] =
    "AttributeBegin\nReverseOrientation\nMaterial \"diffuse\" \"rgb reflectance\" [0 0 0]\n"
    "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\nShape \"sphere\" \"float radius\" [1000]\n"
    "AttributeEnd\n";

// A hollow mirror gathers a beam on a plate, on a spot some 1e6 times as bright as the beam: a disc
// so wide that all photons are in it measures their flux.
StatusOr<CaseOutcome> Focus(SelfcheckBench& bench) {
  constexpr double kPlate = 1 - 0.672414;  // 1 / 1.95 + 1 / 0.672414 = 2
  constexpr double kDark = 1e-3;
  constexpr double kCos = 0.9999;
  constexpr double kRadius = 1e6;
  constexpr double kPhotons = 100000;
  const std::string text = absl::StrCat(
      HeadText(absl::StrFormat("0.01 0 0.35  0 0 %.17g  0 1 0", kPlate), 2, 2),
      Beam("0 0 -0.95", "0 0 0", kCos, 1),
      InAttribute(absl::StrFormat("%sShape \"disk\" \"float radius\" [0.004] \"float height\""
                                  " [%.17g]\n",
                                  Diffuse(kDark), kPlate)),
      "ReverseOrientation\nMaterial \"conductor\" \"rgb eta\" [1 1 1] \"rgb k\" [1000 1000 1000]"
      " \"float roughness\" [0]\nShape \"sphere\" \"float radius\" [1]\n");
  RenderOverrides overrides =
      WithRadius(SmallRender(1, static_cast<std::int64_t>(kPhotons), 3), kRadius);
  overrides.kernel = KernelKind::kConstant;
  overrides.radius_controller = RadiusControllerKind::kPpm;
  LUCERNA_ASSIGN_OR_RETURN(const SelfcheckRender* render, bench.Render(text, overrides));
  const double flux = MeanOf(render->image) * kPi / kDark * kPi * kRadius * kRadius;
  // The plate's own shadow is in the beam, and takes its share of the photons.
  const double shadow = 1 - std::cos(std::atan(0.004 / (0.95 + kPlate)));
  const double share = shadow / (1 - kCos);
  const double deviation = std::sqrt(share / (1 - share) / kPhotons);
  return AtMost(std::abs(flux / (2 * kPi * (1 - kCos - shadow)) - 1), 4 * deviation + 1e-4,
                "relative difference of the flux to that of the beam");
}

// A wall lit by a light that has a hundredth of the light, through a ball of index 1 and so by
// photons alone; beside it a spot that is 1e6 times as bright, made by a beam of all the rest.
std::string DarkWall(bool has_caustic) {
  std::string text =
      absl::StrCat(HeadText("0 -1 1  0.3 0 0  0 0 1", 40, 8), Diffuse(0.1),
                   QuadText("-1 -1 0  3 -1 0  3 1 0  -1 1 0"),
                   "LightSource \"point\" \"point3 from\" [0 0 1] \"rgb I\" [1 1 1]\n", Glass(1),
                   Ball("0 0 1", 0.1));
  if (has_caustic) {
    absl::StrAppend(&text, Beam("1.5 0 1", "1.5 0 0", 1 - 2e-4, 1e6),
                    InAttribute(absl::StrCat("Translate 1.5 0 0\n", Slab(0.3, 0.4, 0.6))));
  }
  return text;
}

// --- meshes ------------------------------------------------------------------------------------

// A floor of side 6 around the origin, of 2 side² triangles that share their corners.
std::string MeshFloor(int side) {
  std::string text = "Shape \"trianglemesh\" \"point3 P\" [";
  for (int y = 0; y <= side; ++y) {
    for (int x = 0; x <= side; ++x)
      absl::StrAppend(&text, 6.0 * x / side - 3, " ", 6.0 * y / side - 3, " 0\n");
  }
  absl::StrAppend(&text, "] \"integer indices\" [");
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const int at = y * (side + 1) + x;
      absl::StrAppend(&text, at, " ", at + 1, " ", at + side + 2, " ");
      absl::StrAppend(&text, at, " ", at + side + 2, " ", at + side + 1, "\n");
    }
  }
  return text + "]\n";
}

// 2 W/sr a metre above the middle.
std::string FloorOf(const std::string& shape) {
  return absl::StrCat(HeadText("2.5 0 1  0 0 0  0 0 1", 0.05, 4),
                      "LightSource \"point\" \"point3 from\" [0 0 1] \"rgb I\" [2 2 2]\n",
                      Diffuse(0.5), shape);
}

StatusOr<CaseOutcome> MeshesOfAllSizes(SelfcheckBench& bench) {
  double worst = 0;
  for (const std::string& shape :
       {std::string("Shape \"trianglemesh\" \"point3 P\" [-9 -9 0  9 -9 0  0 9 0]"
                    " \"integer indices\" [0 1 2]\n"),
        MeshFloor(30), MeshFloor(1000)}) {
    LUCERNA_ASSIGN_OR_RETURN(const SelfcheckRender* render,
                             bench.Render(FloorOf(shape), SmallRender(2, 1000, 1)));
    worst = std::max(worst, std::abs(MeanOf(render->image) * kPi - 1));
  }
  return AtMost(worst, kRounding, "largest relative difference to 1 / pi");
}

}  // namespace

std::vector<SelfcheckCase> SurfaceCases() {
  constexpr double kReflectance = 0.04;  // of a face of index 1.5, met straight
  const std::string no_glass = absl::StrCat(Glass(1), Ball("0.1 0 0.6", 0.5), Slab(0.9, 1.15, 1.3));
  return {
      {"surface-same-index", "a ball and a slab of index 1 between light and floor change nothing",
       MeansAgree(RoomWith(no_glass), RoomWith(""), WithRadius(SmallRender(3, 100000, 8), 0.12))},
      {"surface-panes", "two panes 1e-5 apart let (1 - R) / (1 + 3 R) through",
       MeanIs(Panes(), SmallRender(64, 1, 100), (1 - kReflectance) / (1 + 3 * kReflectance))},
      {"surface-nested-balls", "balls in a ball and touching it lose no photon", NestedBalls},
      {"surface-smoothest", "metal of roughness 1e-6 is the mirror of roughness 0",
       MeansAgree(MetalUnder(kSky, 1e-6), MetalUnder(kSky, 0), SmallRender(16, 1, 4))},
      {"surface-roughest", "metal of roughness 1 under a sky is as under a shell as bright",
       MeansAgree(MetalUnder(kSky, 1), MetalUnder(kShell, 1), SmallRender(64, 1, 1))},
      {"surface-focus", "a hollow mirror brings all light of a beam to its focus", Focus},
      {"surface-dark-wall", "a caustic 1e6 times as bright leaves the wall beside it as it was",
       MeansAgree(DarkWall(true), DarkWall(false), WithRadius(SmallRender(6, 200000, 5), 0.2))},
      {"surface-meshes", "floors of 1, 1800 and 2000000 triangles are the same floor",
       MeshesOfAllSizes},
  };
}

}  // namespace lucerna
