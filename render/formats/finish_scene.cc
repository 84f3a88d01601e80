#include "render/formats/finish_scene.h"

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "render/base/text.h"
#include "render/formats/scene_unit.h"
#include "render/scene/degenerate_triangles.h"
#include "render/scene/materials_in_use.h"
#include "render/scene/scene_at_time.h"
#include "render/scene/scene_extent.h"
#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

// A scene farther than so many times its size from the origin gets a warning. Up to there images
// agree within their noise (docs/numerics.md).
constexpr double kFarSizes = 1e4;

// Whether a texture is placed by u and v, or one that it is made of.
bool IsPlacedByUv(const Scene& scene, std::int32_t number) {
  if (number == kNoTexture) return false;
  using Kind = Texture::Kind;
  const Texture& texture = scene.textures[static_cast<std::size_t>(number)];
  const bool has_place = texture.kind == Kind::kPicture || texture.kind == Kind::kBilinear ||
                         texture.kind == Kind::kDots ||
                         (texture.kind == Kind::kCheckerboard && !texture.is_in_space);
  if (has_place && texture.mapping.IsOfUv()) return true;
  return std::ranges::any_of(texture.parts,
                             [&](std::int32_t part) { return IsPlacedByUv(scene, part); });
}

bool HasUvTexture(const Scene& scene, const Material& material) {
  if (!material.HasTexture()) return false;
  const auto by_uv = [&](std::int32_t texture) { return IsPlacedByUv(scene, texture); };
  return std::ranges::any_of(material.roughness_textures, by_uv) || by_uv(material.texture) ||
         by_uv(material.thickness_texture) || by_uv(material.second_texture) ||
         by_uv(material.displacement) || by_uv(material.normal_map) ||
         by_uv(material.amount_texture);
}

void BeginMotion(Scene& scene, const SourceLocation& whole, Diagnostics& diagnostics) {
  if (const Status begun = BeginMotion(scene); !begun.ok())
    diagnostics.Error(whole, std::string(begun.message()));
  // Sensors are on surfaces as they are then.
  if (scene.camera.kind != Camera::Kind::kSensors || !scene.motion.Moves()) return;
  diagnostics.Warning(whole, "irradiance is measured as the shutter opens: nothing moves");
  ForgetMotion(scene);
}

void WarnOfMissingUvs(const Scene& scene, const SourceLocation& whole, Diagnostics& diagnostics) {
  std::vector<std::uint8_t> needs_uv;
  for (const Material& material : scene.materials)
    needs_uv.push_back(HasUvTexture(scene, material) ? 1 : 0);
  const auto warn = [&](const TriangleMesh& mesh) {
    const auto number = static_cast<std::size_t>(mesh.traits.material);
    bool is_textured = needs_uv[number] != 0;
    for (const std::int32_t part : scene.materials[number].mixed)
      is_textured = is_textured || (part >= 0 && needs_uv[static_cast<std::size_t>(part)] != 0);
    if (const std::int32_t light = mesh.traits.area_light; light != kNoAreaLight) {
      is_textured =
          is_textured || scene.area_lights[static_cast<std::size_t>(light)].picture != nullptr;
    }
    is_textured = is_textured || IsPlacedByUv(scene, mesh.traits.alpha_texture);
    if (mesh.uvs.empty() && is_textured) {
      diagnostics.Warning(whole,
                          "a mesh with a texture has no uv: every triangle shows half of it");
    }
  };
  std::ranges::for_each(scene.meshes, warn);
  std::ranges::for_each(scene.object_meshes, warn);
}

void WarnOfDistance(const Scene& scene, const SourceLocation& whole, Diagnostics& diagnostics) {
  const SceneExtent extent = ExtentOf(scene);
  if (!(extent.size > 0 && extent.from_origin > kFarSizes * extent.size)) return;
  const double sizes = extent.from_origin / extent.size;
  diagnostics.Warning(
      whole, Concat("the scene lies ", std::round(sizes),
                    " times its own size from the origin, where single precision keeps 1/",
                    std::round(std::max(1.0, 0x1p24 / sizes)), " of that size; move it nearer"));
}

void WarnOfEmptiness(const Scene& scene, const SourceLocation& whole, Diagnostics& diagnostics) {
  if (ShapeCount(scene) == 0 && scene.instances.empty()) {
    diagnostics.Warning(whole, "the scene has no shapes");
  }
  if (scene.area_lights.empty() && DeltaLightCount(scene) == 0 && scene.infinite_lights.empty()) {
    diagnostics.Warning(whole, "the scene has no light: the image will be black");
  }
}

// A camera that sees all shapes of a right-handed scene, from the front and a little from above.
void FrameWholeScene(Scene& scene) {
  constexpr double kFovDeg = 40;
  constexpr double kMargin = 1.05;
  // +z is the front of a glTF model, +y is up.
  constexpr std::array kFrom = {0.4, 0.3, 1.0};
  const Bounds box = BoundsOf(scene);
  const Vec3 center = box.Center();
  const double diagonal = static_cast<double>(box.Diagonal());
  const double radius = diagonal > 0 ? diagonal / 2 : 1;
  const double distance = kMargin * radius / std::sin(kFovDeg / 2 * std::numbers::pi / 180) /
                          std::hypot(kFrom[0], kFrom[1], kFrom[2]);
  const std::array<double, 3> look = {static_cast<double>(center.x), static_cast<double>(center.y),
                                      static_cast<double>(center.z)};
  const std::array<double, 3> eye = {look[0] + distance * kFrom[0], look[1] + distance * kFrom[1],
                                     look[2] + distance * kFrom[2]};
  const StatusOr<Transform> to_camera = Transform::LookAt(eye, look, {0, 1, 0});
  scene.camera.fov_deg = kFovDeg;
  if (!to_camera.ok()) return;
  // LookAt makes the left-handed camera of pbrt, whose image of a right-handed scene is mirrored.
  const StatusOr<Transform> to_world = to_camera->Inverse();
  if (to_world.ok()) scene.camera.camera_to_world = *to_world * Transform::Scale(-1, 1, 1);
}

void AddMissingView(UnfinishedScene& unfinished, const SourceLocation& whole,
                    Diagnostics& diagnostics) {
  Scene& scene = unfinished.scene;
  if (!unfinished.has_camera) {
    if (ShapeCount(scene) + scene.instances.size() == 0) {
      diagnostics.Error(
          whole, "the file has no triangles: points, lines and empty nodes are not rendered");
      return;
    }
    FrameWholeScene(scene);
    unfinished.has_camera = true;
    diagnostics.Warning(whole,
                        "the file has no camera: one is added that sees the whole scene from the "
                        "front; add a camera, or say where it is, to choose the view");
  }
  // An image that shines is more often a display on what is shown than what lights it.
  const bool has_emitter = std::ranges::any_of(
      scene.area_lights, [](const AreaLight& light) { return light.picture == nullptr; });
  if (has_emitter || DeltaLightCount(scene) > 0 || !scene.infinite_lights.empty()) return;
  scene.infinite_lights.push_back({Gray(1)});
  diagnostics.Warning(
      whole, Concat(scene.area_lights.empty() ? "the file has no light: "
                                              : "the file has no light but images: ",
                    "an even sky of radiance 1 is added; add lights (KHR_lights_punctual) or "
                    "emissive materials, or name an environment"));
}

// Of triangles that have no area in the scene's own unit.
void DropFlatTriangles(UnfinishedScene& unfinished, const SourceLocation& whole,
                       Diagnostics& diagnostics) {
  Scene& scene = unfinished.scene;
  std::size_t dropped = 0;
  for (TriangleMesh& mesh : scene.meshes)
    dropped += DropTriangles(mesh, FLT_MIN);
  for (const EmittingMesh& light : unfinished.emitting_meshes) {
    if (scene.meshes[light.mesh].indices.empty())
      WarnOfLightWithoutArea(light.location, light.subject, diagnostics);
  }
  std::erase_if(scene.meshes, [](const TriangleMesh& mesh) { return mesh.indices.empty(); });
  if (dropped > 0) {
    diagnostics.Note(whole, Concat(dropped, dropped == 1 ? " triangle has" : " triangles have",
                                   " no area in single precision and are dropped"));
  }
}

// Colours of vertices that no texture shows are memory alone.
void DropUnusedColors(Scene& scene) {
  const auto shows = [](const Texture& texture) {
    return texture.kind == Texture::Kind::kVertexColor;
  };
  if (std::ranges::any_of(scene.textures, shows)) return;
  for (std::vector<TriangleMesh>* const meshes : {&scene.meshes, &scene.object_meshes}) {
    for (TriangleMesh& mesh : *meshes)
      mesh.colors = {};
  }
}

// Light passes an interface unchanged: one that separates no media, and is no light, has no part in
// the image.
void DropInterfacesWithinMedia(Scene& scene, const SourceLocation& whole,
                               Diagnostics& diagnostics) {
  const auto is_interface = [&](const ShapeTraits& traits) {
    return IsInterface(scene.materials[static_cast<std::size_t>(traits.material)]);
  };
  std::size_t lights = 0;
  ForEachShapeTraits(scene, [&](ShapeTraits& traits) {
    if (!is_interface(traits) || traits.area_light == kNoAreaLight) return;
    traits.area_light = kNoAreaLight;
    ++lights;
  });
  if (lights > 0) {
    diagnostics.Warning(whole, Concat("shapes of the material interface emit no light: ", lights));
  }
  ForEachShapeList(scene, [&](auto& list) {
    std::erase_if(list, [&](const auto& shape) {
      return is_interface(shape.traits) && !shape.traits.SeparatesMedia();
    });
  });
  std::vector<TriangleMesh> kept;
  for (InstancedObject& object : scene.objects) {
    const auto first = static_cast<std::uint32_t>(kept.size());
    for (std::uint32_t i = 0; i < object.mesh_count; ++i) {
      TriangleMesh& mesh = scene.object_meshes[object.first_mesh + i];
      if (is_interface(mesh.traits) && !mesh.traits.SeparatesMedia()) continue;
      kept.push_back(std::move(mesh));
    }
    object.first_mesh = first;
    object.mesh_count = static_cast<std::uint32_t>(kept.size()) - first;
  }
  scene.object_meshes = std::move(kept);
}

bool UsesMedia(const Scene& scene) {
  bool uses = scene.camera.medium != kNoMedium;
  ForEachDeltaList(scene, [&](const auto& lights) {
    for (const auto& light : lights)
      uses = uses || light.medium != kNoMedium;
  });
  ForEachShapeTraits(scene, [&](const ShapeTraits& traits) {
    const bool has_medium = traits.medium_inside != kNoMedium || traits.medium_outside != kNoMedium;
    uses = uses || (has_medium && (traits.SeparatesMedia() || traits.area_light != kNoAreaLight));
  });
  return uses;
}

void ForgetMedia(Scene& scene) {
  scene.media.clear();
  ForEachShapeTraits(scene, [](ShapeTraits& traits) {
    traits.medium_inside = kNoMedium;
    traits.medium_outside = kNoMedium;
  });
}

// The medium outside of everything, as far as the scene's file says so; kNoMedium where shapes
// disagree.
std::int32_t OutermostMedium(const Scene& scene) {
  std::optional<std::int32_t> outermost;
  if (scene.camera.medium != kNoMedium) outermost = scene.camera.medium;
  bool is_same = true;
  ForEachShapeTraits(scene, [&](const ShapeTraits& traits) {
    if (!traits.SeparatesMedia()) return;
    if (!outermost.has_value()) outermost = traits.medium_outside;
    is_same = is_same && traits.medium_outside == *outermost;
  });
  return is_same ? outermost.value_or(kNoMedium) : kNoMedium;
}

void WarnOfEndlessMedium(const Scene& scene, const SourceLocation& whole,
                         Diagnostics& diagnostics) {
  if (scene.infinite_lights.empty() && scene.distant_lights.empty()) return;
  const std::int32_t outermost = OutermostMedium(scene);
  if (outermost == kNoMedium) return;
  const Medium& medium = scene.media[static_cast<std::size_t>(outermost)];
  const Rgb extinction = medium.Extinction();
  // A grid has an end.
  if (medium.density != nullptr || !(std::min({extinction.r, extinction.g, extinction.b}) > 0))
    return;
  diagnostics.Warning(whole, Concat("the medium ", Quoted(medium.name),
                                    " around the scene has no end: light of infinite and "
                                    "distant lights does not get through it"));
}

// A disc of photons is many times as wide as a hair, of which it would hold next to nothing: on
// thin shapes eye paths go on, and direct light is sampled, as on surfaces with narrow lobes.
void StopGatheringOnThinShapes(Scene& scene) {
  std::map<std::int32_t, std::int32_t> thin;  // materials and their copies
  ForEachAnalyticShape(scene, [&](auto& shape) {
    if constexpr (std::decay_t<decltype(shape)>::kIsThin) {
      shape.traits.material = CopyForThinShapes(scene.materials, shape.traits.material, thin);
    }
  });
}

// They are made before the first pass, by the coordinator and by every worker, which neither a
// cancel nor an end of the process interrupts.
void CheckTables(const Scene& scene, const SourceLocation& whole, Diagnostics& diagnostics) {
  constexpr double kMostSeconds = 60;
  const double seconds = SecondsOfTables(scene.materials);
  if (seconds <= kMostSeconds) return;
  diagnostics.Error(
      whole, Concat("the tables of so many different coats and subsurface materials would take ",
                    std::llround(seconds), " s of processor time in every process, more than ",
                    std::llround(kMostSeconds),
                    "; give more of them the same roughness, index and thickness"));
}

}  // namespace

void WarnOfLightWithoutArea(const SourceLocation& location, const std::string& subject,
                            Diagnostics& diagnostics) {
  diagnostics.Warning(location, Concat(subject, " has no area: it emits no light"));
}

Scene FinishScene(UnfinishedScene unfinished, const std::string& main_file,
                  Diagnostics& diagnostics) {
  Scene& scene = unfinished.scene;
  if (diagnostics.has_error()) return std::move(scene);
  const SourceLocation whole = {&main_file, 0, 0};
  if (unfinished.is_object) AddMissingView(unfinished, whole, diagnostics);
  if (diagnostics.has_error()) return std::move(scene);
  BeginMotion(scene, whole, diagnostics);
  JoinMixes(scene.materials);
  WarnOfMissingUvs(scene, whole, diagnostics);
  WarnOfDistance(scene, whole, diagnostics);
  for (std::string& message : unfinished.missing)
    diagnostics.Error(whole, std::move(message));
  if (!unfinished.has_camera && !unfinished.without_camera.empty()) {
    diagnostics.Warning(whole, std::move(unfinished.without_camera));
  } else if (!unfinished.has_camera) {
    diagnostics.Error(whole, "the scene has no camera");
  }
  WarnOfEmptiness(scene, whole, diagnostics);
  if (const Status chosen = ChooseUnit(scene); !chosen.ok()) {
    diagnostics.Error(whole, std::string(chosen.message()));
  }
  DropFlatTriangles(unfinished, whole, diagnostics);
  DropInterfacesWithinMedia(scene, whole, diagnostics);
  if (!UsesMedia(scene)) ForgetMedia(scene);
  DropUnusedColors(scene);
  WarnOfEndlessMedium(scene, whole, diagnostics);
  StopGatheringOnThinShapes(scene);
  // Of copies for thin shapes.
  JoinMixes(scene.materials);
  DropUnusedMaterials(scene);
  CheckTables(scene, whole, diagnostics);
  return std::move(scene);
}

}  // namespace lucerna
