#include "render/tracing/bright_outlines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

// Outlines that the lens blurs more are left alone: no pixel of theirs has much of the light.
constexpr double kMostBlur = 16;
// Analytic shapes up to this size on the film are near as a whole; the outlines of larger ones are
// found between pixels' centres (FilmSpread). [pixels]
constexpr double kSmallRadius = 2;

class Marker {
 public:
  explicit Marker(const EyePathTracer& tracer)
      : tracer_(tracer),
        width_(tracer.settings().width),
        height_(tracer.settings().height),
        reach_x_(static_cast<double>(tracer.filter().radius_x())),
        reach_y_(static_cast<double>(tracer.filter().radius_y())) {}

  void AddTriangle(const std::array<Vec3, 3>& corners) {
    for (std::size_t i = 0; i < 3; ++i)
      AddEdge(corners[i], corners[(i + 1) % 3]);
  }

  void AddBall(Vec3 center, float radius) {
    const std::optional<EyePathTracer::FilmPoint> at = tracer_.OnFilm(center);
    if (!at) return;
    const double on_film = static_cast<double>(radius) * at->pixels_per_length;
    if (on_film <= kSmallRadius) Mark(at->x, at->y, at->blur + on_film);
  }

  [[nodiscard]] BrightOutlines Take() && { return std::move(outlines_); }

 private:
  void AddEdge(Vec3 from, Vec3 to) {
    std::optional<EyePathTracer::FilmPoint> a = tracer_.OnFilm(from);
    std::optional<EyePathTracer::FilmPoint> b = tracer_.OnFilm(to);
    if (!a && !b) return;
    if (!a || !b) {
      // Cut off just in front of the camera.
      Vec3 in_front = a ? from : to;
      Vec3 behind = a ? to : from;
      for (int i = 0; i < 32; ++i) {
        const Vec3 middle = (in_front + behind) * 0.5F;
        (tracer_.OnFilm(middle) ? in_front : behind) = middle;
      }
      (a ? b : a) = tracer_.OnFilm(in_front);
      if (!a || !b) return;
    }
    const double blur = std::max(a->blur, b->blur);
    // The part within the image and what blur and filters reach around it (Liang & Barsky 1984).
    double t0 = 0;
    double t1 = 1;
    const double dx = b->x - a->x;
    const double dy = b->y - a->y;
    const auto clip = [&](double from_low, double direction, double size, double margin) {
      for (const double side : {-1.0, 1.0}) {
        const double p = side * direction;
        const double q = side < 0 ? from_low + margin : size + margin - from_low;
        if (p == 0) {
          if (q < 0) t1 = -1;
        } else if (p < 0) {
          t0 = std::max(t0, q / p);
        } else {
          t1 = std::min(t1, q / p);
        }
      }
    };
    const double margin = std::min(blur, kMostBlur) + std::max(reach_x_, reach_y_) + 1;
    clip(a->x, dx, width_, margin);
    clip(a->y, dy, height_, margin);
    if (!(t1 >= t0)) return;
    const double length = std::max(std::abs(dx), std::abs(dy)) * (t1 - t0);
    const int steps = 1 + static_cast<int>(std::min(2 * length, 1e6));
    for (int i = 0; i <= steps; ++i) {
      const double t = t0 + (t1 - t0) * i / steps;
      Mark(a->x + t * dx, a->y + t * dy, blur);
    }
  }

  // A quarter of a pixel more than filter and blur reach: steps along edges are half a pixel.
  void Mark(double x, double y, double blur) {
    if (!(blur <= kMostBlur)) return;
    const auto range = [&](double at, double reach, int size) {
      const double low = std::ceil(at - reach - blur - 0.75);
      const double high = std::floor(at + reach + blur - 0.25);
      return std::array<int, 2>{static_cast<int>(std::clamp(low, 0.0, static_cast<double>(size))),
                                static_cast<int>(std::clamp(high, -1.0, size - 1.0))};
    };
    const auto [x0, x1] = range(x, reach_x_, width_);
    const auto [y0, y1] = range(y, reach_y_, height_);
    if (x0 > x1 || y0 > y1) return;
    if (outlines_.is_near.empty()) {
      outlines_.is_near.resize(static_cast<std::size_t>(width_) *
                               static_cast<std::size_t>(height_));
    }
    for (int row = y0; row <= y1; ++row) {
      for (int column = x0; column <= x1; ++column) {
        std::uint8_t& is_near =
            outlines_.is_near[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
                              static_cast<std::size_t>(column)];
        outlines_.count += is_near == 0 ? 1 : 0;
        is_near = 1;
      }
    }
  }

  const EyePathTracer& tracer_;
  const int width_, height_;
  const double reach_x_, reach_y_;
  BrightOutlines outlines_;
};

}  // namespace

BrightOutlines FindBrightOutlines(const EyePathTracer& tracer) {
  const Scene& scene = tracer.scene();
  Marker marker(tracer);
  const auto is_bright = [&](const ShapeTraits& traits) {
    return traits.area_light != kNoAreaLight &&
           tracer.IsBright(
               scene.area_lights[static_cast<std::size_t>(traits.area_light)].Largest());
  };
  for (const TriangleMesh& mesh : scene.meshes) {
    if (!is_bright(mesh.traits)) continue;
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      marker.AddTriangle({mesh.positions[mesh.indices[i]], mesh.positions[mesh.indices[i + 1]],
                          mesh.positions[mesh.indices[i + 2]]});
    }
  }
  ForEachAnalyticShape(scene, [&](const auto& shape) {
    if (is_bright(shape.traits)) marker.AddBall(shape.center, shape.Reach());
  });
  return std::move(marker).Take();
}

}  // namespace lucerna
