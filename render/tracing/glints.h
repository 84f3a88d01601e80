// Where on the film are the images of small bright lights in smooth surfaces?
//
// A light seen by way of a mirror ball or through glass may fill a thousandth of a pixel: one eye
// path in a thousand meets it, and is worth a thousand times the mean. Such images are found once,
// from the camera through each chain of reflections and refractions; in each pass more paths are
// drawn around them (film_spread.h). A place that is wrong or missing costs noise and no bias.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "render/base/parallel.h"
#include "render/scene/scene.h"
#include "render/tracing/eye_path.h"

namespace lucerna {

// A region of the film in which paths are drawn: for each point of the lens an ellipse, about twice
// as wide as the image of the light. Film [pixels of the whole image], lens [its radii].
struct Glint {
  struct FilmPoint {
    double x = 0, y = 0;
  };
  // | xx xy |
  // | yx yy |
  struct Matrix {
    double xx = 0, xy = 0, yx = 0, yy = 0;

    [[nodiscard]] double Determinant() const { return xx * yy - xy * yx; }
  };

  FilmPoint middle;   // for the middle of the lens
  Matrix axes;        // from the unit disc to the ellipse around its middle
  Matrix from_lens;   // from the place on the lens to how far the ellipse's middle moves
  std::uint64_t key;  // of its random numbers
  int paths = 0;      // in a pass

  // Where the place of the unit square (u, v) lies.
  [[nodiscard]] FilmPoint Sample(float u, float v, Vec3 on_lens) const;
  // The density with which Sample draws the place, of the lens' given point [1/pixel²].
  [[nodiscard]] double Density(FilmPoint place, Vec3 on_lens) const;
  // The density within the ellipse [1/pixel²].
  [[nodiscard]] double LargestDensity() const;
  // Half of the width and height of what holds the ellipses of all points of the lens [pixels].
  [[nodiscard]] FilmPoint HalfExtent() const;
};

// Part of the film [pixels of the whole image].
struct FilmRegion {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

class Glints {
 public:
  // Nowhere.
  Glints() = default;
  // Those that matter within `region`. The same for equal places, whatever the region.
  Glints(const EyePathTracer& tracer, const FilmRegion& region, ThreadTeam& team);

  // These, wherever they come from. Each image pixel is compared with all of them.
  explicit Glints(std::vector<Glint> glints);

  [[nodiscard]] const std::vector<Glint>& all() const { return all_; }
  // Calls visit(index in `all`) for those that may reach into `region`, in ascending order.
  template <typename Visit>
  void ForEachNear(const FilmRegion& region, const Visit& visit) const {
    if (all_.empty()) return;
    const Tiles near = TilesNear(region, tiles_);
    for (int y = near.y0; y < near.y1; ++y) {
      const std::size_t row =
          static_cast<std::size_t>(y - tiles_.y0) * static_cast<std::size_t>(tiles_.x1 - tiles_.x0);
      const auto first = row + static_cast<std::size_t>(near.x0 - tiles_.x0);
      const auto last = row + static_cast<std::size_t>(near.x1 - tiles_.x0);
      for (std::size_t i = first_of_tile_[first]; i < first_of_tile_[last]; ++i) {
        const Glint& glint = all_[i];
        const Glint::FilmPoint half = glint.HalfExtent();
        if (glint.middle.x + half.x >= region.x0 && glint.middle.x - half.x <= region.x1 &&
            glint.middle.y + half.y >= region.y0 && glint.middle.y - half.y <= region.y1) {
          visit(i);
        }
      }
    }
  }

 private:
  // Tiles [x0, x1) × [y0, y1) of the whole film.
  struct Tiles {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  };
  // Those of `all` in which glints that reach into `region` have their middle; at least one.
  [[nodiscard]] static Tiles TilesNear(const FilmRegion& region, const Tiles& all);

  Tiles tiles_;                             // that were searched
  std::vector<Glint> all_;                  // by tile
  std::vector<std::size_t> first_of_tile_;  // [tiles + 1] index in `all_`
};

}  // namespace lucerna
