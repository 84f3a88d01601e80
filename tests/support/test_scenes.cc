#include "tests/support/test_scenes.h"

#include <vector>

#include "render/math/warp.h"
#include "render/transport/coat_tables.h"
#include "render/transport/subsurface.h"
#include "tests/support/local_render.h"

namespace lucerna {

Material DiffuseMaterial(float reflectance) {
  Material material;
  material.kind = Material::Kind::kDiffuse;
  material.reflectance = Gray(reflectance);
  return material;
}

Material DielectricMaterial(float ior, float alpha) {
  Material material;
  material.kind = Material::Kind::kDielectric;
  material.ior = ior;
  material.alpha_u = alpha;
  material.alpha_v = alpha;
  return material;
}

Material CoatedMaterial(float reflectance, float alpha, float thickness) {
  Material material = DiffuseMaterial(reflectance);
  material.kind = Material::Kind::kCoatedDiffuse;
  material.alpha_u = alpha;
  material.alpha_v = alpha;
  material.thickness = thickness;
  std::vector<Material> one = {material};
  PrepareCoats(one);
  return one[0];
}

Material CoatedMetal(Rgb eta, Rgb k, float alpha, float base_alpha, float thickness) {
  Material material = ConductorMaterial(eta, k, alpha, alpha);
  material.kind = Material::Kind::kCoatedConductor;
  material.base_alpha_u = base_alpha;
  material.base_alpha_v = base_alpha;
  material.thickness = thickness;
  std::vector<Material> one = {material};
  PrepareCoats(one);
  return one[0];
}

Material WithHaze(Material coated, float albedo, float g) {
  coated.coat_albedo = Gray(albedo);
  coated.phase_g = g;
  coated.base_hits = 1000;
  std::vector<Material> one = {coated};
  PrepareCoats(one);
  return one[0];
}

Material SheetMaterial(float reflectance, float transmittance) {
  Material material = DiffuseMaterial(reflectance);
  material.kind = Material::Kind::kDiffuseTransmission;
  material.transmittance = Gray(transmittance);
  return material;
}

Material SubsurfaceMaterial(float reflectance, float free_path, float alpha) {
  Material material = DiffuseMaterial(reflectance);
  material.kind = Material::Kind::kSubsurface;
  material.scatters_for_reflectance = true;
  material.extinction = Gray(1 / free_path);
  material.alpha_u = alpha;
  material.alpha_v = alpha;
  std::vector<Material> one = {material};
  PrepareCoats(one);
  PrepareSubsurface(one);
  return one[0];
}

Material HairMaterial(float absorption, float beta_m, float beta_n) {
  Material material;
  material.kind = Material::Kind::kHair;
  material.absorption = Gray(absorption);
  material.beta_m = beta_m;
  material.beta_n = beta_n;
  material.ior = 1.55F;
  material.scale_tilt = 2 * kPi / 180;
  material.is_on_thin_shapes = true;
  return material;
}

Material ConductorMaterial(Rgb eta, Rgb k, float alpha_u, float alpha_v) {
  Material material;
  material.kind = Material::Kind::kConductor;
  material.eta = eta;
  material.k = k;
  material.alpha_u = alpha_u;
  material.alpha_v = alpha_v;
  return material;
}

std::int32_t AddMaterial(Scene& scene, const Material& material) {
  scene.materials.push_back(material);
  return static_cast<std::int32_t>(scene.materials.size()) - 1;
}

std::int32_t AddAreaLight(Scene& scene, float radiance, bool two_sided) {
  scene.area_lights.push_back({Gray(radiance), two_sided});
  return static_cast<std::int32_t>(scene.area_lights.size()) - 1;
}

TextureMapping ByUv(float scale_u, float scale_v, float delta_u, float delta_v) {
  TextureMapping mapping;
  mapping.scale_u = scale_u;
  mapping.scale_v = scale_v;
  mapping.delta_u = delta_u;
  mapping.delta_v = delta_v;
  return mapping;
}

void AddQuad(Scene& scene, Vec3 corner, Vec3 edge1, Vec3 edge2, std::int32_t material,
             std::int32_t area_light) {
  TriangleMesh mesh;
  mesh.positions = {corner, corner + edge1, corner + edge1 + edge2, corner + edge2};
  mesh.indices = {0, 1, 2, 0, 2, 3};
  mesh.traits = {material, area_light};
  scene.meshes.push_back(mesh);
}

std::int32_t AddStripes(Scene& scene, float first, float second, const TextureMapping& mapping) {
  const auto number = static_cast<std::int32_t>(scene.textures.size());
  for (const float value : {first, second}) {
    Texture constant;
    constant.color = Gray(value);
    scene.textures.push_back(constant);
  }
  Texture stripes;
  stripes.kind = Texture::Kind::kCheckerboard;
  stripes.parts = {number, number + 1, -1, -1};
  stripes.mapping = mapping;
  scene.textures.push_back(stripes);
  return number + 2;
}

void AddBox(Scene& scene, Vec3 low, Vec3 high, std::int32_t material) {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    mesh.positions.push_back({(corner & 1) != 0 ? high.x : low.x,
                              (corner & 2) != 0 ? high.y : low.y,
                              (corner & 4) != 0 ? high.z : low.z});
  }
  mesh.indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                  2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  mesh.traits = {material, kNoAreaLight};
  scene.meshes.push_back(mesh);
}

void AddSphere(Scene& scene, Vec3 center, float radius, std::int32_t material,
               std::int32_t area_light, bool inward) {
  scene.spheres.push_back({center, radius, inward, {material, area_light}});
}

void AddDisk(Scene& scene, Vec3 center, Vec3 normal, float radius, std::int32_t material,
             std::int32_t area_light) {
  scene.disks.push_back({center, normal, radius, 0, {material, area_light}});
}

void SetCamera(Scene& scene, const std::array<double, 3>& eye, const std::array<double, 3>& look,
               const std::array<double, 3>& up, double fov_deg, int size) {
  scene.camera.camera_to_world = Transform::LookAt(eye, look, up).value().Inverse().value();
  scene.camera.fov_deg = fov_deg;
  scene.film.width = size;
  scene.film.height = size;
  scene.film.crop_x0 = 0;
  scene.film.crop_y0 = 0;
  scene.film.crop_x1 = size;
  scene.film.crop_y1 = size;
  scene.filter.kind = PixelFilter::Kind::kBox;
  scene.filter.radius_x = 0.5F;
  scene.filter.radius_y = 0.5F;
}

RenderSettings TestSettings(const Scene& scene, std::int64_t photons_per_pass,
                            double initial_radius, int max_depth, std::uint64_t seed) {
  RenderOverrides overrides;
  overrides.photons_per_pass = photons_per_pass;
  overrides.initial_radius = initial_radius;
  overrides.max_depth = max_depth;
  overrides.seed = seed;
  overrides.radius_controller = RadiusControllerKind::kPpm;
  return SettingsFor(scene, overrides);
}

}  // namespace lucerna
