// What is to be rendered?
//
// A Scene is a plain value: shapes in world space, materials, lights, one camera, and what the
// file says about film and integrator. Nothing in it refers to a file any more, and nothing in
// it has been prepared for rendering yet (acceleration structures, light distributions): that is
// for the floors above.
//
// Units: lengths in `unit` scene units, which are taken as metres; angles in radians unless a name
// says _deg; radiance [W·m⁻²·sr⁻¹] in linear Rec. 709.
//
// Invariants, which the readers guarantee and everything above relies on
//   S1  Every position, normal, texture coordinate, transform, colour and pixel is finite.
//   S2  Every index is in range: triangle -> vertex, shape -> material, shape -> area light,
//       material -> texture, shape, light and camera -> medium, shape -> motion; a texture is made
//       of textures before it. A texture that needs a picture has one, and the picture of an
//       infinite light is square. A light behind a portal has one, and no other has.
//   S3  Normals are unit length or zero (zero: use the geometric normal).
//       An object's meshes are not empty and do not move, and an instance's object exists.
//       What emits does not move.
//   S4  Reflectances are in [0, 1], those of textures once they are looked up; emitted quantities,
//       pixels and scales of textures are >= 0.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/math/color_space.h"
#include "render/math/rgb.h"
#include "render/math/transform.h"
#include "render/math/vector.h"
#include "render/scene/analytic_shapes.h"
#include "render/scene/infinite_light.h"
#include "render/scene/light_list.h"
#include "render/scene/material.h"
#include "render/scene/medium.h"
#include "render/scene/motion.h"
#include "render/scene/shape_traits.h"
#include "render/scene/texture.h"

namespace lucerna {

// Emission of the surface of a shape.
struct AreaLight {
  // [W·m⁻²·sr⁻¹], scale and power already applied; with a picture, what its pixels are multiplied
  // by.
  Rgb radiance;
  bool two_sided = false;  // else the side that the shape's outward normal points to
  // Over the shape's u and v, as mapped.
  std::shared_ptr<const Picture> picture = nullptr;
  float largest_pixel = 1;      // of `picture`, any channel
  GivenSpectrum spectrum = {};  // of the radiance, up to a factor
  TextureMapping mapping = {};  // of `picture`: of u and v
  Texture::Wrap wrap_u = Texture::Wrap::kClamp, wrap_v = Texture::Wrap::kClamp;

  // Of `picture`.
  [[nodiscard]] Rgb PixelAt(Vec2 uv) const {
    return PictureColor(*picture, mapping.Map({uv, {}, {}}), wrap_u, wrap_v);
  }
  // No channel of the radiance is anywhere larger.
  [[nodiscard]] Rgb Largest() const {
    return picture == nullptr ? radiance : radiance * largest_pixel;
  }
  bool operator==(const AreaLight&) const = default;
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
  // [vertices], or empty: the corners of each triangle, as it is wound, are (0, 0), (1, 0), (1, 1).
  std::vector<Vec2> uvs;
  std::vector<Rgb> colors;  // [vertices] or empty: of textures "vertexcolor", in [0, 1]
  ShapeTraits traits;
};

// A rectangle, from left to right and from bottom to top of the image.
struct Window {
  double low_x = 0, high_x = 0, low_y = 0, high_y = 0;
};

struct Camera {
  enum class Kind : std::uint8_t {
    kPerspective,
    kOrthographic,     // parallel rays along +z that begin on the plane z = 0
    kEqualArea,        // all directions, by math/equal_area_square.h
    kEquirectangular,  // all directions, by the angle around +y and the one from it
    // No camera: each pixel, in rows, is one of Scene::sensors. Its radiance is that of a white
    // diffuse surface there, which is the irradiance over pi.
    kSensors,
  };

  Kind kind = Kind::kPerspective;
  Transform camera_to_world;  // camera space: +z forward, +y up, +x right, as pbrt has it
  double fov_deg = 90;        // perspective: full angle of the shorter side of the image
  // Orthographic: the length of 1 in the window below. Sensors: the mean of their spacings.
  double window_scale = 1;
  // What the file sets in place of what follows from the image's size: width over height, and the
  // window of the image, where 1 is tan(fov / 2).
  std::optional<double> frame_aspect_ratio;
  std::optional<Window> screen_window;
  double lens_radius = 0;
  double focal_distance = 1e6;
  std::int32_t medium = kNoMedium;  // in which the camera is, or all sensors are
};

// A point on a surface whose irradiance is measured, on the side that the normal points to.
struct Sensor {
  Vec3 position;      // on the surface, up to rounding
  Vec3 normal;        // unit
  float spacing = 0;  // takes the place of a pixel's width, > 0

  bool operator==(const Sensor&) const = default;
};

// The part of a surface over which a sensor's direct light is averaged: a triangle, or what lies
// over it on a ball.
struct SensorBucket {
  std::array<Vec3, 3> corners;
  Vec3 ball_center;       // of a ball
  float ball_radius = 0;  // 0: flat

  bool operator==(const SensorBucket&) const = default;
};

// The window on the plane z = 1 in camera space that an image of `width` x `height` pixels shows
// as a whole (a crop window shows a part of it); of an orthographic camera on any plane.
// Meaningless for cameras that look everywhere.
[[nodiscard]] Window ScreenWindow(const Camera& camera, int width, int height);

// How wide a pixel is on a surface that faces the camera at `distance`, about; for a pixel that is
// not square the root of its area [in the unit of `distance`].
[[nodiscard]] double PixelFootprint(const Camera& camera, int width, int height, double distance);

// No point of the lens is farther than this from the camera's own [world]; 0 for a pinhole.
[[nodiscard]] double LensReach(const Camera& camera);

// Meshes that instances repeat, in a space of their own. None of them emits.
struct InstancedObject {
  std::uint32_t first_mesh = 0, mesh_count = 0;  // in Scene::object_meshes
  Bounds box;                                    // around their positions, in that space
};

// One of the places at which an object stands.
struct Instance {
  std::uint32_t object = 0;  // index in Scene::objects
  Transform to_world;        // affine, and it can be inverted
  std::int32_t motion = kNoMotion;
};

// The reconstruction filter of the film, separable, in pixels.
struct PixelFilter {
  enum class Kind : std::uint8_t { kBox, kTriangle, kGaussian, kMitchell, kSinc };

  Kind kind = Kind::kGaussian;
  float radius_x = 1.5F, radius_y = 1.5F;
  float sigma = 0.5F;                // gaussian
  float b = 1.0F / 3, c = 1.0F / 3;  // mitchell
  float window = 3;                  // sinc: half of its window's width, in its zeros
};

struct FilmSettings {
  int width = 1280, height = 720;  // [pixels] of the whole image
  // The part that is rendered, [x0, x1) × [y0, y1), from cropwindow or pixelbounds.
  int crop_x0 = 0, crop_y0 = 0, crop_x1 = 1280, crop_y1 = 720;
  double exposure = 1;  // (shutterclose - shutteropen) · iso / 100 when the file sets them
  // What pixels, in linear Rec. 709, are multiplied by, so that the white of some light is grey;
  // absent: none.
  std::optional<ColorMatrix> white_balance;
  double max_component = HUGE_VAL;
  std::string filename;
};

// The integrator settings of the file; absent where the file has none.
struct IntegratorSettings {
  std::string name = "sppm";
  std::optional<int> max_depth;
  std::optional<std::int64_t> photons_per_pass;
  std::optional<double> initial_radius;  // scene units; only from Integrator "sppm"
  std::optional<std::int64_t> seed;
  std::optional<int> pixel_samples;
};

// Where a shape is written.
struct ShapeSource {
  std::uint32_t file = 0;  // in Scene::source_files
  std::uint32_t line = 0;  // from 1
};

class Uplift;  // math/uplift.h

struct Scene {
  // A length here times this is one of the file: a power of two, 1 for scenes of common sizes
  // (formats/scene_unit.h). Of what is below, the integrator's settings are the file's.
  double unit = 1;
  std::vector<TriangleMesh> meshes;
  // Objects that are in memory once, however often they stand in the scene; those that take little
  // memory are written out in `meshes` (docs/decisions/instances.md).
  std::vector<TriangleMesh> object_meshes;
  std::vector<InstancedObject> objects;
  std::vector<Instance> instances;
#define LUCERNA_MEMBER(Name, list, name) std::vector<Name> list;
  LUCERNA_ANALYTIC_SHAPES(LUCERNA_MEMBER)  // spheres and so on (scene/analytic_shapes.h)
#undef LUCERNA_MEMBER
  std::vector<Material> materials;
  std::vector<Texture> textures;
  std::vector<Medium> media;
  std::vector<AreaLight> area_lights;
#define LUCERNA_MEMBER(Name, list, name) std::vector<Name##Light> list;
  LUCERNA_DELTA_LIGHTS(LUCERNA_MEMBER)  // point_lights and so on (scene/light_list.h)
#undef LUCERNA_MEMBER
  std::vector<InfiniteLight> infinite_lights;
  Camera camera;
  std::vector<Sensor> sensors;               // not empty when the camera is none but these
  std::vector<SensorBucket> sensor_buckets;  // [sensors], or empty: direct light is that at points
  // Borders at which discs are cut besides the edges of surfaces: those of a histogram's buckets.
  std::vector<std::array<Vec3, 2>> sensor_borders;
  FilmSettings film;
  PixelFilter filter;
  IntegratorSettings integrator;
  SceneMotion motion;
  // Of the shapes of text formats: one for each that the text has, which may be many here.
  std::vector<ShapeSource> sources;
  std::vector<std::string> source_files;
  // "room.pbrt:12"; empty when it is not known.
  [[nodiscard]] std::string SourceOf(const ShapeTraits& traits) const;
  // Of a scene whose colours are values at the wavelengths of a pass (transport/pass_colors.h):
  // from the pixels of pictures to such values. Else nullptr.
  const Uplift* uplift = nullptr;

  // Of the triangles in memory: those of an object once.
  [[nodiscard]] std::size_t TriangleCount() const {
    std::size_t count = 0;
    for (const std::vector<TriangleMesh>* list : {&meshes, &object_meshes}) {
      for (const TriangleMesh& mesh : *list)
        count += mesh.indices.size() / 3;
    }
    return count;
  }
};

// Calls `visit` for the list of each kind of delta light, in their order.
template <typename SceneType, typename Visit>
void ForEachDeltaList(SceneType& scene, const Visit& visit) {
#define LUCERNA_VISIT(Name, list, name) visit(scene.list);
  LUCERNA_DELTA_LIGHTS(LUCERNA_VISIT)
#undef LUCERNA_VISIT
}

[[nodiscard]] inline std::size_t DeltaLightCount(const Scene& scene) {
  std::size_t count = 0;
  ForEachDeltaList(scene, [&](const auto& lights) { count += lights.size(); });
  return count;
}

}  // namespace lucerna
