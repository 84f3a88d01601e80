#include "client/bake/irradiance_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"

#include "render/bake/surface_figures.h"
#include "render/film/false_color.h"
#include "render/math/double3.h"

namespace lucerna {
namespace {

constexpr double kWidth = 800;  // of the plan [px]
constexpr double kMargin = 20;
constexpr double kScaleWidth = 110;
const double kSameDirection = std::cos(30 * std::numbers::pi / 180);
// The share of the area whose irradiance the bands divide evenly.
constexpr double kShown = 0.99;

struct Corner {
  double x = 0, y = 0;  // on the plan [px]
  double value = 0;     // [lx or W/m²]
};
using Polygon = std::vector<Corner>;

struct PlanFace {
  std::array<Corner, 3> corners;
  std::size_t surface = 0;
  double depth = 0;  // towards the eye
  double area = 0;
};

Corner Between(const Corner& a, const Corner& b, double level) {
  const double t = (level - a.value) / (b.value - a.value);
  return {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), level};
}

// The part of a polygon at or above a level; below it with `sign` -1.
Polygon Clip(const Polygon& polygon, double level, double sign) {
  Polygon left;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Corner& a = polygon[i];
    const Corner& b = polygon[(i + 1) % polygon.size()];
    const bool a_is_in = sign * (a.value - level) >= 0;
    const bool b_is_in = sign * (b.value - level) >= 0;
    if (a_is_in) left.push_back(a);
    if (a_is_in != b_is_in) left.push_back(Between(a, b, level));
  }
  return left;
}

std::string ColorOf(double share) {
  const std::array<double, 3> color = FalseColor(share);
  return absl::StrFormat("#%02x%02x%02x", static_cast<int>(std::lround(color[0])),
                         static_cast<int>(std::lround(color[1])),
                         static_cast<int>(std::lround(color[2])));
}

// 1, 2 or 5 times a power of ten: at most so large that `range` has ten parts.
double NiceStep(double range) {
  const double power = std::pow(10, std::floor(std::log10(range / 10)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= range / 10) return factor * power;
  }
  return power;
}

Double3 NormalOf(const BakedMesh::Surface& surface, const std::array<std::uint32_t, 3>& face) {
  return TriangleCross(surface.positions[face[0]], surface.positions[face[1]],
                       surface.positions[face[2]]);
}

// Unit, of the surface with the largest area; from above when its faces cancel each other.
Double3 ViewOf(const BakedMesh& mesh) {
  double largest = -1;
  Double3 view;
  for (const BakedMesh::Surface& surface : mesh.surfaces) {
    Double3 sum;
    double area = 0;
    for (const auto& face : surface.faces) {
      const Double3 normal = NormalOf(surface, face);
      sum = sum + normal;
      area += Length(normal);
    }
    if (area > largest) {
      largest = area;
      view = Length(sum) > 1e-6 * area ? sum * (1 / Length(sum)) : Double3(0, 0, 1);
    }
  }
  return view;
}

// The value below which so much of the area is.
double Quantile(std::vector<PlanFace> faces, double share) {
  const auto mean = [](const PlanFace& face) {
    return (face.corners[0].value + face.corners[1].value + face.corners[2].value) / 3;
  };
  std::ranges::sort(faces, [&](const PlanFace& a, const PlanFace& b) { return mean(a) < mean(b); });
  double total = 0;
  for (const PlanFace& face : faces)
    total += face.area;
  double sum = 0;
  for (const PlanFace& face : faces) {
    sum += face.area;
    if (sum >= share * total) return mean(face);
  }
  return 0;
}

void AppendPath(const Polygon& polygon, std::string& path) {
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    absl::StrAppendFormat(&path, "%s%.1f %.1f", i == 0 ? "M" : "L", polygon[i].x, polygon[i].y);
  }
  path += "Z";
}

}  // namespace

std::string IrradiancePlan(const BakedMesh& mesh, bool in_lux) {
  const Double3 view = ViewOf(mesh);
  // Of the world's axes the one that is most across the view points up or to the right.
  const bool is_from_above =
      std::abs(view.z) > std::max(std::abs(view.x), std::abs(view.y)) || view.x == 0;
  const Double3 about_up = is_from_above ? Double3(0, 1, 0) : Double3(0, 0, 1);
  Double3 up = about_up + view * -Dot(about_up, view);
  if (!(Length(up) > 1e-6)) up = Double3(0, 0, 1) + view * -view.z;
  up = up * (1 / Length(up));
  const Double3 right = Cross(up, view);

  const double factor = in_lux ? kLumensPerWatt : 1;
  std::vector<PlanFace> faces;
  std::array<double, 2> low = {HUGE_VAL, HUGE_VAL};
  std::array<double, 2> high = {-HUGE_VAL, -HUGE_VAL};
  std::vector<double> depths(mesh.surfaces.size());  // means over the area
  for (std::size_t number = 0; number < mesh.surfaces.size(); ++number) {
    const BakedMesh::Surface& surface = mesh.surfaces[number];
    double area = 0;
    for (const auto& face : surface.faces) {
      const Double3 normal = NormalOf(surface, face);
      if (!(Dot(normal, view) > kSameDirection * Length(normal))) continue;
      PlanFace plan;
      plan.surface = number;
      plan.area = Length(normal) / 2;
      for (std::size_t i = 0; i < 3; ++i) {
        const Double3 at(surface.positions[face[i]]);
        plan.corners[i] = {Dot(at, right), Dot(at, up),
                           factor * static_cast<double>(Luminance(surface.irradiance[face[i]]))};
        plan.depth += Dot(at, view) / 3;
        low = {std::min(low[0], plan.corners[i].x), std::min(low[1], plan.corners[i].y)};
        high = {std::max(high[0], plan.corners[i].x), std::max(high[1], plan.corners[i].y)};
      }
      depths[number] += plan.area * plan.depth;
      area += plan.area;
      faces.push_back(plan);
    }
    if (area > 0) depths[number] /= area;
  }
  // Lines of a surface must not be seen through the ones above it.
  std::ranges::stable_sort(faces, [&](const PlanFace& a, const PlanFace& b) {
    return std::tuple(depths[a.surface], a.surface, a.depth) <
           std::tuple(depths[b.surface], b.surface, b.depth);
  });
  const double extent = std::max({high[0] - low[0], high[1] - low[1], 1e-30});
  const double pixels = kWidth / extent;
  const double height = std::max((high[1] - low[1]) * pixels, 260.0);
  for (PlanFace& face : faces) {
    for (Corner& corner : face.corners) {
      corner.x = kMargin + (corner.x - low[0]) * pixels;
      corner.y = kMargin + (high[1] - corner.y) * pixels;
    }
  }
  const double shown = Quantile(faces, kShown);
  const double step = NiceStep(shown > 0 ? shown : 1);
  const auto bands = static_cast<int>(std::ceil((shown > 0 ? shown : 1) / step));

  const double width = kWidth + kScaleWidth + 2 * kMargin;
  std::string svg = absl::StrFormat(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" "
      "font-family=\"sans-serif\" font-size=\"12\">\n"
      "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n",
      width, height + 2 * kMargin);
  std::string lines;
  const auto finish_surface = [&] {
    if (lines.empty()) return;
    svg += "<path d=\"" + lines + "\" fill=\"none\" stroke=\"black\" stroke-width=\".6\"/>\n";
    lines.clear();
  };
  std::size_t surface = faces.empty() ? 0 : faces.front().surface;
  for (const PlanFace& face : faces) {
    if (std::exchange(surface, face.surface) != face.surface) finish_surface();
    const Polygon whole(face.corners.begin(), face.corners.end());
    const auto [least, most] =
        std::ranges::minmax({face.corners[0].value, face.corners[1].value, face.corners[2].value});
    // Clamped as doubles: the brightest places may have more steps than an int holds.
    const auto band_of = [&](double value) {
      return static_cast<int>(std::clamp(value / step, 0.0, bands - 1.0));
    };
    const int first = band_of(least);
    const int last = band_of(most);
    for (int band = first; band <= last; ++band) {
      Polygon part = band > first ? Clip(whole, band * step, 1) : whole;
      if (band < last) part = Clip(part, (band + 1) * step, -1);
      if (part.size() < 3) continue;
      const std::string color = ColorOf((band + 0.5) / bands);
      std::string path;
      AppendPath(part, path);
      // A thin border of the same colour hides the seams between neighbours.
      svg += absl::StrFormat("<path d=\"%s\" fill=\"%s\" stroke=\"%s\" stroke-width=\".8\"/>\n",
                             path, color, color);
      if (band == first) continue;
      std::vector<Corner> ends;
      for (const Corner& corner : part) {
        if (corner.value == band * step) ends.push_back(corner);
      }
      if (ends.size() == 2) {
        absl::StrAppendFormat(&lines, "M%.1f %.1fL%.1f %.1f", ends[0].x, ends[0].y, ends[1].x,
                              ends[1].y);
      }
    }
  }
  finish_surface();

  const double left = kWidth + 2 * kMargin;
  const double part_height = std::min(24.0, height / (bands + 1));
  svg += absl::StrFormat("<text x=\"%.0f\" y=\"%.0f\">%s</text>\n", left, kMargin + 4,
                         in_lux ? "lx" : "W/m²");
  for (int band = 0; band < bands; ++band) {
    const double top = kMargin + 12 + part_height * (bands - 1 - band);
    svg += absl::StrFormat(
        "<rect x=\"%.0f\" y=\"%.1f\" width=\"22\" height=\"%.1f\" fill=\"%s\" "
        "stroke=\"black\" stroke-width=\".3\"/>\n<text x=\"%.0f\" y=\"%.1f\">%.4g</text>\n",
        left, top, part_height, ColorOf((band + 0.5) / bands), left + 28, top + part_height + 4,
        band * step);
  }
  return svg + "</svg>\n";
}

}  // namespace lucerna
