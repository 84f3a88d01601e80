// What is to be rendered?
//
// A Scene is a plain value: shapes in world space, materials, lights, one camera, and what the
// file says about film and integrator. Nothing in it refers to a file any more, and nothing in
// it has been prepared for rendering yet (acceleration structures, light distributions): that is
// for the floors above.
//
// Units: lengths in scene units, taken as metres; angles in radians unless a name says _deg;
// radiance [W·m⁻²·sr⁻¹] in linear Rec. 709.
//
// Invariants, which the parser guarantees and everything above relies on
//   S1  Every position, normal, transform and colour is finite.
//   S2  Every index is in range: triangle -> vertex, shape -> material, shape -> area light.
//   S3  Normals are unit length or zero (zero: use the geometric normal).
//   S4  Reflectances are in [0, 1]; emitted quantities are >= 0.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "render/math/rgb.h"
#include "render/math/transform.h"
#include "render/math/vector.h"

namespace lucerna {

// How a surface scatters. Only the members that the kind names are meaningful.
struct Material {
  enum class Kind : std::uint8_t { kDiffuse, kConductor, kDielectric };

  Kind kind = Kind::kDiffuse;
  Rgb reflectance = {0.5F, 0.5F, 0.5F};  // diffuse
  Rgb eta = {1, 1, 1};                   // conductor: index of refraction per channel
  Rgb k = {0, 0, 0};                     // conductor: absorption per channel
  float ior = 1.5F;                      // dielectric: inside over outside
  float alpha_u = 0;                     // conductor, dielectric: GGX widths; 0 and 0 = smooth
  float alpha_v = 0;
  std::string name;  // for messages and the plan

  bool operator==(const Material&) const = default;
};

// Emission of the surface of a shape.
struct AreaLight {
  Rgb radiance;            // [W·m⁻²·sr⁻¹], scale and power already applied
  bool two_sided = false;  // else the side that the shape's outward normal points to

  bool operator==(const AreaLight&) const = default;
};

inline constexpr std::int32_t kNoAreaLight = -1;

// What every shape carries.
struct ShapeTraits {
  std::int32_t material = 0;
  std::int32_t area_light = kNoAreaLight;

  bool operator==(const ShapeTraits&) const = default;
};

// The outward normal of a triangle is (p1 - p0) x (p2 - p0); meshes that the file turns inside
// out (ReverseOrientation, mirroring transforms) have their triangles' winding changed here, so
// that this holds without a flag. When vertex normals exist, emission and orientation still go by
// the winding: as in pbrt, a mesh with normals is wound so that it agrees with the normal at its
// vertices.
struct TriangleMesh {
  std::vector<Vec3> positions;         // [vertices]
  std::vector<std::uint32_t> indices;  // [triangles × 3]
  std::vector<Vec3> normals;           // [vertices] or empty: shading normals
  ShapeTraits traits;
};

struct Sphere {
  Vec3 center;
  float radius = 1;     // > 0
  bool inward = false;  // the outward normal points to the centre
  ShapeTraits traits;
};

struct Disk {
  Vec3 center;
  Vec3 normal;  // unit, outward
  float radius = 1;
  float inner_radius = 0;
  ShapeTraits traits;
};

struct PointLight {
  Vec3 position;
  Rgb intensity;  // [W·sr⁻¹]
};

// Intensity falls from 1 inside cos_falloff_start to 0 at cos_total_width as smoothstep of the
// cosine, as pbrt has it.
struct SpotLight {
  Vec3 position;
  Vec3 direction;  // unit, the way the light looks
  Rgb intensity;   // [W·sr⁻¹] on the axis
  float cos_falloff_start = 1;
  float cos_total_width = 1;
};

struct DistantLight {
  Vec3 direction;  // unit, the way the light travels
  Rgb irradiance;  // [W·m⁻²] on a plane facing it
};

// The same radiance from everywhere that no shape covers. Several of them add up.
struct InfiniteLight {
  Rgb radiance;
};

// A rectangle, from left to right and from bottom to top of the image.
struct Window {
  double low_x = 0, high_x = 0, low_y = 0, high_y = 0;
};

struct Camera {
  Transform camera_to_world;  // camera space: +z forward, +y up, +x right, as pbrt has it
  double fov_deg = 90;        // full angle of the shorter side of the image
  // What the file sets in place of what follows from the image's size: width over height, and the
  // window of the image, where 1 is tan(fov / 2).
  std::optional<double> frame_aspect_ratio;
  std::optional<Window> screen_window;
  double lens_radius = 0;
  double focal_distance = 1e6;
};

// The window on the plane z = 1 in camera space that an image of `width` x `height` pixels shows
// as a whole (a crop window shows a part of it).
[[nodiscard]] Window ScreenWindow(const Camera& camera, int width, int height);

// The reconstruction filter of the film, separable, in pixels.
struct PixelFilter {
  enum class Kind : std::uint8_t { kBox, kTriangle, kGaussian, kMitchell };

  Kind kind = Kind::kGaussian;
  float radius_x = 1.5F, radius_y = 1.5F;
  float sigma = 0.5F;                // gaussian
  float b = 1.0F / 3, c = 1.0F / 3;  // mitchell
};

struct FilmSettings {
  int width = 1280, height = 720;  // [pixels] of the whole image
  // The part that is rendered, [x0, x1) × [y0, y1), from cropwindow or pixelbounds.
  int crop_x0 = 0, crop_y0 = 0, crop_x1 = 1280, crop_y1 = 720;
  double exposure = 1;  // (shutterclose - shutteropen) · iso / 100 when the file sets them
  double max_component = HUGE_VAL;
  std::string filename;
};

// What the file asks of the integrator; absent where it says nothing.
struct IntegratorSettings {
  std::string name = "sppm";
  std::optional<int> max_depth;
  std::optional<std::int64_t> photons_per_pass;
  std::optional<double> initial_radius;  // scene units; only from Integrator "sppm"
  std::optional<std::int64_t> seed;
  std::optional<int> pixel_samples;
};

struct Scene {
  std::vector<TriangleMesh> meshes;
  std::vector<Sphere> spheres;
  std::vector<Disk> disks;
  std::vector<Material> materials;
  std::vector<AreaLight> area_lights;
  std::vector<PointLight> point_lights;
  std::vector<SpotLight> spot_lights;
  std::vector<DistantLight> distant_lights;
  std::vector<InfiniteLight> infinite_lights;
  Camera camera;
  FilmSettings film;
  PixelFilter filter;
  IntegratorSettings integrator;

  [[nodiscard]] std::size_t TriangleCount() const {
    std::size_t count = 0;
    for (const TriangleMesh& mesh : meshes)
      count += mesh.indices.size() / 3;
    return count;
  }
};

}  // namespace lucerna
