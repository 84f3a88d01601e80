// What does one pbrt directive add to the scene?
//
// One function for each directive that describes a part of the scene; the parser owns the order
// of directives and the graphics state, these own types, parameters and defaults. Each asks
// `parameters` for what it knows, reports what is wrong, and does its best to go on; after an
// error its outcome is never rendered.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/status.h"
#include "render/math/transform.h"
#include "render/scene/image_file.h"
#include "render/scene/parameter_list.h"
#include "render/scene/scene.h"

namespace lucerna {

// The spectrum textures that a text has declared, by name.
struct NamedTexture {
  std::int32_t number = kNoTexture;  // in Scene::textures
  std::string why_not;               // when it has no number
  float largest = 1;                 // no channel is larger anywhere
  int depth = 1;                     // of textures made of textures
};
using TextureNames = std::map<std::string, NamedTexture>;

// Reads the file that an imagemap or an infinite light names; the parser counts what it reads.
using PictureReader = std::function<StatusOr<std::shared_ptr<const Picture>>(
    const std::string& file, const PixelEncoding& encoding)>;

// A spectrum texture of `type`; appends to `textures` what it is made of. One that is of an
// unsupported type is an error only where something uses it.
[[nodiscard]] NamedTexture MakeTexture(std::string_view type, ParameterList& parameters,
                                       const TextureNames& names, const PictureReader& read_picture,
                                       std::vector<Texture>& textures);

// True for the types of material that pbrt-v3 had and pbrt-v4 renamed.
[[nodiscard]] bool IsPbrtV3Material(std::string_view type);
[[nodiscard]] Material MakeMaterial(std::string_view type, ParameterList& parameters,
                                    const TextureNames& names);

// An AreaLightSource: what it makes of a shape depends on the shape's area when a power is given.
struct AreaEmission {
  Rgb radiance;  // at scale 1 and, where there is one, power 1 over an emitting area of 1 m²
  bool two_sided = false;
  std::optional<double> power_w;  // luminous, of the whole shape
};
[[nodiscard]] AreaEmission MakeAreaEmission(std::string_view type, ParameterList& parameters);
[[nodiscard]] AreaLight MakeAreaLight(const AreaEmission& emission, double area_m2);

// A LightSource, with the transform from its space to the world.
void AddLight(std::string_view type, ParameterList& parameters, const Transform& to_world,
              const PictureReader& read_picture, Scene& scene);

// Where the axes of a space point. Errors: INVALID_ARGUMENT when it is stretched.
[[nodiscard]] StatusOr<ShapeAxes> AxesOf(const Transform& to_world);

// Shapes in world space, or in the space of an object that is instanced later. Their traits are
// those of the Shape directive that made them.
struct ShapeSet {
  std::vector<TriangleMesh> meshes;
  std::vector<Sphere> spheres;
  std::vector<Disk> disks;

  // What it costs to keep: triangles, every other shape as one, and vertices that no triangle
  // needs as a third of one.
  [[nodiscard]] std::uint64_t Cost() const;
  // [m²], of one side.
  [[nodiscard]] double Area() const;
};

struct ShapePlacement {
  Transform to_world;
  bool reverse_orientation = false;
  ShapeTraits traits;
};

// Reads the file that a plymesh names; the parser counts what it reads.
using MeshReader = std::function<StatusOr<TriangleMesh>(const std::string& file)>;

[[nodiscard]] ShapeSet MakeShapes(std::string_view type, ParameterList& parameters,
                                  const ShapePlacement& placement, const MeshReader& read_mesh);

// The shapes of an object where an instance of it stands. Errors: INVALID_ARGUMENT when the
// transform moves a position out of the finite numbers, or makes an ellipsoid of a sphere.
[[nodiscard]] StatusOr<ShapeSet> Instantiate(const ShapeSet& object, const Transform& to_world);

// Drops the triangles of a smaller area: they can neither be seen nor lit. Returns how many.
std::size_t DropTriangles(TriangleMesh& mesh, double least_area);

// The directives before WorldBegin. `exposure_time_s` is shutterclose - shutteropen; the film's
// own share of the exposure is iso / 100, and the parser multiplies the two.
void ReadCamera(std::string_view type, ParameterList& parameters, Camera& camera,
                double& exposure_time_s);
void ReadFilm(std::string_view type, ParameterList& parameters, FilmSettings& film);
void ReadPixelFilter(std::string_view type, ParameterList& parameters, PixelFilter& filter);
void ReadIntegrator(std::string_view type, ParameterList& parameters,
                    IntegratorSettings& integrator);
void ReadSampler(std::string_view type, ParameterList& parameters, IntegratorSettings& integrator);

}  // namespace lucerna
