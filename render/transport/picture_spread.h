// How is the light of a surface that shows a picture spread over it?
//
// Places on the face of an emitter are drawn from two even numbers (LightSet::PointOn). Here the
// square of those numbers is cut into cells, and numbers are drawn from the cells in proportion to
// the light that leaves them; within a cell evenly, with the density known. Of triangles the light
// of a cell is integrated exactly: a picture that is interpolated between pixels is bilinear in
// each, and a cell of the square is a polygon of the triangle.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "render/math/piecewise_constant.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"
#include "render/scene/scene.h"

namespace lucerna {

class PictureSpread {
 public:
  // Over a triangle with texture coordinates `uvs` at its corners. `light` has a picture;
  // `most_cells`: of a side.
  static PictureSpread OfTriangle(const AreaLight& light, const std::array<Vec2, 3>& uvs,
                                  int most_cells);
  // Over another surface, whose texture coordinates `uv_of` tells from the numbers.
  static PictureSpread OfSurface(const AreaLight& light, const std::function<Vec2(Vec2)>& uv_of,
                                 int most_cells);

  // The mean radiance over the surface, of the light as it is given.
  [[nodiscard]] Rgb mean() const { return mean_; }
  // No luminance at a place, over the density there, is more times the mean luminance.
  [[nodiscard]] float largest_share() const { return largest_share_; }

  // Draws a place from even numbers in [0, 1)²; `density` is over that of even ones.
  [[nodiscard]] Vec2 Sample(float u1, float u2, float& density) const;
  [[nodiscard]] float Density(Vec2 place) const;
  // With which numbers Sample draws this place, about.
  [[nodiscard]] Vec2 NumbersAt(Vec2 place) const;

 private:
  struct Cell {
    std::array<double, 3> mean{};  // Rec. 709, of the picture
    double largest = 0;            // luminance that was found in it [of the light]
  };
  // `largest_missed`: how large a luminance may be that was not found in its cell.
  PictureSpread(const AreaLight& light, int side, const std::vector<Cell>& cells,
                double largest_missed);

  int side_;
  Rgb mean_;
  float largest_share_ = 1;
  PiecewiseConstant2D cells_;
};

}  // namespace lucerna
