// Objects and their instances.
//
// A few instances of small objects are written out as meshes of their own: then edges of discs,
// shadows and curvature are found on them, and rays go through one tree. An object whose copies
// would take a lot of memory is shared (docs/decisions/instances.md).
#include <utility>

#include "render/base/text.h"
#include "render/formats/mesh_placement.h"
#include "render/formats/pbrt/directives.h"
#include "render/scene/scene_extent.h"
#include "render/scene/shape_lists.h"

namespace lucerna {

void DirectiveReader::PlaceInstance(Object& object, Arguments& arguments) {
  if (!CheckAffine(arguments)) return;
  const TransformPair& places = graphics_.state().to_world;
  const Transform& to_world = places.start;
  const bool stays_similar = !places.Moves() || places.end.UniformScale().ok();
  if (!to_world.Inverse().ok()) {
    diagnostics_.Note(arguments.location(),
                      "an instance is flattened by its transform and left out");
    return;
  }
  // One instance alone takes no more than the object.
  const bool is_used = object.shared.has_value() || object.has_instance;
  if (!object.shared.has_value() && is_used && object.triangles > 0 && !object.has_moving_parts &&
      written_out_triangles_ + object.triangles > kMaxWrittenOut) {
    Share(object);
  }
  object.has_instance = true;
  if (object.shared.has_value()) AddInstance(object, to_world, arguments);
  if (IsStopped()) return;
  // Before it is laid out, because that is what takes the memory.
  if (!HasRoomFor(object.shapes, arguments)) return;
  StatusOr<ShapeSet> shapes = Instantiate(object.shapes, to_world, stays_similar);
  if (!shapes.ok()) {
    arguments.Error(std::string(shapes.status().message()));
    return;
  }
  ForEachShapeTraits(*shapes, [&](ShapeTraits& traits) {
    traits.motion = MotionOfInstance(traits.motion, arguments);
  });
  if (IsStopped()) return;
  if (!object.shared.has_value() && !shapes->meshes.empty()) {
    written_out_.push_back({&object, to_world, shapes->meshes.front().traits.motion,
                            scene_.meshes.size(), shapes->meshes.size()});
    written_out_triangles_ += object.triangles;
  }
  AddShapes(*std::move(shapes));
}

void DirectiveReader::Share(Object& object) {
  object.shared = static_cast<std::uint32_t>(scene_.objects.size());
  InstancedObject& shared = scene_.objects.emplace_back();
  shared.first_mesh = static_cast<std::uint32_t>(scene_.object_meshes.size());
  shared.mesh_count = static_cast<std::uint32_t>(object.shapes.meshes.size());
  for (TriangleMesh& mesh : object.shapes.meshes) {
    for (const Vec3& position : mesh.positions)
      shared.box.Add(position);
    scene_.object_meshes.push_back(std::move(mesh));
  }
  object.shapes.meshes.clear();
}

void DirectiveReader::AddInstance(Object& object, const Transform& to_world, Arguments& arguments) {
  instanced_triangles_ += object.triangles;
  shapes_bytes_ += kInstanceBytes;
  const Instance& instance =
      scene_.instances.emplace_back(Instance{*object.shared, to_world, MotionHere(arguments)});
  const Bounds box = BoundsOf(scene_, instance);
  if (!IsFinite(box.low) || !IsFinite(box.high)) {
    arguments.Error("the instance is moved or scaled out of single precision by its transform");
  }
  if (instanced_triangles_ > kMaxInstanced) {
    arguments.Error(Concat("the scene has more than ", kMaxInstanced,
                           " triangles, each counted wherever an instance repeats it"));
    is_stopped_ = true;
  } else if (shapes_bytes_ > assets_.limits().max_shape_bytes) {
    arguments.Error(Concat("with this, the shapes of the scene take more than the ",
                           assets_.limits().max_shape_bytes,
                           " bytes of memory that there are for them; repeat meshes less often"));
    is_stopped_ = true;
  }
}

// All copies of an object are of one kind.
void DirectiveReader::ReplaceWrittenOut() {
  std::vector<bool> is_replaced(scene_.meshes.size(), false);
  bool any = false;
  for (const WrittenOutMeshes& copy : written_out_) {
    if (!copy.object->shared.has_value()) continue;
    any = true;
    scene_.instances.push_back({*copy.object->shared, copy.to_world, copy.motion});
    for (std::size_t i = 0; i < copy.count; ++i)
      is_replaced[copy.first + i] = true;
  }
  if (!any) return;
  std::vector<std::size_t> now_at(scene_.meshes.size());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < scene_.meshes.size(); ++i) {
    now_at[i] = kept;
    if (is_replaced[i]) continue;
    if (kept != i) scene_.meshes[kept] = std::move(scene_.meshes[i]);
    ++kept;
  }
  scene_.meshes.resize(kept);
  for (EmittingMesh& light : unfinished_.emitting_meshes)
    light.mesh = now_at[light.mesh];
}

}  // namespace lucerna
