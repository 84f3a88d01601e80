#include "render/transport/picture_spread.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <utility>

#include "render/math/color_space.h"
#include "render/math/warp.h"

namespace lucerna {
namespace {

// A cell with a bright spot gets at least the light that it would have if this share of it were as
// bright: else photons of such spots would be few and strong.
constexpr double kLeastOfLargest = 1.0 / 8;
// Where light is looked up at places, some may have been missed.
constexpr double kLeastOfMean = 0.01;
// Surfaces without polygons: places that are looked up along a side, at least and at most.
constexpr int kFewestPlaces = 256;
constexpr int kMostPlaces = 1024;

// What a triangle shows is integrated pixel by pixel up to so many times the square of the most
// cells of a side, which fall with the number of emitters.
constexpr double kMostPixels = 4096;
// Of a picture that is repeated: lines farther off are not numbered.
constexpr double kFarthestPixel = 1 << 28;

using Color = std::array<double, 3>;

struct Point {
  double x = 0, y = 0;
};
// Convex. A parallelogram that is cut by two grid lines twice has at most 8 corners.
struct Polygon {
  std::array<Point, 12> corners;
  std::size_t count = 0;

  void Add(Point p) { corners[count++] = p; }
};

double DoubleArea(const Polygon& polygon) {
  double sum = 0;
  for (std::size_t i = 2; i < polygon.count; ++i) {
    const Point& o = polygon.corners[0];
    const Point& a = polygon.corners[i - 1];
    const Point& b = polygon.corners[i];
    sum += (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
  }
  return sum;
}

// The part of a polygon where sign × (coordinate - at) >= 0.
Polygon CutOff(const Polygon& polygon, double Point::*coordinate, double at, double sign) {
  Polygon left;
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const Point& a = polygon.corners[i];
    const Point& b = polygon.corners[(i + 1) % polygon.count];
    const double from = sign * (a.*coordinate - at);
    const double to = sign * (b.*coordinate - at);
    if (from >= 0) left.Add(a);
    if ((from > 0 && to < 0) || (from < 0 && to > 0)) {
      const double t = from / (from - to);
      Point cut = {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)};
      cut.*coordinate = at;
      left.Add(cut);
    }
  }
  return left;
}

// A picture as a function of the place in pixels, from the centre of the top left one, y downwards:
// between the lines at whole numbers it is bilinear. Where its edges are clamped it is the same
// beyond its first and last lines as there.
class Pixels {
 public:
  explicit Pixels(const AreaLight& light)
      : light_(light),
        picture_(*light.picture),
        across_{picture_.width, light.wrap_u},
        down_{picture_.height, light.wrap_v} {
    const auto luminance = [&](Rgb pixel) {
      return static_cast<double>(Luminance(light.radiance * ToWorking(pixel)));
    };
    luminance_ = {luminance({1, 0, 0}), luminance({0, 1, 0}), luminance({0, 0, 1})};
  }

  [[nodiscard]] Point PlaceOf(Vec2 uv) const {
    const Vec2 at = light_.mapping.Map({uv, {}, {}});
    return {static_cast<double>(at.x) * picture_.width - 0.5,
            (1 - static_cast<double>(at.y)) * picture_.height - 0.5};
  }
  [[nodiscard]] double LuminanceOf(const Color& c) const {
    return luminance_[0] * c[0] + luminance_[1] * c[1] + luminance_[2] * c[2];
  }

  // Adds the integral over a polygon to `integral`, and raises `largest` to the largest luminance
  // of the pixels that it lies between.
  void Integrate(const Polygon& polygon, Color& integral, double& largest) const {
    const auto [low, high] = Ends(polygon, &Point::y);
    const int first = down_.LineBefore(low);
    const int last = down_.LineBefore(high);
    for (int row = first; row <= last; ++row) {
      Polygon strip = polygon;
      if (down_.HasLine(row)) strip = CutOff(strip, &Point::y, row, 1);
      if (down_.HasLine(row + 1)) strip = CutOff(strip, &Point::y, row + 1, -1);
      if (strip.count > 2) IntegrateStrip(strip, row, integral, largest);
    }
  }

 private:
  // Lines along one side.
  struct Lines {
    int pixels;
    Texture::Wrap wrap;

    // The number of the line at or before a place. Where edges are clamped -1 before the first, and
    // never beyond the last.
    [[nodiscard]] int LineBefore(double place) const {
      const double within = wrap == Texture::Wrap::kClamp
                                ? std::clamp(place, -1.0, static_cast<double>(pixels - 1))
                                : place;
      return static_cast<int>(std::floor(within));
    }
    // Whether the picture changes its form there.
    [[nodiscard]] bool HasLine(int line) const {
      return wrap != Texture::Wrap::kClamp || (line >= 0 && line < pixels);
    }
  };
  static std::pair<double, double> Ends(const Polygon& polygon, double Point::*coordinate) {
    double low = HUGE_VAL;
    double high = -HUGE_VAL;
    for (std::size_t i = 0; i < polygon.count; ++i) {
      low = std::min(low, polygon.corners[i].*coordinate);
      high = std::max(high, polygon.corners[i].*coordinate);
    }
    return {low, high};
  }
  // The four pixels around a cell of the lines: top left, top right, bottom left, bottom right.
  [[nodiscard]] std::array<Color, 4> Around(int column, int row) const {
    const auto at = [&](int x, int y) {
      const int pixel_x = WrappedIndex(x, across_.pixels, across_.wrap);
      const int pixel_y = WrappedIndex(y, down_.pixels, down_.wrap);
      const Rgb pixel = pixel_x < 0 || pixel_y < 0 ? Rgb() : picture_.At(pixel_x, pixel_y);
      return Color{static_cast<double>(pixel.r), static_cast<double>(pixel.g),
                   static_cast<double>(pixel.b)};
    };
    return {at(column, row), at(column + 1, row), at(column, row + 1), at(column + 1, row + 1)};
  }

  // Between two neighbouring lines.
  void IntegrateStrip(const Polygon& strip, int row, Color& integral, double& largest) const {
    const auto [low, high] = Ends(strip, &Point::x);
    const int first = across_.LineBefore(low);
    const int last = across_.LineBefore(high);
    // A convex strip is narrowest at its ends: cells between those are in it as a whole.
    const auto [top, bottom] = Ends(strip, &Point::y);
    double whole_low = HUGE_VAL;
    double whole_high = -HUGE_VAL;
    if (down_.HasLine(row) && down_.HasLine(row + 1) && top <= row && bottom >= row + 1) {
      double left[2] = {HUGE_VAL, HUGE_VAL};
      double right[2] = {-HUGE_VAL, -HUGE_VAL};
      for (std::size_t i = 0; i < strip.count; ++i) {
        const Point& p = strip.corners[i];
        const int end = p.y <= row ? 0 : 1;
        if (p.y > row && p.y < row + 1) continue;
        left[end] = std::min(left[end], p.x);
        right[end] = std::max(right[end], p.x);
      }
      whole_low = std::max(left[0], left[1]);
      whole_high = std::min(right[0], right[1]);
    }
    for (int column = first; column <= last; ++column) {
      const std::array<Color, 4> around = Around(column, row);
      for (const Color& pixel : around)
        largest = std::max(largest, LuminanceOf(pixel));
      if (across_.HasLine(column) && across_.HasLine(column + 1) && column >= whole_low &&
          column + 1 <= whole_high) {
        for (std::size_t c = 0; c < 3; ++c)
          integral[c] += 0.25 * (around[0][c] + around[1][c] + around[2][c] + around[3][c]);
        continue;
      }
      Polygon piece = strip;
      if (across_.HasLine(column)) piece = CutOff(piece, &Point::x, column, 1);
      if (across_.HasLine(column + 1)) piece = CutOff(piece, &Point::x, column + 1, -1);
      if (piece.count > 2) IntegratePiece(piece, column, row, around, integral);
    }
  }

  // Within one cell, by triangles: the mean of the middles of a triangle's sides is exact for
  // polynomials of the second degree.
  static void IntegratePiece(const Polygon& piece, int column, int row,
                             const std::array<Color, 4>& around, Color& integral) {
    const auto add = [&](const Point& a, const Point& b, double weight) {
      const double s = std::clamp(0.5 * (a.x + b.x) - column, 0.0, 1.0);
      const double t = std::clamp(0.5 * (a.y + b.y) - row, 0.0, 1.0);
      for (std::size_t c = 0; c < 3; ++c) {
        const double above = around[0][c] + s * (around[1][c] - around[0][c]);
        const double below = around[2][c] + s * (around[3][c] - around[2][c]);
        integral[c] += weight * (above + t * (below - above));
      }
    };
    for (std::size_t i = 2; i < piece.count; ++i) {
      const Point& o = piece.corners[0];
      const Point& a = piece.corners[i - 1];
      const Point& b = piece.corners[i];
      const double area = 0.5 * std::abs((a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x));
      add(o, a, area / 3);
      add(a, b, area / 3);
      add(b, o, area / 3);
    }
  }

  const AreaLight& light_;
  const Picture& picture_;
  Lines across_, down_;
  Color luminance_{};  // of the light, for 1 of each channel of a pixel
};

// The least power of two, up to `most`.
int SideFor(double pixels, int most) {
  int side = 1;
  while (side < most && side < pixels)
    side *= 2;
  return side;
}

}  // namespace

Vec2 PictureSpread::Sample(float u1, float u2, float& density) const {
  const Vec2 place = cells_.Sample(u1, u2);
  density = cells_.Density(place);
  const float scale = 1 / static_cast<float>(side_);
  return {place.x * scale, place.y * scale};
}

float PictureSpread::Density(Vec2 place) const {
  const auto side = static_cast<float>(side_);
  return cells_.Density({place.x * side, place.y * side});
}

Vec2 PictureSpread::NumbersAt(Vec2 place) const {
  const auto side = static_cast<float>(side_);
  return cells_.NumbersAt({place.x * side, place.y * side});
}

PictureSpread::PictureSpread(const AreaLight& light, int side, const std::vector<Cell>& cells,
                             double largest_missed)
    : side_(side), cells_(1, 1, [](int, int) { return 0; }) {
  const Pixels pixels(light);
  const auto count = static_cast<double>(cells.size());
  Color mean{};
  for (const Cell& cell : cells) {
    for (std::size_t c = 0; c < 3; ++c)
      mean[c] += cell.mean[c] / count;
  }
  mean_ = light.radiance * ToWorking({static_cast<float>(mean[0]), static_cast<float>(mean[1]),
                                      static_cast<float>(mean[2])});
  const double mean_luminance = pixels.LuminanceOf(mean);
  const double least = largest_missed > 0 ? kLeastOfMean * mean_luminance : 0;
  const auto weight_of = [&](const Cell& cell) {
    return std::max({pixels.LuminanceOf(cell.mean), kLeastOfLargest * cell.largest, least});
  };
  double share = 0;
  double sum = 0;
  for (const Cell& cell : cells) {
    const double weight = weight_of(cell);
    sum += weight;
    if (weight > 0) share = std::max(share, std::max(cell.largest, largest_missed) / weight);
  }
  if (!(sum > 0) || !(mean_luminance > 0)) return;
  largest_share_ = static_cast<float>(share * sum / (count * mean_luminance));
  cells_ = PiecewiseConstant2D(side, side, [&](int x, int y) {
    return weight_of(cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(side) +
                           static_cast<std::size_t>(x)]);
  });
}

PictureSpread PictureSpread::OfTriangle(const AreaLight& light, const std::array<Vec2, 3>& uvs,
                                        int most_cells) {
  const Pixels pixels(light);
  std::array<Point, 3> at;
  for (std::size_t i = 0; i < 3; ++i)
    at[i] = pixels.PlaceOf(uvs[i]);
  Polygon whole;
  for (const Point& p : at)
    whole.Add(p);
  double extent = 0;
  for (const Point& p : at)
    extent = std::max({extent, std::abs(p.x - at[0].x), std::abs(p.y - at[0].y)});
  // A line of the picture, or a point; or so many of its pixels, or so far off, that they cannot be
  // gone through, for all emitters, or numbered.
  double farthest = 0;
  for (const Point& p : at)
    farthest = std::max({farthest, std::abs(p.x), std::abs(p.y)});
  const double area = 0.5 * std::abs(DoubleArea(whole));
  const bool is_clamped =
      light.wrap_u == Texture::Wrap::kClamp && light.wrap_v == Texture::Wrap::kClamp;
  const double gone_through =
      is_clamped ? std::min(area, static_cast<double>(light.picture->width) * light.picture->height)
                 : area;
  if (!(area > 1e-9 * extent * extent) || (!is_clamped && farthest > kFarthestPixel) ||
      gone_through > kMostPixels * most_cells * most_cells) {
    return OfSurface(
        light,
        [&](Vec2 u) {
          float b1 = 0;
          float b2 = 0;
          SquareToTriangle(u.x, u.y, b1, b2);
          const float b0 = 1 - b1 - b2;
          return Vec2{uvs[0].x * b0 + uvs[1].x * b1 + uvs[2].x * b2,
                      uvs[0].y * b0 + uvs[1].y * b1 + uvs[2].y * b2};
        },
        most_cells);
  }
  const int side = SideFor(extent, most_cells);
  std::vector<Cell> cells;
  cells.reserve(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  // Where the square's corner goes (SquareToTriangle), in pixels.
  const auto corner = [&](int x, int y) {
    const double u1 = static_cast<double>(x) / side;
    const double u2 = static_cast<double>(y) / side;
    const double b1 = u2 > u1 ? u1 / 2 : u1 - u2 / 2;
    const double b2 = u2 > u1 ? u2 - u1 / 2 : u2 / 2;
    return Point{at[0].x + b1 * (at[1].x - at[0].x) + b2 * (at[2].x - at[0].x),
                 at[0].y + b1 * (at[1].y - at[0].y) + b2 * (at[2].y - at[0].y)};
  };
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      Cell cell;
      double area2 = 0;
      const auto add = [&](std::initializer_list<Point> corners) {
        Polygon polygon;
        for (const Point& p : corners)
          polygon.Add(p);
        area2 += std::abs(DoubleArea(polygon));
        pixels.Integrate(polygon, cell.mean, cell.largest);
      };
      const Point a = corner(x, y);
      const Point b = corner(x + 1, y);
      const Point c = corner(x + 1, y + 1);
      const Point d = corner(x, y + 1);
      if (x == y) {
        // The map is folded at the diagonal.
        add({a, b, c});
        add({a, c, d});
      } else {
        add({a, b, c, d});
      }
      for (double& channel : cell.mean)
        channel /= 0.5 * area2;
      cells.push_back(cell);
    }
  }
  return {light, side, cells, 0};
}

PictureSpread PictureSpread::OfSurface(const AreaLight& light,
                                       const std::function<Vec2(Vec2)>& uv_of, int most_cells) {
  const Pixels pixels(light);
  const Picture& picture = *light.picture;
  // As many as the cells of one emitter of few; fewer where they are many.
  const int places = SideFor(2.0 * std::max({picture.width, picture.height, kFewestPlaces / 2}),
                             std::clamp(16 * most_cells, 16, kMostPlaces));
  const int side = std::min(most_cells, places / 4);
  const int parts = places / side;
  std::vector<Cell> cells(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  for (int y = 0; y < side * parts; ++y) {
    for (int x = 0; x < side * parts; ++x) {
      const auto along = [&](int i) {
        return (static_cast<float>(i) + 0.5F) / static_cast<float>(side * parts);
      };
      const Rgb color = light.PixelAt(uv_of({along(x), along(y)}));
      Cell& cell = cells[static_cast<std::size_t>(y / parts) * static_cast<std::size_t>(side) +
                         static_cast<std::size_t>(x / parts)];
      Color at{};
      for (int c = 0; c < 3; ++c) {
        const auto i = static_cast<std::size_t>(c);
        at[i] = static_cast<double>(color[c]);
        cell.mean[i] += at[i] / (parts * parts);
      }
      cell.largest = std::max(cell.largest, pixels.LuminanceOf(at));
    }
  }
  // What was not looked up may be as bright as any pixel.
  double largest = 0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const Rgb pixel = picture.At(x, y);
      largest = std::max(
          largest, pixels.LuminanceOf({static_cast<double>(pixel.r), static_cast<double>(pixel.g),
                                       static_cast<double>(pixel.b)}));
    }
  }
  return {light, side, cells, largest};
}

}  // namespace lucerna
