#include "render/formats/gltf/gltf_reader.h"

#include <algorithm>
#include <array>
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

constexpr std::array<std::string_view, 8> kExtensions = {
    "EXT_mesh_gpu_instancing", "KHR_lights_punctual",        "KHR_materials_emissive_strength",
    "KHR_materials_ior",       "KHR_materials_transmission", "KHR_materials_volume",
    "KHR_mesh_quantization",   "KHR_texture_transform"};

bool IsRead(const std::string& extension) {
  return std::ranges::find(kExtensions, extension) != kExtensions.end();
}

class GltfReader {
 public:
  GltfReader(const GltfDocument& document, AssetReader& assets)
      : document_(document), assets_(assets) {}

  UnfinishedScene Read();

 private:
  void CheckExtensions();
  void NoteWhatIsIgnored();
  void PlaceMeshes(const std::vector<std::vector<Transform>>& places);
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
    document_.diagnostics().Error(
        document_.whole(), Concat("the file requires the extension ", Quoted(name),
                                  ", which is not supported; there are ", Listed(kExtensions)));
  }
  for (const std::string& name : document_.Root().Strings("extensionsUsed")) {
    if (IsRead(name) || std::ranges::find(required, name) != required.end()) continue;
    document_.diagnostics().Note(document_.whole(),
                                 Concat("the extension ", Quoted(name), " is ignored"));
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

void GltfReader::PlaceMeshes(const std::vector<std::vector<Transform>>& places) {
  GltfMeshes meshes(document_, buffers_, materials_, budget_);
  for (std::size_t i = 0; i < places.size() && !budget_.is_spent(); ++i) {
    if (places[i].empty()) continue;
    std::vector<GltfPrimitive> primitives = meshes.Read(i);
    std::uint64_t triangles = 0;
    for (const GltfPrimitive& primitive : primitives)
      triangles += primitive.emits() ? 0 : primitive.mesh.indices.size() / 3;
    // Both numbers are far from 2^32, so the product fits.
    const std::uint64_t all_copies = triangles * places[i].size();
    const bool is_repeated = places[i].size() > 1;
    const bool is_shared = is_repeated && written_out_triangles_ + all_copies > kMaxWrittenOut;
    if (is_repeated && !is_shared) written_out_triangles_ += all_copies;
    std::vector<GltfPrimitive> shared;
    for (GltfPrimitive& primitive : primitives) {
      // Objects that instances repeat do not emit.
      if (is_shared && !primitive.emits()) {
        shared.push_back(std::move(primitive));
        continue;
      }
      for (const Transform& to_world : places[i]) {
        // The first copy takes the place of what was read.
        const bool has_room =
            &to_world == &places[i].front() ||
            budget_.Take(primitive.mesh.indices.size() / 3, SizeBytes(primitive.mesh));
        if (!has_room) return;
        WriteOut(primitive, to_world);
      }
    }
    if (!shared.empty()) Share(std::move(shared), places[i]);
  }
}

UnfinishedScene GltfReader::Read() {
  Diagnostics& diagnostics = document_.diagnostics();
  CheckExtensions();
  // Without what the file requires nothing else that is said about it helps.
  if (diagnostics.has_error()) return std::move(unfinished_);
  NoteWhatIsIgnored();
  const GltfPlaces places = WalkNodes(document_, buffers_, budget_);
  PlaceMeshes(places.meshes);
  AddGltfLights(document_, places.lights, scene_);
  unfinished_.has_camera = true;
  if (!places.cameras.empty()) {
    SetGltfCamera(document_, places.cameras, scene_);
  } else if (!scene_.meshes.empty() || !scene_.instances.empty()) {
    FrameWholeScene(scene_);
    diagnostics.Warning(document_.whole(),
                        "the file has no camera: one is added that sees the whole scene from the "
                        "front; add a camera to choose the view");
  } else {
    unfinished_.has_camera = false;
  }
  const bool has_light = !scene_.area_lights.empty() || DeltaLightCount(scene_) > 0;
  if (!has_light) {
    scene_.infinite_lights.push_back({Gray(1)});
    diagnostics.Warning(document_.whole(),
                        "the file has no light: an even sky of radiance 1 is added; add lights "
                        "(KHR_lights_punctual) or emissive materials");
  }
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
