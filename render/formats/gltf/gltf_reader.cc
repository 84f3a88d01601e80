#include "render/formats/gltf/gltf_reader.h"

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "render/base/text.h"
#include "render/formats/gltf/accessors.h"
#include "render/formats/gltf/cameras.h"
#include "render/formats/gltf/document.h"
#include "render/formats/gltf/lights.h"
#include "render/formats/gltf/materials.h"
#include "render/formats/gltf/meshes.h"
#include "render/formats/gltf/nodes.h"
#include "render/formats/gltf/textures.h"
#include "render/formats/mesh_placement.h"
#include "render/scene/degenerate_triangles.h"
#include "render/scene/scene_extent.h"
#include "render/scene/shape_moves.h"

namespace lucerna {
namespace {

constexpr std::array<std::string_view, 11> kExtensions = {
    "EXT_mesh_gpu_instancing", "KHR_lights_punctual",
    "KHR_materials_clearcoat", "KHR_materials_emissive_strength",
    "KHR_materials_ior",       "KHR_materials_transmission",
    "KHR_materials_volume",    "KHR_materials_specular",
    "KHR_mesh_quantization",   "KHR_node_visibility",
    "KHR_texture_transform"};

bool IsRead(const std::string& extension) {
  return std::ranges::find(kExtensions, extension) != kExtensions.end();
}

struct ExtensionRule {
  std::string_view name;
  std::string_view says;
};

// Files are read without these, even where they require them.
constexpr std::array kLeftOut = {
    ExtensionRule{"EXT_lights_image_based", "its environment light is left out"},
    ExtensionRule{"KHR_animation_pointer", "nothing moves"},
    ExtensionRule{"KHR_materials_anisotropy", "highlights are round"},
    ExtensionRule{"KHR_materials_diffuse_transmission", "no light comes through diffuse surfaces"},
    ExtensionRule{"KHR_materials_dispersion", "glass does not split light into colours"},
    ExtensionRule{"KHR_materials_iridescence", "thin films have no colours"},
    ExtensionRule{"KHR_materials_sheen", "the sheen of cloth is left out"},
    ExtensionRule{"KHR_materials_unlit", "surfaces without shading are lit, as diffuse ones"},
    ExtensionRule{"KHR_materials_variants", "meshes have the materials of their primitives"},
    ExtensionRule{"KHR_xmp", "it changes nothing that is seen"},
    ExtensionRule{"KHR_xmp_json_ld", "it changes nothing that is seen"},
    ExtensionRule{"MSFT_lod", "meshes have their finest level of detail"},
};
// Of avatars, whose names begin with this.
constexpr std::string_view kAvatar = "VRM";

// Without these there is no shape or picture.
constexpr std::array kCompressions = {
    ExtensionRule{"EXT_meshopt_compression", "export the file without compression of meshes"},
    ExtensionRule{"EXT_texture_avif", "export the file with images that are PNG or JPEG"},
    ExtensionRule{"EXT_texture_webp", "export the file with images that are PNG or JPEG"},
    ExtensionRule{"KHR_draco_mesh_compression", "export the file without Draco compression"},
    ExtensionRule{"KHR_meshopt_compression", "export the file without compression of meshes"},
    ExtensionRule{"KHR_texture_basisu", "export the file with images that are PNG or JPEG"},
    ExtensionRule{"MSFT_texture_dds", "export the file with images that are PNG or JPEG"},
};

std::optional<std::string_view> RuleFor(std::span<const ExtensionRule> rules,
                                        std::string_view name) {
  const auto rule = std::ranges::find(rules, name, &ExtensionRule::name);
  if (rule == rules.end()) return std::nullopt;
  return rule->says;
}

// What leaving out the extension changes; nullopt where that is not known.
std::optional<std::string_view> WhatIsLeftOut(std::string_view name) {
  if (name.starts_with(kAvatar)) return "avatars stand as the nodes say, with their base materials";
  return RuleFor(kLeftOut, name);
}

class GltfReader {
 public:
  GltfReader(const GltfDocument& document, AssetReader& assets)
      : document_(document), assets_(assets) {}

  UnfinishedScene Read();

 private:
  void CheckExtensions();
  void NoteWhatIsIgnored();
  void PlaceMeshes(const GltfPlaces& places);
  void PlaceMesh(std::vector<GltfPrimitive> primitives, const std::vector<Transform>& places);
  // As meshes of the world, or as an object that instances repeat.
  void WriteOut(const GltfPrimitive& primitive, const Transform& to_world);
  void Share(std::vector<GltfPrimitive> primitives, const std::vector<Transform>& places);

  const GltfDocument& document_;
  AssetReader& assets_;
  UnfinishedScene unfinished_;
  Scene& scene_ = unfinished_.scene;
  GltfBuffers buffers_{document_, assets_};
  GltfTextures textures_{document_, buffers_, assets_, scene_.textures};
  GltfMaterials materials_{document_, textures_, scene_};
  GltfBudget budget_{document_, assets_.limits()};
  std::uint64_t written_out_triangles_ = 0;
  std::uint64_t instanced_triangles_ = 0;
};

void GltfReader::CheckExtensions() {
  const std::vector<std::string> required = document_.Root().Strings("extensionsRequired");
  for (const std::string& name : required) {
    if (IsRead(name)) continue;
    if (const auto left_out = WhatIsLeftOut(name)) {
      document_.diagnostics().Warning(
          document_.whole(),
          Concat("the required extension ", Quoted(name), " is ignored: ", *left_out));
      continue;
    }
    const std::optional<std::string_view> advice = RuleFor(kCompressions, name);
    document_.diagnostics().Error(
        document_.whole(),
        Concat(
            "the file requires the extension ", Quoted(name), ", which is not supported; ",
            advice.has_value() ? std::string(*advice) : Concat("there are ", Listed(kExtensions))));
  }
  for (const std::string& name : document_.Root().Strings("extensionsUsed")) {
    if (IsRead(name) || std::ranges::find(required, name) != required.end()) continue;
    const std::optional<std::string_view> left_out = WhatIsLeftOut(name);
    document_.diagnostics().Note(document_.whole(),
                                 Concat("the extension ", Quoted(name), " is ignored",
                                        left_out.has_value() ? ": " : "", left_out.value_or("")));
  }
}

void GltfReader::NoteWhatIsIgnored() {
  if (!document_.Root().Has("animations")) return;
  document_.diagnostics().Note(document_.whole(),
                               "animations are ignored: everything stands as its node says");
}

void GltfReader::WriteOut(const GltfPrimitive& primitive, const Transform& to_world) {
  TriangleMesh mesh = primitive.mesh;
  if (!MoveMesh(to_world, mesh)) {
    document_.diagnostics().Error(
        document_.whole(),
        Concat(primitive.place, ": a node moves or scales it out of single precision"));
    return;
  }
  DropTriangles(mesh, kLeastArea);
  if (primitive.emits() && mesh.indices.empty())
    WarnOfLightWithoutArea(document_.whole(), primitive.place, document_.diagnostics());
  if (mesh.indices.empty()) return;
  // The outward side stays outward: a mirror image is wound the other way round.
  if (to_world.SwapsHandedness()) SwapWinding(mesh);
  if (primitive.emits()) {
    unfinished_.emitting_meshes.push_back(
        {scene_.meshes.size(), document_.whole(), primitive.place});
  }
  scene_.meshes.push_back(std::move(mesh));
}

void GltfReader::Share(std::vector<GltfPrimitive> primitives,
                       const std::vector<Transform>& places) {
  InstancedObject object;
  object.first_mesh = static_cast<std::uint32_t>(scene_.object_meshes.size());
  object.mesh_count = static_cast<std::uint32_t>(primitives.size());
  std::uint64_t triangles = 0;
  for (GltfPrimitive& primitive : primitives) {
    for (const Vec3& position : primitive.mesh.positions)
      object.box.Add(position);
    triangles += primitive.mesh.indices.size() / 3;
    scene_.object_meshes.push_back(std::move(primitive.mesh));
  }
  const auto number = static_cast<std::uint32_t>(scene_.objects.size());
  scene_.objects.push_back(object);
  for (const Transform& to_world : places) {
    if (!to_world.Inverse().ok()) {
      document_.diagnostics().Note(document_.whole(),
                                   "an instance is flattened by its transform and left out");
      continue;
    }
    instanced_triangles_ += triangles;
    const Bounds box = BoundsOf(scene_, scene_.instances.emplace_back(Instance{number, to_world}));
    if (!IsFinite(box.low) || !IsFinite(box.high)) {
      document_.diagnostics().Error(
          document_.whole(),
          Concat(primitives.front().place, ": a node moves or scales it out of single precision"));
      return;
    }
    if (instanced_triangles_ > kMaxInstanced) {
      document_.diagnostics().Error(
          document_.whole(), Concat("the scene has more than ", kMaxInstanced,
                                    " triangles, each counted wherever an instance repeats it"));
      return;
    }
  }
}

void GltfReader::PlaceMesh(std::vector<GltfPrimitive> primitives,
                           const std::vector<Transform>& places) {
  // Objects that instances repeat do not emit.
  const auto may_be_shared = [](const GltfPrimitive& primitive) {
    return !primitive.emits() && !primitive.is_in_world;
  };
  std::uint64_t triangles = 0;
  for (const GltfPrimitive& primitive : primitives)
    triangles += may_be_shared(primitive) ? primitive.mesh.indices.size() / 3 : 0;
  // Both numbers are far from 2^32, so the product fits.
  const std::uint64_t all_copies = triangles * places.size();
  const bool is_repeated = places.size() > 1;
  const bool is_shared = is_repeated && written_out_triangles_ + all_copies > kMaxWrittenOut;
  if (is_repeated && !is_shared) written_out_triangles_ += all_copies;
  std::vector<GltfPrimitive> shared;
  for (GltfPrimitive& primitive : primitives) {
    if (primitive.is_in_world) {
      WriteOut(primitive, Transform());
      continue;
    }
    if (is_shared && may_be_shared(primitive)) {
      shared.push_back(std::move(primitive));
      continue;
    }
    for (const Transform& to_world : places) {
      // The first copy takes the place of what was read.
      const bool has_room =
          &to_world == &places.front() ||
          budget_.Take(primitive.mesh.indices.size() / 3, SizeBytes(primitive.mesh));
      if (!has_room) return;
      WriteOut(primitive, to_world);
    }
  }
  if (!shared.empty()) Share(std::move(shared), places);
}

void GltfReader::PlaceMeshes(const GltfPlaces& places) {
  GltfMeshes meshes(document_, buffers_, materials_, budget_);
  for (const auto& [shape, to_world] : places.meshes) {
    if (budget_.is_spent()) return;
    std::span<const Transform> joints;
    if (shape.skin.has_value()) {
      const auto skin = places.joints.find(*shape.skin);
      if (skin == places.joints.end()) continue;
      joints = skin->second;
    }
    if (!to_world.empty()) PlaceMesh(meshes.Read(shape, joints), to_world);
  }
}

UnfinishedScene GltfReader::Read() {
  Diagnostics& diagnostics = document_.diagnostics();
  CheckExtensions();
  // Without what the file requires nothing else that is said about it helps.
  if (diagnostics.has_error()) return std::move(unfinished_);
  NoteWhatIsIgnored();
  const GltfPlaces places = WalkNodes(document_, buffers_, budget_);
  PlaceMeshes(places);
  AddGltfLights(document_, places.lights, scene_);
  unfinished_.is_object = true;
  unfinished_.has_camera = !places.cameras.empty();
  // A camera that a view sets is mirrored as this one (formats/view/view_reader.h).
  scene_.camera.camera_to_world = Transform::Scale(1, 1, -1);
  if (unfinished_.has_camera) SetGltfCamera(document_, places.cameras, scene_);
  return std::move(unfinished_);
}

}  // namespace

bool BeginsAsGltf(std::string_view text) {
  if (text.starts_with("glTF")) return true;
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text[first] == '{' &&
         text.find("\"asset\"") != std::string_view::npos;
}

UnfinishedScene ReadGltf(const std::string& main_path, std::string_view bytes, AssetReader& assets,
                         Diagnostics& diagnostics) {
  const GltfDocument document(main_path, bytes, diagnostics);
  if (!document.is_readable()) return {};
  return GltfReader(document, assets).Read();
}

}  // namespace lucerna
