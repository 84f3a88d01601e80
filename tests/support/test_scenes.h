// How is a scene made without a file?
//
// Builders for the small scenes of the tests: a Scene value is put together shape by shape, so
// that a test shows every number that its expectation is computed from.
#pragma once

#include <array>
#include <cstdint>

#include "render/math/rgb.h"
#include "render/math/vector.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"

namespace lucerna {

[[nodiscard]] Material DiffuseMaterial(float reflectance);
// alpha = 0: smooth.
[[nodiscard]] Material DielectricMaterial(float ior, float alpha = 0);
// A diffuse base under a coat of index 1.5, ready to be evaluated. alpha = 0: a smooth coat.
[[nodiscard]] Material CoatedMaterial(float reflectance, float alpha, float thickness = 0);
// The same over a metal of width base_alpha.
[[nodiscard]] Material CoatedMetal(Rgb eta, Rgb k, float alpha, float base_alpha,
                                   float thickness = 0);
// A coated material whose layer scatters light, up to 2000 times.
[[nodiscard]] Material WithHaze(Material coated, float albedo, float g);
// A thin sheet that scatters diffusely to both sides.
[[nodiscard]] Material SheetMaterial(float reflectance, float transmittance);
// Grey, over a medium of that mean free path [scene units] and index 1.5, ready to be evaluated.
// alpha = 0: smooth.
[[nodiscard]] Material SubsurfaceMaterial(float reflectance, float free_path, float alpha = 0);
// Of grey absorption per radius, with pbrt's index and tilt of the scales.
[[nodiscard]] Material HairMaterial(float absorption, float beta_m, float beta_n);
[[nodiscard]] Material ConductorMaterial(Rgb eta, Rgb k, float alpha_u, float alpha_v);

// Each appends to the scene and returns the index of what it added.
std::int32_t AddMaterial(Scene& scene, const Material& material);
std::int32_t AddAreaLight(Scene& scene, float radiance, bool two_sided = false);

[[nodiscard]] TextureMapping ByUv(float scale_u, float scale_v, float delta_u, float delta_v);

// A parallelogram of two triangles; the outward normal is along edge1 × edge2.
void AddQuad(Scene& scene, Vec3 corner, Vec3 edge1, Vec3 edge2, std::int32_t material,
             std::int32_t area_light = kNoAreaLight);
// A texture of numbers: `first` and `second` by turns, where the first coordinate of `mapping` is
// from an even whole number on and from an odd one. Returns its number.
std::int32_t AddStripes(Scene& scene, float first, float second, const TextureMapping& mapping);
// Twelve triangles, normals outward.
void AddBox(Scene& scene, Vec3 low, Vec3 high, std::int32_t material);
void AddSphere(Scene& scene, Vec3 center, float radius, std::int32_t material,
               std::int32_t area_light = kNoAreaLight, bool inward = false);
void AddDisk(Scene& scene, Vec3 center, Vec3 normal, float radius, std::int32_t material,
             std::int32_t area_light = kNoAreaLight);

// A square image of `size` × `size` pixels under a box filter, seen from `eye` towards `look`.
void SetCamera(Scene& scene, const std::array<double, 3>& eye, const std::array<double, 3>& look,
               const std::array<double, 3>& up, double fov_deg, int size);

// Settings of the scene with what most tests set, and the radius controller with no evidence.
[[nodiscard]] RenderSettings TestSettings(const Scene& scene, std::int64_t photons_per_pass,
                                          double initial_radius, int max_depth,
                                          std::uint64_t seed = 1);

}  // namespace lucerna
