#include <cstdint>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "render/base/text.h"
#include "render/formats/pbrt/directives.h"
#include "render/formats/pbrt/lights.h"
#include "render/formats/pbrt/materials.h"
#include "render/formats/pbrt/media.h"
#include "render/formats/pbrt/rgb_space.h"
#include "render/formats/pbrt/settings.h"
#include "render/formats/pbrt/spectrum_files.h"
#include "render/scene/density_grid.h"
#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

// Whether no ray meets any of them.
bool IsInvisible(const ShapeSet& shapes) {
  bool is_seen = false;
  ForEachShapeTraits(shapes,
                     [&](const ShapeTraits& traits) { is_seen = is_seen || traits.alpha > 0; });
  return !is_seen;
}

// An emitter of alpha 0 emits without being seen, as in pbrt-v4; one below 0 emits nothing there.
bool IsBelowZero(const ShapeSet& shapes) {
  bool is_below = false;
  ForEachShapeTraits(shapes,
                     [&](const ShapeTraits& traits) { is_below = is_below || traits.alpha < 0; });
  return is_below;
}

// Whether it is hair, or mixes it. Each material is looked at once: mixes of mixes double.
bool IsOfHair(const std::vector<Material>& materials, std::int32_t index) {
  std::vector<std::int32_t> open = {index};
  std::set<std::int32_t> seen = {-1};
  while (!open.empty()) {
    const std::int32_t next = open.back();
    open.pop_back();
    if (!seen.insert(next).second) continue;
    const Material& material = materials[static_cast<std::size_t>(next)];
    if (material.kind == Material::Kind::kHair) return true;
    open.insert(open.end(), material.mixed.begin(), material.mixed.end());
  }
  return false;
}

bool IsTubesAlone(const ShapeSet& shapes) {
  bool is_tubes = shapes.meshes.empty();
  ForEachAnalyticShape(shapes, [&](const auto& shape) { is_tubes = is_tubes && shape.kIsThin; });
  return is_tubes;
}

}  // namespace

bool DirectiveReader::OnCamera(Arguments& arguments) {
  std::string type;
  std::vector<Parameter> parameters;
  if (!arguments.ReadTyped(type, parameters)) return false;
  ParameterList list = ListFor(arguments, type, std::move(parameters));
  if (unfinished_.has_camera) list.Warning("", "takes the place of the camera before it");
  unfinished_.has_camera = true;
  scene_.camera = {};
  scene_.motion.of_camera.reset();
  CheckAffine(arguments);
  ReadCamera(type, list, scene_.camera, scene_.motion);
  const TransformPair& from_world = graphics_.state().to_world;
  const StatusOr<Transform> at_start = from_world.start.Inverse();
  const StatusOr<Transform> at_end = from_world.end.Inverse();
  if (!at_start.ok() || !at_end.ok()) {
    arguments.Error("the camera's transform cannot be inverted");
    return true;
  }
  const TransformPair camera_to_world = {*at_start, *at_end};
  scene_.camera.camera_to_world = camera_to_world.start;
  if (from_world.Moves()) scene_.motion.of_camera = Animated(camera_to_world, arguments);
  coordinate_systems_["camera"] = camera_to_world;
  scene_.camera.medium = graphics_.state().medium_outside;
  return true;
}

bool DirectiveReader::OnFilm(Arguments& arguments) {
  std::string type;
  std::vector<Parameter> parameters;
  if (!arguments.ReadTyped(type, parameters)) return false;
  if (type == "image") return RefusePbrtV3(arguments);
  ParameterList list = ListFor(arguments, type, std::move(parameters));
  ReadFilm(type, list, scene_.film);
  return true;
}

bool DirectiveReader::OnPixelFilter(Arguments& arguments) {
  std::string type;
  std::vector<Parameter> parameters;
  if (!arguments.ReadTyped(type, parameters)) return false;
  ParameterList list = ListFor(arguments, type, std::move(parameters));
  ReadPixelFilter(type, list, scene_.filter);
  return true;
}

bool DirectiveReader::OnSampler(Arguments& arguments) {
  std::string type;
  std::vector<Parameter> parameters;
  if (!arguments.ReadTyped(type, parameters)) return false;
  ParameterList list = ListFor(arguments, type, std::move(parameters));
  ReadSampler(type, list, scene_.integrator);
  return true;
}

bool DirectiveReader::OnIntegrator(Arguments& arguments) {
  std::string type;
  std::vector<Parameter> parameters;
  if (!arguments.ReadTyped(type, parameters)) return false;
  ParameterList list = ListFor(arguments, type, std::move(parameters));
  ReadIntegrator(type, list, scene_.integrator);
  return true;
}

bool DirectiveReader::OnAccelerator(Arguments& arguments) {
  std::string type;
  std::vector<Parameter> parameters;
  if (!arguments.ReadTyped(type, parameters)) return false;
  diagnostics_.Note(arguments.location(), Concat("Accelerator ", Quoted(type), " is ignored"));
  return true;
}

bool DirectiveReader::OnColorSpace(Arguments& arguments) {
  std::string name;
  if (!arguments.ReadString("a name", name)) return false;
  const RgbSpace* const space = FindRgbSpace(name);
  if (space == nullptr) {
    diagnostics_.Warning(arguments.location(),
                         Concat("there is no colour space ", Quoted(name),
                                ", ColorSpace is ignored; ", RgbSpaceNames()));
    return true;
  }
  graphics_.state().rgb_space = space;
  return true;
}

bool DirectiveReader::OnOption(Arguments& arguments) {
  const auto ignore = [&](const SourceLocation& location, std::string_view name, bool is_true) {
    std::string message = Concat("Option ", Quoted(name), " is ignored");
    if (name == "forcediffuse" && is_true) {
      diagnostics_.Warning(location, Concat(message, ": materials are as the file has them"));
    } else {
      diagnostics_.Note(location, std::move(message));
    }
  };
  // pbrt-v4 writes a name and a value; some files have parameters with a type.
  const Token& first = arguments.tokens().Peek();
  if (first.kind == Token::Kind::kString && first.text.find(' ') == std::string_view::npos) {
    const SourceLocation location = first.location;
    std::string name;
    if (!arguments.ReadString("a name", name)) return false;
    const Token value = arguments.tokens().Next();
    if (value.kind == Token::Kind::kEnd) {
      diagnostics_.Error(location, Concat("Option ", Quoted(name), " has no value"));
      return true;
    }
    ignore(location, name, value.text == "true");
    return true;
  }
  std::vector<Parameter> parameters;
  if (!arguments.ReadParameters(parameters)) return false;
  for (const Parameter& parameter : parameters)
    ignore(parameter.location, parameter.name, parameter.bools == std::vector<bool>{true});
  return true;
}

MaterialSources DirectiveReader::MaterialSourcesHere() {
  return {textures_, defined_materials_, scene_.materials, assets_, scene_.textures};
}

bool DirectiveReader::OnMaterial(Arguments& arguments) {
  std::string type;
  std::vector<Parameter> parameters;
  if (!arguments.ReadTyped(type, parameters)) return false;
  if (IsPbrtV3Material(type)) return RefusePbrtV3(arguments);
  ParameterList list = ListFor(arguments, type, std::move(parameters),
                               graphics_.state().DefaultsOf(AttributeTarget::kMaterial));
  graphics_.state().material = static_cast<std::int32_t>(scene_.materials.size());
  scene_.materials.push_back(ReadMaterial(type, list, MaterialSourcesHere()));
  return true;
}

DirectiveReader::NamedMaterial& DirectiveReader::Named(const std::string& name,
                                                       const SourceLocation& location) {
  const auto [material, is_new] = named_materials_.try_emplace(name);
  if (is_new) {
    material->second.index = static_cast<std::int32_t>(scene_.materials.size());
    material->second.location = location;
    scene_.materials.push_back(Material());
  }
  return material->second;
}

bool DirectiveReader::MayDependOnPlace(std::int32_t material) const {
  const bool is_yet_to_come = std::ranges::any_of(named_materials_, [&](const auto& named) {
    return named.second.index == material && !named.second.is_defined;
  });
  return is_yet_to_come || scene_.materials[static_cast<std::size_t>(material)].DependsOnPlace();
}

bool DirectiveReader::OnMakeNamedMaterial(Arguments& arguments) {
  std::string name;
  std::vector<Parameter> parameters;
  if (!arguments.ReadString("a name", name) || !arguments.ReadParameters(parameters)) return false;
  ParameterList list = ListFor(arguments, name, std::move(parameters),
                               graphics_.state().DefaultsOf(AttributeTarget::kMaterial));
  const std::optional<std::string> type = list.FindString("type");
  if (type.has_value() && IsPbrtV3Material(*type)) return RefusePbrtV3(arguments);
  NamedMaterial& named = Named(name, arguments.location());
  if (named.is_defined) arguments.Error(Concat("the material ", Quoted(name), " is defined twice"));
  named.is_defined = true;
  if (!type.has_value()) {
    if (!list.Has("type")) list.Error("needs \"string type\"");
    return true;
  }
  Material material;
  if (IsSupportedMaterial(*type)) {
    material = ReadMaterial(*type, list, MaterialSourcesHere());
  } else {
    // Names the type, which the subject of the list does not.
    ParameterList unsupported(Concat("the type ", Quoted(*type), " of ", list.subject()),
                              arguments.location(), {}, nullptr, diagnostics_);
    material = ReadMaterial(*type, unsupported, MaterialSourcesHere());
  }
  material.name = name;
  scene_.materials[static_cast<std::size_t>(named.index)] = std::move(material);
  defined_materials_.emplace(name, named.index);
  return true;
}

bool DirectiveReader::OnNamedMaterial(Arguments& arguments) {
  std::string name;
  if (!arguments.ReadString("a name", name)) return false;
  NamedMaterial& named = Named(name, arguments.location());  // may be defined later
  if (!std::exchange(named.is_used, true)) named.location = arguments.location();
  graphics_.state().material = named.index;
  return true;
}

bool DirectiveReader::OnAreaLightSource(Arguments& arguments) {
  std::string type;
  std::vector<Parameter> parameters;
  if (!arguments.ReadTyped(type, parameters)) return false;
  ParameterList list = ListFor(arguments, type, std::move(parameters),
                               graphics_.state().DefaultsOf(AttributeTarget::kLight));
  GraphicsState& state = graphics_.state();
  state.area_light = kNoAreaLight;
  state.area_emission.reset();
  if (type.empty()) return true;  // switches it off
  const std::optional<AreaEmission> emission = ReadAreaEmission(type, list, assets_);
  if (!emission.has_value()) return true;
  if (IsBlack(emission->radiance)) {
    list.Warning("", "emits nothing, its L, picture or scale is 0: its shapes are no lights");
    return true;
  }
  if (!emission->power_w.has_value()) {
    state.area_light = static_cast<std::int32_t>(scene_.area_lights.size());
    scene_.area_lights.push_back(MakeAreaLight(*emission, 1));
  }
  state.area_emission = std::make_shared<const AreaEmission>(*emission);
  return true;
}

bool DirectiveReader::OnLightSource(Arguments& arguments) {
  std::string type;
  std::vector<Parameter> parameters;
  if (!arguments.ReadTyped(type, parameters)) return false;
  ParameterList list = ListFor(arguments, type, std::move(parameters),
                               graphics_.state().DefaultsOf(AttributeTarget::kLight));
  std::vector<std::size_t> before;
  ForEachDeltaList(scene_, [&](const auto& lights) { before.push_back(lights.size()); });
  WarnIfMoved(arguments, "lights do not move, in pbrt-v4 neither");
  const TransformPair& places = graphics_.state().to_world;
  if (type != "infinite" || HasTranslation(places)) {
    CheckAffine(arguments);
  } else if (places.is_projective) {
    list.Warning("", "has a transform that is not affine, of which it takes the upper three rows");
  }
  ReadLight(type, list, graphics_.state().to_world.start, assets_, scene_);
  auto first = before.begin();
  ForEachDeltaList(scene_, [&](auto& lights) {
    for (std::size_t i = *first++; i < lights.size(); ++i)
      lights[i].medium = graphics_.state().medium_outside;
  });
  return true;
}

bool DirectiveReader::OnShape(Arguments& arguments) {
  return AddShape(arguments, std::nullopt);
}

bool DirectiveReader::AddShape(Arguments& arguments, std::optional<TriangleMesh> mesh) {
  std::string type;
  std::vector<Parameter> parameters;
  if (!arguments.ReadTyped(type, parameters)) return false;
  GraphicsState& state = graphics_.state();
  CheckAffine(arguments);
  const auto material = static_cast<std::size_t>(state.material);
  if (material >= materials_on_shapes_.size()) materials_on_shapes_.resize(material + 1);
  materials_on_shapes_[material] = true;
  ParameterList list =
      ListFor(arguments, type, std::move(parameters), state.DefaultsOf(AttributeTarget::kShape));
  ShapePlacement placement = {
      state.to_world.start,
      state.reverse_orientation,
      {state.material, state.area_light, state.medium_inside, state.medium_outside}};
  const bool emits = state.area_emission != nullptr;
  if (emits && open_object_ != nullptr) {
    list.Warning("", "is part of an object and emits no light, as in pbrt-v4");
    placement.traits.area_light = kNoAreaLight;
  }
  const bool is_light = emits && open_object_ == nullptr;
  placement.emits = is_light;
  placement.may_show_uv =
      MayDependOnPlace(state.material) || (is_light && state.area_emission->picture != nullptr);
  if (is_light) {
    WarnIfMoved(arguments, "shapes that emit do not move, and pbrt-v4 refuses them");
  } else {
    placement.traits.motion = MotionHere(arguments);
    placement.stays_similar = !state.to_world.Moves() || state.to_world.end.UniformScale().ok();
  }
  ShapeSet shapes =
      mesh.has_value()
          ? PlaceMadeMesh(*std::move(mesh), list, placement, textures_.numbers)
          : ReadShapes(type, list, placement, {textures_.numbers, scene_.textures}, assets_);
  if (IsOfHair(scene_.materials, state.material) && !IsTubesAlone(shapes)) {
    list.Error("has the material hair, which is for curves of type flat or cylinder alone");
  }
  if (is_light && IsBelowZero(shapes)) {
    list.Warning("alpha", "is below 0 everywhere: it emits no light");
    return true;
  }
  if (!is_light && IsInvisible(shapes)) return true;  // no ray meets it, and nothing comes from it
  if (!HasRoomFor(shapes, arguments)) return true;
  if (is_light && !diagnostics_.has_error() && !(shapes.Area() > 0))
    WarnOfLightWithoutArea(arguments.location(), list.subject(), diagnostics_);
  if (is_light) {
    for (std::size_t i = 0; i < shapes.meshes.size(); ++i) {
      if (shapes.meshes[i].indices.empty()) continue;
      unfinished_.emitting_meshes.push_back(
          {scene_.meshes.size() + i, arguments.location(), list.subject()});
    }
  }
  if (is_light && state.area_emission->power_w.has_value() && shapes.Cost() > 0) {
    if (shapes.parts > 1) {
      const std::string_view part =
          type == "bilinearmesh" ? "patch" : (type == "plymesh" ? "face" : "triangle");
      list.Warning("", Concat("gets its power as a whole; pbrt-v4 gives it to each ", part));
    }
    const AreaLight light = MakeAreaLight(*state.area_emission, shapes.Area());
    if (!IsFinite(light.Largest())) list.Error("is too small for its power");
    const auto index = static_cast<std::int32_t>(scene_.area_lights.size());
    scene_.area_lights.push_back(light);
    ForEachShapeTraits(shapes, [&](ShapeTraits& traits) { traits.area_light = index; });
  }
  const std::int32_t source = SourceAt(arguments.location());
  ForEachShapeTraits(shapes, [&](ShapeTraits& traits) { traits.source = source; });
  AddShapes(std::move(shapes));
  return true;
}

std::int32_t DirectiveReader::SourceAt(const SourceLocation& location) {
  if (location.file == nullptr || location.line <= 0) return kNoSource;
  const auto [file, is_new] = source_files_.try_emplace(
      location.file, static_cast<std::uint32_t>(scene_.source_files.size()));
  if (is_new) scene_.source_files.push_back(*location.file);
  scene_.sources.push_back({file->second, static_cast<std::uint32_t>(location.line)});
  return static_cast<std::int32_t>(scene_.sources.size() - 1);
}

bool DirectiveReader::HasRoomFor(const ShapeSet& shapes, Arguments& arguments) {
  const std::uint64_t most = assets_.limits().max_triangles;
  const std::uint64_t most_bytes = assets_.limits().max_shape_bytes;
  if (shapes.Cost() > most - shapes_cost_) {
    arguments.Error(Concat("the scene has more than ", most, " triangles"));
  } else if (shapes.SizeBytes() > most_bytes - shapes_bytes_) {
    arguments.Error(Concat("with this, the shapes of the scene take more than the ", most_bytes,
                           " bytes of memory that there are for them; repeat meshes less often, or "
                           "give meshes with fewer vertices"));
  } else {
    return true;
  }
  is_stopped_ = true;
  return false;
}

void DirectiveReader::AddShapes(ShapeSet shapes) {
  shapes_cost_ += shapes.Cost();
  shapes_bytes_ += shapes.SizeBytes();
  const auto append = [](auto& to, auto& from) {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  };
  if (open_object_ != nullptr) {
    for (const TriangleMesh& mesh : shapes.meshes)
      open_object_->triangles += mesh.indices.size() / 3;
    ForEachShapeTraits(shapes, [&](const ShapeTraits& traits) {
      if (traits.motion != kNoMotion) open_object_->has_moving_parts = true;
    });
  }
  append(open_object_ != nullptr ? open_object_->shapes.meshes : scene_.meshes, shapes.meshes);
#define LUCERNA_APPEND(Name, list, name) \
  append(open_object_ != nullptr ? open_object_->shapes.list : scene_.list, shapes.list);
  LUCERNA_ANALYTIC_SHAPES(LUCERNA_APPEND)
#undef LUCERNA_APPEND
}

bool DirectiveReader::OnTexture(Arguments& arguments) {
  std::string name;
  std::string kind;
  std::string type;
  std::vector<Parameter> parameters;
  if (!arguments.ReadString("a name", name) || !arguments.ReadString("a kind", kind) ||
      !arguments.ReadString("a type", type) || !arguments.ReadParameters(parameters)) {
    return false;
  }
  if (kind == "color") return RefusePbrtV3(arguments);
  const bool is_number = kind == "float";
  if (!is_number && kind != "spectrum") {
    arguments.Error(
        Concat("Texture ", Quoted(name), " must be of spectrum or float, not ", Quoted(kind)));
    return true;
  }
  TextureNames& names = is_number ? textures_.numbers : textures_.colors;
  if (names.contains(name)) {
    arguments.Error(Concat("the ", is_number ? "float texture " : "texture ", Quoted(name),
                           " is defined twice"));
    return true;
  }
  ReadSpectrumFiles(assets_, parameters, diagnostics_);
  ToRec709(parameters, graphics_.state().rgb_space);
  ParameterList list(arguments.SubjectOf(name), arguments.location(), std::move(parameters),
                     graphics_.state().DefaultsOf(AttributeTarget::kTexture).get(), diagnostics_);
  WarnIfMoved(arguments, "textures do not move, in pbrt-v4 neither");
  CheckAffine(arguments);
  // Made first: a texture may not be a part of itself.
  NamedTexture made = ReadTexture(type, is_number, list, textures_,
                                  graphics_.state().to_world.start, assets_, scene_.textures);
  names.emplace(name, std::move(made));
  return true;
}

DirectiveReader::NamedMedium& DirectiveReader::MediumCalled(const std::string& name,
                                                            const SourceLocation& location) {
  const auto [medium, is_new] = named_media_.try_emplace(name);
  if (is_new) {
    medium->second.index = static_cast<std::int32_t>(scene_.media.size());
    medium->second.location = location;
    scene_.media.emplace_back().name = name;
  }
  return medium->second;
}

bool DirectiveReader::OnMediumInterface(Arguments& arguments) {
  std::string inside;
  std::string outside;
  if (!arguments.ReadString("a name", inside)) return false;
  // One name is that of both sides.
  if (!arguments.HasString()) {
    outside = inside;
  } else if (!arguments.ReadString("a name", outside)) {
    return false;
  }
  // May be defined later.
  const auto number_of = [&](const std::string& name) {
    return name.empty() ? kNoMedium : MediumCalled(name, arguments.location()).index;
  };
  graphics_.state().medium_inside = number_of(inside);
  graphics_.state().medium_outside = number_of(outside);
  return true;
}

bool DirectiveReader::OnMakeNamedMedium(Arguments& arguments) {
  std::string name;
  std::vector<Parameter> parameters;
  if (!arguments.ReadString("a name", name) || !arguments.ReadParameters(parameters)) return false;
  ParameterList list = ListFor(arguments, name, std::move(parameters),
                               graphics_.state().DefaultsOf(AttributeTarget::kMedium));
  NamedMedium& named = MediumCalled(name, arguments.location());
  if (named.is_defined) arguments.Error(Concat("the medium ", Quoted(name), " is defined twice"));
  named.is_defined = true;
  CheckAffine(arguments);
  Medium medium = ReadMedium(list, graphics_.state().to_world.start, cloud_points_left_);
  medium.name = name;
  if (medium.density != nullptr) densities_bytes_ += medium.density->bytes();
  scene_.media[static_cast<std::size_t>(named.index)] = std::move(medium);
  return true;
}

}  // namespace lucerna
