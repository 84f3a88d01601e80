#include "render/bake/chart_atlas.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "render/base/text.h"
#include "render/math/double3.h"

namespace lucerna {
namespace {

const double kSameChart = std::cos(45 * std::numbers::pi / 180);
// Texels with middles so far beside a chart belong to it: a bilinear look-up on the chart uses
// texels whose middles are less than a texel away in both directions.
constexpr double kBeside = 1.5;  // texels
constexpr int kMargin = 2;       // texels around a chart
// So many directions of edges are tried for the smallest box around a chart.
constexpr std::size_t kMostTurns = 32;

struct Point2 {
  double x = 0, y = 0;
};

// A plane in which a chart lies.
struct ChartFrame {
  Double3 origin, right, up;
  [[nodiscard]] Point2 Of(Double3 p) const { return {Dot(p - origin, right), Dot(p - origin, up)}; }
};

double CrossOf(Point2 a, Point2 b) {
  return a.x * b.y - a.y * b.x;
}
Point2 operator-(Point2 a, Point2 b) {
  return {a.x - b.x, a.y - b.y};
}

using Triangle2 = std::array<Point2, 3>;

// Barycentric shares; all above 0 inside.
std::array<double, 3> SharesOf(const Triangle2& t, Point2 p) {
  const double area = CrossOf(t[1] - t[0], t[2] - t[0]);
  const double b = CrossOf(p - t[0], t[2] - t[0]) / area;
  const double c = CrossOf(t[1] - t[0], p - t[0]) / area;
  return {1 - b - c, b, c};
}

struct Near {
  std::array<double, 3> shares{};
  double squared_distance = 0;
};

Near NearestOn(const Triangle2& t, Point2 p) {
  Near best;
  best.shares = SharesOf(t, p);
  if (std::ranges::min(best.shares) >= 0) return best;
  best.squared_distance = HUGE_VAL;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t next = (i + 1) % 3;
    const Point2 edge = t[next] - t[i];
    const Point2 from = p - t[i];
    const double length = edge.x * edge.x + edge.y * edge.y;
    const double along =
        length > 0 ? std::clamp((from.x * edge.x + from.y * edge.y) / length, 0.0, 1.0) : 0;
    const Point2 off = {from.x - along * edge.x, from.y - along * edge.y};
    const double squared = off.x * off.x + off.y * off.y;
    if (!(squared < best.squared_distance)) continue;
    best.squared_distance = squared;
    best.shares = {};
    best.shares[i] = 1 - along;
    best.shares[next] = along;
  }
  return best;
}

struct Chart {
  std::vector<std::uint32_t> faces;
  Double3 normal;  // unit
  ChartFrame frame;
  int width = 0, height = 0;  // with margins [texels]
  int x = 0, y = 0;           // of the lower left corner, y up
};

class Charting {
 public:
  Charting(const SurfaceMesh& mesh, double texel, std::size_t max_texels)
      : mesh_(mesh), texel_(texel), max_texels_(max_texels) {}

  StatusOr<ChartAtlas> Run() {
    FindCharts();
    for (Chart& chart : charts_)
      Turn(chart);
    ChartAtlas atlas;
    atlas.charts = charts_.size();
    if (!Pack(atlas)) {
      return absl::ResourceExhaustedError(
          Concat("the light map has more than ", max_texels_, " texels; give a larger spacing"));
    }
    atlas.chart_of.resize(mesh_.faces().size());
    atlas.places.resize(mesh_.faces().size());
    for (std::uint32_t number = 0; number < charts_.size(); ++number)
      AddTexels(number, atlas);
    std::ranges::sort(atlas.texels, [](const ChartAtlas::Texel& a, const ChartAtlas::Texel& b) {
      return std::pair(a.y, a.x) < std::pair(b.y, b.x);
    });
    return atlas;
  }

 private:
  [[nodiscard]] Double3 At(std::uint32_t vertex) const {
    return Double3(mesh_.vertices()[vertex].position);
  }
  [[nodiscard]] Double3 CrossOfFace(std::uint32_t face) const {
    const auto& v = mesh_.faces()[face].vertices;
    return Cross(At(v[1]) - At(v[0]), At(v[2]) - At(v[0]));
  }
  [[nodiscard]] Triangle2 ProjectedOf(std::uint32_t face, const ChartFrame& frame) const {
    const auto& v = mesh_.faces()[face].vertices;
    return {frame.Of(At(v[0])), frame.Of(At(v[1])), frame.Of(At(v[2]))};
  }
  [[nodiscard]] static ChartFrame FrameOf(Double3 normal, Double3 along, Double3 origin) {
    const Double3 across = along - normal * Dot(along, normal);
    const Double3 right = across * (1 / Length(across));
    return {origin, right, Cross(normal, right)};
  }

  // Calls `visit` for the cells of a grid of texels whose middles lie in the box around a triangle,
  // `beyond` texels wider.
  template <typename Visit>
  void ForEachCell(const Triangle2& t, double beyond, const Visit& visit) const {
    const auto [x0, x1] = std::minmax({t[0].x, t[1].x, t[2].x});
    const auto [y0, y1] = std::minmax({t[0].y, t[1].y, t[2].y});
    const auto first = [&](double low) {
      return static_cast<std::int64_t>(std::ceil(low / texel_ - beyond - 0.5));
    };
    const auto last = [&](double high) {
      return static_cast<std::int64_t>(std::floor(high / texel_ + beyond - 0.5));
    };
    for (std::int64_t y = first(y0); y <= last(y1); ++y) {
      for (std::int64_t x = first(x0); x <= last(x1); ++x) {
        visit(x, y,
              Point2{(static_cast<double>(x) + 0.5) * texel_,
                     (static_cast<double>(y) + 0.5) * texel_});
      }
    }
  }

  void FindCharts() {
    const auto& faces = mesh_.faces();
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> beside;
    for (std::uint32_t face = 0; face < faces.size(); ++face) {
      const auto& v = faces[face].vertices;
      for (std::size_t i = 0; i < 3; ++i)
        beside[std::minmax(v[i], v[(i + 1) % 3])].push_back(face);
    }
    std::vector<bool> is_taken(faces.size());
    for (std::uint32_t seed = 0; seed < faces.size(); ++seed) {
      if (is_taken[seed]) continue;
      Chart chart;
      const Double3 cross = CrossOfFace(seed);
      chart.normal = cross * (1 / Length(cross));
      const auto& corners = faces[seed].vertices;
      const ChartFrame frame =
          FrameOf(chart.normal, At(corners[1]) - At(corners[0]), At(corners[0]));
      std::set<std::pair<std::int64_t, std::int64_t>> covered;
      const auto take = [&](std::uint32_t face) {
        const Double3 own = CrossOfFace(face);
        if (!(Dot(own, chart.normal) >= kSameChart * Length(own))) return false;
        const Triangle2 triangle = ProjectedOf(face, frame);
        std::vector<std::pair<std::int64_t, std::int64_t>> cells;
        bool is_free = true;
        ForEachCell(triangle, 0, [&](std::int64_t x, std::int64_t y, Point2 middle) {
          // What lies on an edge is in none of its faces.
          if (!(std::ranges::min(SharesOf(triangle, middle)) > 1e-9)) return;
          cells.emplace_back(x, y);
          is_free = is_free && !covered.contains({x, y});
        });
        if (!is_free) return false;
        covered.insert(cells.begin(), cells.end());
        is_taken[face] = true;
        chart.faces.push_back(face);
        return true;
      };
      take(seed);
      for (std::size_t next = 0; next < chart.faces.size(); ++next) {
        const auto& v = faces[chart.faces[next]].vertices;
        for (std::size_t i = 0; i < 3; ++i) {
          for (const std::uint32_t face : beside[std::minmax(v[i], v[(i + 1) % 3])]) {
            if (!is_taken[face]) take(face);
          }
        }
      }
      charts_.push_back(std::move(chart));
    }
  }

  // Chooses the frame with the smallest box, with its origin where the chart's margins begin.
  void Turn(Chart& chart) const {
    double smallest = HUGE_VAL;
    std::size_t turns = 0;
    for (const std::uint32_t face : chart.faces) {
      if (turns == kMostTurns) break;
      const auto& v = mesh_.faces()[face].vertices;
      for (std::size_t i = 0; i < 3 && turns < kMostTurns; ++i, ++turns) {
        ChartFrame frame = FrameOf(chart.normal, At(v[(i + 1) % 3]) - At(v[i]), At(v[i]));
        Point2 low = {HUGE_VAL, HUGE_VAL};
        Point2 high = {-HUGE_VAL, -HUGE_VAL};
        for (const std::uint32_t of : chart.faces) {
          for (const Point2 p : ProjectedOf(of, frame)) {
            low = {std::min(low.x, p.x), std::min(low.y, p.y)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y)};
          }
        }
        const double area = (high.x - low.x) * (high.y - low.y);
        if (!(area < smallest)) continue;
        smallest = area;
        const double margin = kMargin * texel_;
        frame.origin = frame.origin + frame.right * (low.x - margin) + frame.up * (low.y - margin);
        chart.frame = frame;
        const auto cells = [&](double length) {
          return static_cast<int>(std::min(std::ceil(length / texel_), 1e8)) + 2 * kMargin;
        };
        chart.width = cells(high.x - low.x);
        chart.height = cells(high.y - low.y);
      }
    }
  }

  // On shelves, the highest charts first. False: too many texels.
  bool Pack(ChartAtlas& atlas) {
    double area = 0;
    int widest = 0;
    for (const Chart& chart : charts_) {
      area += static_cast<double>(chart.width) * chart.height;
      widest = std::max(widest, chart.width);
    }
    if (!(area <= static_cast<double>(max_texels_))) return false;
    std::vector<std::uint32_t> order(charts_.size());
    for (std::uint32_t i = 0; i < order.size(); ++i)
      order[i] = i;
    std::ranges::stable_sort(order, [&](std::uint32_t a, std::uint32_t b) {
      return charts_[a].height > charts_[b].height;
    });
    atlas.width = std::max(widest, static_cast<int>(std::ceil(std::sqrt(1.1 * area))));
    int x = 0;
    int y = 0;
    int shelf = 0;
    for (const std::uint32_t number : order) {
      Chart& chart = charts_[number];
      if (x + chart.width > atlas.width) {
        x = 0;
        y += shelf;
        shelf = 0;
      }
      chart.x = x;
      chart.y = y;
      x += chart.width;
      shelf = std::max(shelf, chart.height);
    }
    atlas.height = y + shelf;
    return static_cast<std::size_t>(atlas.width) * static_cast<std::size_t>(atlas.height) <=
           max_texels_;
  }

  void AddTexels(std::uint32_t number, ChartAtlas& atlas) const {
    const Chart& chart = charts_[number];
    struct Owner {
      std::uint32_t face = 0;
      Near near;
    };
    std::map<std::pair<std::int64_t, std::int64_t>, Owner> owners;
    const double beside = kBeside * texel_;
    for (const std::uint32_t face : chart.faces) {
      const Triangle2 triangle = ProjectedOf(face, chart.frame);
      atlas.chart_of[face] = number;
      for (std::size_t i = 0; i < 3; ++i) {
        atlas.places[face][i] = {
            static_cast<float>(chart.x + triangle[i].x / texel_),
            static_cast<float>(atlas.height - (chart.y + triangle[i].y / texel_))};
      }
      ForEachCell(triangle, kBeside, [&](std::int64_t x, std::int64_t y, Point2 middle) {
        const Near near = NearestOn(triangle, middle);
        if (!(near.squared_distance <= beside * beside)) return;
        const auto [owner, is_new] = owners.try_emplace({x, y}, Owner{face, near});
        if (is_new || !(near.squared_distance < owner->second.near.squared_distance)) return;
        owner->second = {face, near};
      });
    }
    for (const auto& [cell, owner] : owners) {
      const MeshFace& face = mesh_.faces()[owner.face];
      Double3 position;
      Double3 normal;
      for (std::size_t i = 0; i < 3; ++i) {
        position = position + At(face.vertices[i]) * owner.near.shares[i];
        normal = normal + Double3(mesh_.vertices()[face.vertices[i]].normal) * owner.near.shares[i];
      }
      ChartAtlas::Texel texel;
      texel.x = chart.x + static_cast<int>(cell.first);
      texel.y = atlas.height - 1 - (chart.y + static_cast<int>(cell.second));
      texel.chart = number;
      texel.face = owner.face;
      const Double3 cross = CrossOfFace(owner.face);
      if (owner.near.squared_distance == 0) {
        texel.area = texel_ * texel_ * Length(cross) / Dot(cross, chart.normal);
      }
      const Double3 of_face = cross * (1 / Length(cross));
      const Double3 unit = Length(normal) > 0 ? normal * (1 / Length(normal)) : of_face;
      texel.sensor = mesh_.SensorOn(face, ToFloat(position), ToFloat(unit));
      texel.sensor.spacing = static_cast<float>(texel_);
      atlas.texels.push_back(texel);
    }
  }

  const SurfaceMesh& mesh_;
  const double texel_;
  const std::size_t max_texels_;
  std::vector<Chart> charts_;
};

}  // namespace

StatusOr<ChartAtlas> ChartAtlasOf(const SurfaceMesh& mesh, double texel, std::size_t max_texels) {
  // More texels than that are not even to be listed.
  double area = 0;
  for (const MeshFace& face : mesh.faces())
    area += mesh.AreaOf(face);
  if (!(area * kSameChart <= static_cast<double>(max_texels) * texel * texel)) {
    return absl::ResourceExhaustedError(
        Concat("the light map has more than ", max_texels, " texels; give a larger spacing"));
  }
  return Charting(mesh, texel, max_texels).Run();
}

Image AtlasImage(const ChartAtlas& atlas, const std::vector<Irradiance>& measured) {
  Image image;
  image.width = atlas.width;
  image.height = atlas.height;
  const auto pixels =
      static_cast<std::size_t>(atlas.width) * static_cast<std::size_t>(atlas.height);
  for (const char* name :
       {"R", "G", "B", "noise", "P.X", "P.Y", "P.Z", "N.X", "N.Y", "N.Z", "chart", "inside"}) {
    image.channels.push_back({name, std::vector<float>(pixels)});
  }
  for (std::size_t i = 0; i < atlas.texels.size(); ++i) {
    const ChartAtlas::Texel& texel = atlas.texels[i];
    const auto at = static_cast<std::size_t>(texel.y) * static_cast<std::size_t>(atlas.width) +
                    static_cast<std::size_t>(texel.x);
    const Rgb e = measured[i].value;
    const Vec3 p = texel.sensor.position;
    const Vec3 n = texel.sensor.normal;
    const std::array<float, 12> values = {e.r,
                                          e.g,
                                          e.b,
                                          measured[i].noise,
                                          p.x,
                                          p.y,
                                          p.z,
                                          n.x,
                                          n.y,
                                          n.z,
                                          static_cast<float>(texel.chart + 1),
                                          texel.area > 0 ? 1.0F : 0.0F};
    for (std::size_t channel = 0; channel < values.size(); ++channel)
      image.channels[channel].pixels[at] = values[channel];
  }
  return image;
}

BakedMesh AtlasMesh(const SurfaceMesh& mesh, const ChartAtlas& atlas, const Image& image) {
  const auto bilinear_at = [&](const std::string& channel, Vec2 place) {
    const std::vector<float>& pixels = image.Find(channel)->pixels;
    const double x = static_cast<double>(place.x) - 0.5;
    const double y = static_cast<double>(place.y) - 0.5;
    const double x0 = std::floor(x);
    const double y0 = std::floor(y);
    double sum = 0;
    for (const int dy : {0, 1}) {
      for (const int dx : {0, 1}) {
        const double weight = (dx == 0 ? 1 - (x - x0) : x - x0) * (dy == 0 ? 1 - (y - y0) : y - y0);
        const auto at = static_cast<std::size_t>(y0 + dy) * static_cast<std::size_t>(image.width) +
                        static_cast<std::size_t>(x0 + dx);
        if (weight > 0) sum += weight * static_cast<double>(pixels[at]);
      }
    }
    return static_cast<float>(sum);
  };
  BakedMesh baked;
  std::map<std::uint32_t, std::size_t> at;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> vertex_at;  // vertex, chart
  for (std::size_t number = 0; number < mesh.faces().size(); ++number) {
    const MeshFace& face = mesh.faces()[number];
    const auto [found, is_new] = at.try_emplace(face.surface, baked.surfaces.size());
    if (is_new) {
      BakedMesh::Surface& added = baked.surfaces.emplace_back();
      added.name = NameOf(mesh.surfaces()[face.surface]);
      added.material = mesh.surfaces()[face.surface].name;
    }
    BakedMesh::Surface& to = baked.surfaces[found->second];
    std::array<std::uint32_t, 3> corners{};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [known, is_first] =
          vertex_at.try_emplace({face.vertices[i], atlas.chart_of[number]},
                                static_cast<std::uint32_t>(to.positions.size()));
      corners[i] = known->second;
      if (!is_first) continue;
      const MeshVertex& vertex = mesh.vertices()[face.vertices[i]];
      const Vec2 place = atlas.places[number][i];
      to.positions.push_back(vertex.position);
      to.normals.push_back(vertex.normal);
      to.irradiance.push_back(
          {bilinear_at("R", place), bilinear_at("G", place), bilinear_at("B", place)});
      to.noise.push_back(bilinear_at("noise", place));
      to.uvs.push_back(
          {place.x / static_cast<float>(atlas.width), place.y / static_cast<float>(atlas.height)});
    }
    to.faces.push_back(corners);
  }
  return baked;
}

std::vector<SurfaceFigures> FiguresOf(const SurfaceMesh& mesh, const ChartAtlas& atlas,
                                      const std::vector<Irradiance>& measured) {
  struct Sums {
    SurfaceFigures figures;
    double flux = 0, area = 0;  // of texels
  };
  std::map<std::uint32_t, Sums> of_surface;
  for (const MeshFace& face : mesh.faces()) {
    Sums& sums = of_surface[face.surface];
    sums.figures.name = NameOf(mesh.surfaces()[face.surface]);
    sums.figures.lowest = HUGE_VAL;
    sums.figures.area += mesh.AreaOf(face);
    ++sums.figures.triangles;
  }
  for (std::size_t i = 0; i < atlas.texels.size(); ++i) {
    const ChartAtlas::Texel& texel = atlas.texels[i];
    Sums& sums = of_surface[mesh.faces()[texel.face].surface];
    const auto value = static_cast<double>(Luminance(measured[i].value));
    // Those beside a chart measure points on its border.
    sums.figures.lowest = std::min(sums.figures.lowest, value);
    sums.figures.highest = std::max(sums.figures.highest, value);
    sums.flux += texel.area * value;
    sums.area += texel.area;
  }
  std::vector<SurfaceFigures> figures;
  for (auto& [surface, sums] : of_surface) {
    sums.figures.mean = sums.area > 0 ? sums.flux / sums.area : 0;
    figures.push_back(std::move(sums.figures));
  }
  return figures;
}

}  // namespace lucerna
