// How do photons count at a hitpoint whose surface ends or turns within its disc?
//
// The segments of the scene's feature edges that come near the hitpoint's tangent plane are
// projected into it, and the disc is cut down to the part that is seen from the hitpoint along the
// plane (estimate/star_region.h). Photons behind a segment do not count, and those before it count
// more, so that the kernel keeps its integral over the part that is left and, as far as weights
// stay positive, its first moments vanish: even light is estimated without bias up to the very
// edge, light that changes evenly nearly so.
//
// Whatever is cut away is made up for, so a segment too many costs noise and no bias.
#pragma once

#include <cstddef>
#include <cstdint>

#include "absl/functional/function_ref.h"

#include "render/estimate/star_region.h"
#include "render/geometry/feature_edges.h"
#include "render/math/vector.h"
#include "render/scene/render_settings.h"

namespace lucerna {

// Segments further from the tangent plane than this, in radii, do not cut. What is curved, as much
// as a radius that makes sense allows, ends no further off.
inline constexpr float kPlaneTolerance = 0.36F;

// Where a photon is in the tangent plane, in radii.
struct DiscPlace {
  float x = 0, y = 0;
};

class CutDisc {
 public:
  enum class Outcome : std::uint8_t {
    // Nothing cuts the disc of `reach` radii, or too little or nothing certain is left of it: every
    // photon on the hitpoint's side of the surface counts as in a whole disc.
    kWhole,
    kCut,
    kEmpty,  // there are edges, and no photon
  };
  // Nothing below may be used but after kCut. Asks whether there is any photon at most once, and
  // only where there are edges: the cut is dear, and many discs of dark places are empty.
  // Requires a unit normal and a radius whose square is a positive float.
  Outcome Cut(const FeatureEdges& features, Vec3 position, Vec3 normal, float radius, float reach,
              KernelKind kernel, absl::FunctionRef<bool()> has_photons);

  [[nodiscard]] DiscPlace PlaceOf(Vec3 to_photon) const {
    return {Dot(to_photon, s_), Dot(to_photon, t_)};
  }
  // Whether a photon lies in the part that is left.
  [[nodiscard]] bool Holds(DiscPlace place) const { return region_.Sees(place.x, place.y); }
  // What the kernel's shape is multiplied by, and that of the inner kernel (see kBlurColumn).
  [[nodiscard]] float WeightAt(DiscPlace place) const { return whole_.At(place.x, place.y); }
  [[nodiscard]] float InnerWeightAt(DiscPlace place) const { return inner_.At(place.x, place.y); }

  // In place of 2u - 1 (see CurvatureColumn): zero on average for even light and for light that
  // changes evenly over what is left of the wide disc, and as noisy as over a whole one.
  [[nodiscard]] float LaplacianAt(DiscPlace place, float u) const {
    return laplacian_scale_ * (2 * u - laplacian_.At(place.x, place.y));
  }
  // The area of the wide disc over what is left of it.
  [[nodiscard]] float inverse_share() const { return inverse_share_; }

 private:
  // False when there is no room for it.
  bool AddSegment(const FeatureSegment& segment, const Frame& frame, double reach);
  void FitLaplacian(double reach);

  Vec3 position_, normal_;
  Vec3 s_, t_;  // of length 1 / radius
  float inverse_radius_ = 1;
  StarRegion region_;
  RegionWeight whole_, inner_;
  RegionWeight laplacian_;
  float laplacian_scale_ = 1;
  float inverse_share_ = 1;
};

}  // namespace lucerna
