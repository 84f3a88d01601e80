// Shapes, and groups of them that instances repeat.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "render/base/text.h"
#include "render/formats/mitsuba/meshes.h"
#include "render/formats/mitsuba/translator.h"
#include "render/formats/parametric_mesh.h"

namespace lucerna {
namespace {

// From z to the axis of a cylinder that begins at `from`; absent when it has no length.
std::optional<Transform> AlongAxis(Vec3 from, Vec3 to, double& length) {
  const std::array<double, 3> axis = {static_cast<double>(to.x) - static_cast<double>(from.x),
                                      static_cast<double>(to.y) - static_cast<double>(from.y),
                                      static_cast<double>(to.z) - static_cast<double>(from.z)};
  length = std::hypot(axis[0], axis[1], axis[2]);
  if (!(length > 0)) return std::nullopt;
  const std::array<double, 3> z = {axis[0] / length, axis[1] / length, axis[2] / length};
  // Turned around the direction that is at right angles to both.
  const double across = std::hypot(z[0], z[1]);
  Transform turn;
  if (across > 0) {
    const double angle_deg = std::atan2(across, z[2]) * 180 / std::numbers::pi;
    turn = Transform::Rotate(angle_deg, -z[1], z[0], 0).value_or(Transform());
  } else if (z[2] < 0) {
    turn = Transform::Rotate(180, 1, 0, 0).value_or(Transform());
  }
  return Transform::Translate(static_cast<double>(from.x), static_cast<double>(from.y),
                              static_cast<double>(from.z)) *
         turn;
}

// Between Mitsuba's v and v = 1 - v.
void TurnOver(TriangleMesh& mesh) {
  for (Vec2& uv : mesh.uvs)
    uv.y = 1 - uv.y;
}

}  // namespace

std::vector<std::string> MitsubaTranslator::MaterialsNamedIn(const MitsubaObject& shape) const {
  std::vector<std::string> names;
  if (!document_.is_old() || shape.type != "obj") return names;
  for (const MitsubaObject& child : shape.children) {
    const MitsubaObject* bsdf = FindResolved(child);
    if (bsdf == nullptr || bsdf->tag != "bsdf" || child.called.empty()) continue;
    if (std::ranges::find(names, child.called) == names.end()) names.push_back(child.called);
  }
  return names;
}

std::vector<TriangleMesh> MitsubaTranslator::ReadMeshesOf(const MitsubaObject& shape,
                                                          ParameterList& list,
                                                          std::span<const std::string> materials) {
  // Whether v = 0 is at the top of pictures, as Mitsuba's textures have it.
  bool is_from_top = true;
  std::vector<TriangleMesh> meshes(1);
  if (shape.type == "rectangle") {
    meshes[0] = UnitSquare();
  } else if (shape.type == "cube") {
    meshes[0] = UnitCube();
  } else {
    const std::optional<std::string> file = list.FindString("filename");
    const bool is_obj = shape.type == "obj";
    const bool is_flipped = list.Bool("flip_tex_coords", is_obj);
    const bool has_flat_faces = list.Bool("face_normals", false);
    for (const std::string_view name : {"max_smooth_angle", "collapse", "srgb", "load_materials"})
      list.Ignore(name);
    const std::int64_t index = list.FindInteger("shape_index", {0, 1 << 30}).value_or(0);
    if (!file.has_value()) {
      list.Error("needs <string name=\"filename\">");
      return {};
    }
    Status read;
    const auto keep = [&](StatusOr<TriangleMesh> mesh) {
      read = mesh.status();
      if (mesh.ok()) meshes[0] = *std::move(mesh);
    };
    if (shape.type == "ply") {
      PlyFaces faces;
      keep(assets_.ReadMesh(*file, &faces));
      WarnOfSkipped(faces, list);
    } else if (const StatusOr<std::string> bytes = assets_.ReadBytes(*file); bytes.ok()) {
      if (is_obj) {
        StatusOr<std::vector<TriangleMesh>> parts = ParseObjParts(*bytes, materials);
        read = parts.status();
        if (parts.ok()) meshes = *std::move(parts);
        WarnOfMaterials(shape, *bytes, materials);
      } else {
        keep(ParseSerialized(*bytes, static_cast<std::uint64_t>(index),
                             assets_.limits().max_shape_bytes));
      }
      if (!read.ok()) read = absl::InvalidArgumentError(Concat(Quoted(*file), " ", read.message()));
    } else {
      read = bytes.status();
    }
    if (!read.ok()) {
      list.Error("filename", Concat("cannot be read: ", read.message()));
      return {};
    }
    is_from_top = !is_flipped;
    for (TriangleMesh& mesh : meshes) {
      if (has_flat_faces) {
        mesh.normals.clear();
      } else if (mesh.normals.empty()) {
        ComputeNormals(mesh);
      }
    }
  }
  if (is_from_top) {
    for (TriangleMesh& mesh : meshes)
      TurnOver(mesh);
  }
  return meshes;
}

void MitsubaTranslator::WarnOfMaterials(const MitsubaObject& shape, std::string_view obj,
                                        std::span<const std::string> materials) {
  if (!document_.is_old()) return;  // newer ones read no materials either
  const std::vector<std::string> used = MaterialsOfObj(obj);
  const bool has_all = std::ranges::all_of(used, [&](const std::string& name) {
    return std::ranges::find(materials, name) != materials.end();
  });
  if (has_all || (used.size() == 1 && ChildOf(shape, "bsdf") != nullptr)) return;
  diagnostics_.Warning(shape.location,
                       Concat(SubjectOf(shape),
                              " has materials of a file (mtllib), which is not read; give them as "
                              "bsdfs that are named like them: ",
                              Listed(used)));
}

void MitsubaTranslator::UseSurface(const Surface& surface, const MitsubaObject& shape,
                                   MadeDirective& made) {
  MadeDirective material = Directive("NamedMaterial", shape);
  material.strings = {surface.material};
  reader_.CarryOut(std::move(material));
  std::erase_if(made.parameters, [](const Parameter& p) { return p.name == "alpha"; });
  if (surface.alpha.has_value()) made.parameters.push_back(*surface.alpha);
}

void MitsubaTranslator::AddGeometry(const MitsubaObject& shape, ParameterList& list,
                                    MadeDirective made) {
  Transform to_world = ToWorld(shape);
  const auto number = [&](const char* name, double value) {
    made.parameters.push_back(MakeNumber(name, value, shape.location));
  };
  const std::string_view type = shape.type;
  std::set<const MitsubaObject*> visited;
  const MitsubaObject* bsdf = ChildOf(shape, "bsdf");
  const MitsubaObject* emitter = ChildOf(shape, "emitter");
  const bool has_texture = (bsdf != nullptr && HasTexture(*bsdf, visited)) ||
                           (emitter != nullptr && HasTexture(*emitter, visited));
  const auto add_mesh = [&](MadeDirective directive, TriangleMesh mesh) {
    SetTransform(to_world, shape);
    directive.strings = {"trianglemesh"};
    reader_.AddMesh(std::move(directive), std::move(mesh));
  };
  if (type == "sphere") {
    made.strings = {"sphere"};
    number("radius", list.Float("radius", 1, kAboveZero));
    const Vec3 center = list.Point("center", {});
    to_world = to_world * Transform::Translate(static_cast<double>(center.x),
                                               static_cast<double>(center.y),
                                               static_cast<double>(center.z));
  } else if (type == "disk" && has_texture) {
    TriangleMesh mesh = DiskMesh(1, 0, 0, 2 * std::numbers::pi);
    // From the angle and the distance from the rim to those of Mitsuba, whose u is the distance
    // from the centre.
    for (Vec2& uv : mesh.uvs)
      uv = {1 - uv.y, uv.x};
    TurnOver(mesh);
    add_mesh(std::move(made), std::move(mesh));
    return;
  } else if (type == "disk") {
    made.strings = {"disk"};
  } else if (type == "cylinder") {
    made.strings = {"cylinder"};
    const Vec3 from = list.Point("p0", {0, 0, 0});
    const Vec3 to = list.Point("p1", {0, 0, 1});
    double length = 0;
    const std::optional<Transform> along = AlongAxis(from, to, length);
    if (!along.has_value()) {
      list.Error("has no length: p0 and p1 are the same");
      return;
    }
    const double radius = list.Float("radius", 1, kAboveZero);
    to_world = to_world * *along;
    if (has_texture) {
      TriangleMesh mesh = CylinderMesh(radius, 0, length, 2 * std::numbers::pi);
      TurnOver(mesh);
      add_mesh(std::move(made), std::move(mesh));
      return;
    }
    number("radius", radius);
    number("zmin", 0);
    number("zmax", length);
  } else if (type == "rectangle" || type == "cube" || type == "obj" || type == "ply" ||
             type == "serialized") {
    const std::vector<std::string> materials = MaterialsNamedIn(shape);
    std::vector<TriangleMesh> meshes = ReadMeshesOf(shape, list, materials);
    for (std::size_t i = 0; i < meshes.size(); ++i) {
      if (meshes[i].indices.empty() && meshes.size() > 1) continue;
      MadeDirective part = made;
      if (i > 0) {
        const auto named = std::ranges::find_if(shape.children, [&](const MitsubaObject& child) {
          const MitsubaObject* resolved = FindResolved(child);
          return child.called == materials[i - 1] && resolved != nullptr && resolved->tag == "bsdf";
        });
        const std::optional<Surface> surface = SurfaceOf(*FindResolved(*named));
        if (!surface.has_value()) return;
        UseSurface(*surface, shape, part);
      }
      add_mesh(std::move(part), std::move(meshes[i]));
    }
    return;
  } else {
    list.Error(
        "is not supported; there are obj, ply, serialized, sphere, rectangle, cube, disk, "
        "cylinder, shapegroup and instance");
    return;
  }
  SetTransform(to_world, shape);
  // Here as in pbrt-v4 a mirroring transform turns round shapes over that do not emit; in Mitsuba
  // it does not.
  if (to_world.SwapsHandedness() && emitter == nullptr)
    reader_.CarryOut(Directive("ReverseOrientation", shape));
  reader_.CarryOut(std::move(made));
}

void MitsubaTranslator::TranslateGroup(const MitsubaObject& group) {
  const std::string name = NewName(group);
  groups_.emplace(&group, name);
  MadeDirective begin = Directive("ObjectBegin", group);
  begin.strings = {name};
  reader_.CarryOut(std::move(begin));
  for (const MitsubaObject& child : group.children) {
    const MitsubaObject* shape = Resolve(child);
    if (shape == nullptr || shape->tag != "shape") continue;
    if (shape->type == "instance" || shape->type == "shapegroup") {
      diagnostics_.Error(child.location, Concat(SubjectOf(*shape), " must not be in a shapegroup"));
      continue;
    }
    TranslateShape(*shape);
  }
  reader_.CarryOut(Directive("ObjectEnd", group));
}

void MitsubaTranslator::TranslateInstance(const MitsubaObject& instance) {
  const MitsubaObject* group = nullptr;
  for (const MitsubaObject& child : instance.children) {
    const MitsubaObject* resolved = Resolve(child);
    if (resolved != nullptr && resolved->tag == "shape" && resolved->type == "shapegroup")
      group = resolved;
  }
  if (group == nullptr) {
    diagnostics_.Error(instance.location,
                       Concat(SubjectOf(instance), " needs a reference to a shapegroup"));
    return;
  }
  if (!groups_.contains(group)) TranslateGroup(*group);
  reader_.CarryOut(Directive("AttributeBegin", instance));
  SetTransform(ToWorld(instance), instance);
  MadeDirective made = Directive("ObjectInstance", instance);
  made.strings = {groups_.at(group)};
  reader_.CarryOut(std::move(made));
  reader_.CarryOut(Directive("AttributeEnd", instance));
}

void MitsubaTranslator::TranslateShape(const MitsubaObject& shape) {
  if (shape.type == "instance") {
    TranslateInstance(shape);
    return;
  }
  ParameterList list = ListOf(shape);
  MadeDirective made = Directive("Shape", shape);
  reader_.CarryOut(Directive("AttributeBegin", shape));
  const std::string inside = MediumOf(shape, "interior");
  const std::string outside = MediumOf(shape, "exterior");
  const bool has_media = !inside.empty() || !outside.empty();
  if (const auto surface = SurfaceOfShape(shape, has_media); surface.has_value())
    UseSurface(*surface, shape, made);
  if (has_media) {
    MadeDirective interface = Directive("MediumInterface", shape);
    interface.strings = {inside, outside};
    reader_.CarryOut(std::move(interface));
  }
  if (const MitsubaObject* emitter = ChildOf(shape, "emitter")) TranslateAreaEmitter(*emitter);
  if (list.Bool("flip_normals", false)) reader_.CarryOut(Directive("ReverseOrientation", shape));
  AddGeometry(shape, list, std::move(made));
  list.WarnOfUnread();
  RefuseOthers(shape, {"bsdf", "medium", "emitter"});
  reader_.CarryOut(Directive("AttributeEnd", shape));
}

}  // namespace lucerna
