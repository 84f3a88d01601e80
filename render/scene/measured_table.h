// How a real surface scatters, as it was measured: the tables of one material, and what follows
// from them.
//
// Source: Dupuy & Jakob 2018, "An Adaptive Parameterization for Efficient Material Acquisition and
// Rendering" (D18). For each of a grid of directions `wo`, half vectors are mapped to the unit
// square by their angles, and that is warped by the density of visible facets, so that the table
// of values has its knots where light is scattered.
//
// A value v at a half vector m means f·cosθi = v · D(m) / (4 σ(wo)), with the density of facets D
// and their projected area σ, both of which are tables too.
//
// Directions are in the shading frame, as in transport/bsdf.h. Values at three planes of the tables
// are colours: in the working space, or at the wavelengths of a pass.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "render/math/bilinear_grids.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"

namespace lucerna {

// What a file holds.
struct MeasuredData {
  std::vector<float> phi_rad;    // of `wo`, increasing; one or two: the surface has no direction
  std::vector<float> theta_rad;  // of `wo`, increasing
  std::vector<float> wavelength_nm;
  // Values are as above; else f·cosθi itself.
  bool is_over_facets = true;
  GridSize facets_size, projected_size, visible_size, values_size;
  std::vector<float> facets;     // [facets_size] by half vectors
  std::vector<float> projected;  // [projected_size] area of facets, seen from `wo`
  std::vector<float> visible;    // [phi × theta × visible_size]
  std::vector<float> luminance;  // [phi × theta × values_size] to draw from
  std::vector<float> values;     // [phi × theta × wavelengths × values_size]
};

class MeasuredTable {
 public:
  // Positions in the tables of three colours: between two wavelengths, or one of the working space.
  using Planes = std::array<float, 3>;

  // All numbers of `data` are finite, those of grids 0 or more, and as many as it says.
  explicit MeasuredTable(MeasuredData data);

  [[nodiscard]] Planes WorkingSpace() const;
  [[nodiscard]] Planes At(const std::array<double, 3>& nm) const;

  // f(wo, wi)·cosθi. Requires wo.z > 0 and wi.z > 0.
  [[nodiscard]] Rgb Scattered(Vec3 wo, Vec3 wi, const Planes& planes) const;
  // The density with which Sample draws `wi` [sr⁻¹]. Requires the same.
  [[nodiscard]] float Pdf(Vec3 wo, Vec3 wi) const;
  struct Drawn {
    Vec3 wi;
    float pdf = 0;  // [sr⁻¹]
  };
  // wi.z may be below 0: then nothing is scattered. Requires wo.z > 0; u1, u2 in [0, 1).
  [[nodiscard]] Drawn Sample(Vec3 wo, float u1, float u2) const;

  // The share of light from right above that is scattered.
  [[nodiscard]] Rgb Albedo(const Planes& planes) const;
  // Whether nothing is scattered, from any direction.
  [[nodiscard]] bool is_black() const { return is_black_; }
  // Of facets with which light from right above would be scattered as broadly: the width whose
  // narrowest quarter of light is as narrow.
  [[nodiscard]] float lobe_width() const { return lobe_width_; }
  // Whether it matters how it is turned around the normal.
  [[nodiscard]] bool is_anisotropic() const { return phi_rad_.size() > 2; }
  [[nodiscard]] std::size_t bytes() const;

  bool operator==(const MeasuredTable&) const = default;

 private:
  // A direction `wo`, as the tables have it.
  struct Seen {
    Vec3 wo;
    float phi = 0;                 // [rad]
    float flip_x = 1, flip_y = 1;  // from the frame to the part of it that was measured
    GridMixture mixture;           // of phi × theta
    float facets_over = 1;         // 1 / (4 · projected area)
  };
  [[nodiscard]] Seen SeenFrom(Vec3 wo) const;
  // Of a half vector in the measured part: its place in the unit square.
  [[nodiscard]] Vec2 PlaceOf(const Seen& seen, Vec3 m) const;
  // From densities on the square to those of `wi` [sr⁻¹].
  static float Jacobian(const Seen& seen, Vec3 m, Vec2 place);
  // Of one plane, in the direction of a grid.
  [[nodiscard]] float PlaneAt(std::size_t direction, std::size_t plane, Vec2 warped) const;
  [[nodiscard]] Rgb ValueAt(const Seen& seen, Vec2 warped, Vec2 place, const Planes& planes) const;
  void MeasureFromAbove();

  std::vector<float> phi_rad_, theta_rad_, wavelength_nm_;
  bool is_over_facets_ = true;
  int mirrored_ = 1;  // how many equal parts the directions around the normal have: 1, 2 or 4
  BilinearGrids facets_, projected_;
  BilinearDensities visible_, luminance_;
  BilinearGrids colors_;  // [phi × theta × 3] in the working space: planes after the wavelengths'
  bool is_black_ = false;
  BilinearGrids values_;       // [phi × theta × wavelengths]
  std::vector<float> albedo_;  // [wavelengths + 3]
  float lobe_width_ = 0;
};

}  // namespace lucerna
