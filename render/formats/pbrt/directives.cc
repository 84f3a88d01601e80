#include "render/formats/pbrt/directives.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"

#include "render/base/text.h"
#include "render/formats/pbrt/rgb_space.h"
#include "render/formats/pbrt/spectrum_files.h"
#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

// 0 of an empty text.
unsigned char BeginOf(std::string_view text) {
  return text.empty() ? 0 : static_cast<unsigned char>(text.front());
}

}  // namespace

std::span<const DirectiveReader::Directive> DirectiveReader::Directives() {
  using P = DirectiveReader;
  static constexpr Directive kDirectives[] = {
      {"Accelerator", &P::OnAccelerator, Phase::kBeforeWorld},
      {"ActiveTransform", &P::OnActiveTransform, Phase::kAnywhere},
      {"AreaLightSource", &P::OnAreaLightSource, Phase::kInWorld},
      {"Attribute", &P::OnAttribute, Phase::kAnywhere},
      {"AttributeBegin", &P::OnAttributeBegin, Phase::kInWorld},
      {"AttributeEnd", &P::OnAttributeEnd, Phase::kInWorld},
      {"Camera", &P::OnCamera, Phase::kBeforeWorld},
      {"ColorSpace", &P::OnColorSpace, Phase::kAnywhere},
      {"ConcatTransform", &P::OnConcatTransform, Phase::kAnywhere},
      {"CoordSysTransform", &P::OnCoordSysTransform, Phase::kAnywhere},
      {"CoordinateSystem", &P::OnCoordinateSystem, Phase::kAnywhere},
      {"Film", &P::OnFilm, Phase::kBeforeWorld},
      {"Identity", &P::OnIdentity, Phase::kAnywhere},
      {"Import", &P::OnImport, Phase::kInWorld},
      {"Include", &P::OnInclude, Phase::kAnywhere},
      {"Integrator", &P::OnIntegrator, Phase::kBeforeWorld},
      {"LightSource", &P::OnLightSource, Phase::kInWorld},
      {"LookAt", &P::OnLookAt, Phase::kAnywhere},
      {"MakeNamedMaterial", &P::OnMakeNamedMaterial, Phase::kInWorld},
      {"MakeNamedMedium", &P::OnMakeNamedMedium, Phase::kAnywhere},
      {"Material", &P::OnMaterial, Phase::kInWorld},
      {"MediumInterface", &P::OnMediumInterface, Phase::kAnywhere},
      {"NamedMaterial", &P::OnNamedMaterial, Phase::kInWorld},
      {"ObjectBegin", &P::OnObjectBegin, Phase::kInWorld},
      {"ObjectEnd", &P::OnObjectEnd, Phase::kInWorld},
      {"ObjectInstance", &P::OnObjectInstance, Phase::kInWorld},
      {"Option", &P::OnOption, Phase::kAnywhere},
      {"PixelFilter", &P::OnPixelFilter, Phase::kBeforeWorld},
      {"ReverseOrientation", &P::OnReverseOrientation, Phase::kInWorld},
      {"Rotate", &P::OnRotate, Phase::kAnywhere},
      {"Sampler", &P::OnSampler, Phase::kBeforeWorld},
      {"Scale", &P::OnScale, Phase::kAnywhere},
      {"Shape", &P::OnShape, Phase::kInWorld},
      {"Texture", &P::OnTexture, Phase::kInWorld},
      {"Transform", &P::OnTransform, Phase::kAnywhere},
      {"TransformBegin", &P::OnTransformBegin, Phase::kInWorld},
      {"TransformEnd", &P::OnTransformEnd, Phase::kInWorld},
      {"TransformTimes", &P::OnTransformTimes, Phase::kBeforeWorld},
      {"Translate", &P::OnTranslate, Phase::kAnywhere},
      {"WorldBegin", &P::OnWorldBegin, Phase::kBeforeWorld},
      // pbrt-v3 and older.
      {"Renderer", &P::OnPbrtV3, Phase::kAnywhere},
      {"SurfaceIntegrator", &P::OnPbrtV3, Phase::kAnywhere},
      {"Volume", &P::OnPbrtV3, Phase::kAnywhere},
      {"VolumeIntegrator", &P::OnPbrtV3, Phase::kAnywhere},
      {"WorldEnd", &P::OnPbrtV3, Phase::kAnywhere},
  };
  return kDirectives;
}

const DirectiveReader::Directive* DirectiveReader::FindDirective(std::string_view name) {
  for (const Directive& directive : Directives()) {
    if (directive.name == name) return &directive;
  }
  return nullptr;
}

bool IsDirective(std::string_view word) {
  return DirectiveReader::FindDirective(word) != nullptr;
}

UnfinishedScene DirectiveReader::Read(const std::string& main_path, std::string_view text) {
  ++texts_read_;
  ReadText(main_path, text, nullptr);
  unfinished_.without_camera =
      "the scene has no Camera: as by pbrt-v4 it is seen from the origin along +z, with a field of "
      "view of 90 degrees";
  return Finish();
}

bool DirectiveReader::CarryOut(MadeDirective made) {
  Arguments arguments(made, diagnostics_);
  return (this->*FindDirective(made.name)->handler)(arguments) && !IsStopped();
}

bool DirectiveReader::AddMesh(MadeDirective made, TriangleMesh mesh) {
  Arguments arguments(made, diagnostics_);
  return AddShape(arguments, std::move(mesh)) && !IsStopped();
}

UnfinishedScene DirectiveReader::Finish() {
  if (IsStopped()) return std::move(unfinished_);
  ReportUnclosedScopes();
  ReportNamedMaterials();
  ReportNamedMedia();
  ReplaceWrittenOut();
  scene_.film.exposure *= scene_.motion.shutter_close - scene_.motion.shutter_open;
  if (!in_world_) unfinished_.missing.emplace_back("the scene has no WorldBegin");
  return std::move(unfinished_);
}

// ---- texts

void DirectiveReader::IncludeFile(const std::string& path, const SourceLocation& location,
                                  Tokenizer* including) {
  const SceneLimits& limits = assets_.limits();
  if (depth_ >= limits.max_include_depth) {
    // What comes next may need what is left out.
    diagnostics_.Error(location, Concat("files include one another more than ",
                                        limits.max_include_depth, " deep"));
    is_stopped_ = true;
    return;
  }
  if (std::ranges::find(open_texts_, path) != open_texts_.end()) {
    diagnostics_.Error(location, Concat("the file ", Quoted(path), " includes itself"));
    return;
  }
  if (++texts_read_ > limits.max_files) {
    diagnostics_.Error(location, Concat("more than ", limits.max_files, " files are included"));
    is_stopped_ = true;
    return;
  }
  const StatusOr<std::string> text = assets_.ReadText(path);
  if (text.ok()) {
    ReadText(path, *text, including);
  } else {
    diagnostics_.Error(location, std::string(text.status().message()));
  }
}

void DirectiveReader::ReadText(const std::string& path, std::string_view text,
                               Tokenizer* including) {
  const std::string* name = diagnostics_.NameOfFile(path);
  // The mark with which some editors begin UTF-8.
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (text.find('\0') != std::string_view::npos) {
    diagnostics_.Error({name, 0, 0}, "this is not a pbrt text file: it holds binary data");
    return;
  }
  Tokenizer tokens(name, text, diagnostics_, including);
  ++depth_;
  open_texts_.push_back(path);
  ReadDirectives(tokens);
  open_texts_.pop_back();
  --depth_;
}

void DirectiveReader::ReadDirectives(Tokenizer& tokens) {
  while (!IsStopped()) {
    const Token token = tokens.Next();
    if (token.kind == Token::Kind::kEnd) return;
    const Directive* directive =
        token.kind == Token::Kind::kWord ? FindDirective(token.text) : nullptr;
    if (directive == nullptr) {
      ReportUnknown(token);
      SkipToDirective(tokens);
      CheckRoom(token.location);
      continue;
    }
    Arguments arguments(directive->name, token.location, tokens, diagnostics_);
    if (directive->phase == Phase::kBeforeWorld && in_world_) {
      arguments.Error(Concat(directive->name, " must come before WorldBegin"));
    } else if (directive->phase == Phase::kInWorld && !in_world_) {
      arguments.Error(Concat(directive->name, " must come after WorldBegin"));
    }
    // Its arguments may have gone on in the text that includes this one.
    if (!(this->*directive->handler)(arguments)) SkipToDirective(arguments.tokens());
    CheckRoom(token.location);
  }
}

void DirectiveReader::CheckRoom(const SourceLocation& location) {
  constexpr std::size_t kMostErrors = 1'000'000;
  if (IsStopped()) return;
  if (diagnostics_.CountOf(Diagnostic::Severity::kError) > kMostErrors) {
    diagnostics_.Error(location,
                       Concat("more than ", kMostErrors, " errors: the rest is not read"));
    is_stopped_ = true;
    return;
  }
  std::size_t bytes =
      densities_bytes_ + scene_.materials.size() * sizeof(Material) +
      scene_.textures.size() * sizeof(Texture) + scene_.media.size() * sizeof(Medium) +
      scene_.area_lights.size() * sizeof(AreaLight) +
      scene_.infinite_lights.size() * sizeof(InfiniteLight) +
      scene_.motion.of_shapes.size() * (sizeof(ShapeMotion) + sizeof(AnimatedTransform));
  ForEachDeltaList(scene_, [&](const auto& lights) {
    if (!lights.empty()) bytes += lights.size() * sizeof(lights.front());
  });
  const std::uint64_t most = assets_.limits().max_shape_bytes;
  if (bytes <= most) return;
  diagnostics_.Error(location, Concat("with this, the materials, media, textures and lights of the "
                                      "scene take more than the ",
                                      most,
                                      " bytes of memory that there are for them; give each "
                                      "once, and refer to it by its name"));
  is_stopped_ = true;
}

void DirectiveReader::ReportUnknown(const Token& token) {
  if (token.kind != Token::Kind::kWord) {
    diagnostics_.Error(token.location, Concat("expected a directive, not ", Quoted(token.text)));
    return;
  }
  std::string_view closest;
  if (!diagnostics_.IsFull(Diagnostic::Severity::kError)) {
    std::vector<std::string_view> names;
    for (const Directive& known : Directives()) {
      if (known.handler != &DirectiveReader::OnPbrtV3) names.push_back(known.name);
    }
    closest = ClosestOf(token.text, names);
  }
  diagnostics_.Error(token.location,
                     Concat("unknown directive ", Quoted(token.text),
                            closest.empty() ? "" : Concat("; did you mean ", closest, "?")));
}

void DirectiveReader::SkipToDirective(Tokenizer& tokens) {
  while (true) {
    const Token& token = tokens.Peek();
    if (token.kind == Token::Kind::kEnd) return;
    // Unknown ones are reported too; they begin with a capital, as no value does.
    if (token.kind == Token::Kind::kWord && absl::ascii_isupper(BeginOf(token.text))) return;
    tokens.Next();
  }
}

void DirectiveReader::ReportUnclosedScopes() {
  for (const GraphicsStack::Scope& scope : graphics_.open_scopes()) {
    diagnostics_.Error(scope.location, Concat(scope.begun_by, " is never closed"));
  }
}

void DirectiveReader::ReportNamedMaterials() {
  std::vector<std::uint8_t> is_mixed(scene_.materials.size());
  for (const Material& material : scene_.materials) {
    for (const std::int32_t part : material.mixed) {
      if (part >= 0) is_mixed[static_cast<std::size_t>(part)] = 1;
    }
  }
  for (const auto& [name, material] : named_materials_) {
    const auto index = static_cast<std::size_t>(material.index);
    const bool is_on_shapes = index < materials_on_shapes_.size() && materials_on_shapes_[index];
    if (!material.is_defined && is_on_shapes) {
      diagnostics_.Error(material.location, Concat("there is no material ", Quoted(name),
                                                   "; define it by MakeNamedMaterial"));
    } else if (!material.is_defined) {
      diagnostics_.Warning(material.location,
                           Concat("there is no material ", Quoted(name), "; no shape has it"));
    } else if (!material.is_used && is_mixed[index] == 0) {
      diagnostics_.Note(material.location, Concat("the material ", Quoted(name), " is not used"));
    }
  }
}

void DirectiveReader::ReportNamedMedia() {
  std::vector<bool> is_used(scene_.media.size(), false);
  const auto use = [&](std::int32_t medium) {
    if (medium != kNoMedium) is_used[static_cast<std::size_t>(medium)] = true;
  };
  use(scene_.camera.medium);
  ForEachDeltaList(scene_, [&](const auto& lights) {
    for (const auto& light : lights)
      use(light.medium);
  });
  ForEachShapeTraits(scene_, [&](const ShapeTraits& traits) {
    use(traits.medium_inside);
    use(traits.medium_outside);
  });
  for (const auto& [name, medium] : named_media_) {
    if (medium.is_defined) continue;
    const std::string message = Concat("there is no medium ", Quoted(name));
    if (is_used[static_cast<std::size_t>(medium.index)]) {
      diagnostics_.Error(medium.location, Concat(message, "; define it by MakeNamedMedium"));
    } else {
      diagnostics_.Warning(medium.location, Concat(message, "; nothing is in it"));
    }
  }
}

// ---- arguments

ParameterList DirectiveReader::ListFor(const Arguments& arguments, std::string_view type,
                                       std::vector<Parameter> parameters,
                                       const GraphicsState::Defaults& defaults) {
  ReadSpectrumFiles(assets_, parameters, diagnostics_);
  ToRec709(parameters, graphics_.state().rgb_space);
  return ParameterList(arguments.SubjectOf(type), arguments.location(), std::move(parameters),
                       defaults.get(), diagnostics_);
}

bool DirectiveReader::RefusePbrtV3(const Arguments& arguments) {
  diagnostics_.OnlyError(arguments.location(),
                         "this is a pbrt-v3 file; convert it with \"pbrt --upgrade\"");
  is_stopped_ = true;
  return true;
}

bool DirectiveReader::OnPbrtV3(Arguments& arguments) {
  return RefusePbrtV3(arguments);
}

// ---- scopes

void DirectiveReader::Begin(Arguments& arguments) {
  const Status begun = graphics_.Begin(arguments.directive(), arguments.location());
  if (begun.ok()) return;
  arguments.Error(std::string(begun.message()));
  is_stopped_ = true;
}

bool DirectiveReader::End(Arguments& arguments, std::string_view begun_by) {
  const Status ended = graphics_.End(arguments.directive(), begun_by);
  if (!ended.ok()) arguments.Error(std::string(ended.message()));
  return ended.ok();
}

void DirectiveReader::EndAttributes(Arguments& arguments, std::string_view begun_by) {
  const std::vector<GraphicsStack::Scope>& open = graphics_.open_scopes();
  if (!open.empty() && open.back().begun_by != "Import") {
    const std::string_view innermost = open.back().begun_by;
    const bool ends_either = innermost == "AttributeBegin" || innermost == "TransformBegin";
    End(arguments, ends_either ? innermost : begun_by);
    return;
  }
  diagnostics_.Warning(arguments.location(), Concat(arguments.directive(), " without ", begun_by,
                                                    " is ignored, as by pbrt-v4"));
}

bool DirectiveReader::OnAttributeBegin(Arguments& arguments) {
  Begin(arguments);
  return true;
}

bool DirectiveReader::OnAttributeEnd(Arguments& arguments) {
  EndAttributes(arguments, "AttributeBegin");
  return true;
}

// pbrt-v4 reads TransformBegin as AttributeBegin, and each may end what the other began.
bool DirectiveReader::OnTransformBegin(Arguments& arguments) {
  Begin(arguments);
  return true;
}

bool DirectiveReader::OnTransformEnd(Arguments& arguments) {
  EndAttributes(arguments, "TransformBegin");
  return true;
}

bool DirectiveReader::OnAttribute(Arguments& arguments) {
  std::string target;
  std::vector<Parameter> parameters;
  if (!arguments.ReadString("a target", target) || !arguments.ReadParameters(parameters))
    return false;
  std::optional<AttributeTarget> known;
  if (target == "shape") known = AttributeTarget::kShape;
  if (target == "light") known = AttributeTarget::kLight;
  if (target == "material") known = AttributeTarget::kMaterial;
  if (target == "texture") known = AttributeTarget::kTexture;
  if (target == "medium") known = AttributeTarget::kMedium;
  if (!known.has_value()) {
    arguments.Error(
        Concat("Attribute takes shape, light, material, medium or texture, not ", Quoted(target)));
    return true;
  }
  ReadSpectrumFiles(assets_, parameters, diagnostics_);
  ToRec709(parameters, graphics_.state().rgb_space);
  // The newest first: of two defaults of one name the later counts.
  auto all = std::make_shared<std::vector<Parameter>>(std::move(parameters));
  GraphicsState::Defaults& defaults = graphics_.state().DefaultsOf(*known);
  if (const GraphicsState::Defaults& older = defaults; older != nullptr) {
    constexpr std::size_t kMaxDefaults = 100;
    if (all->size() + older->size() > kMaxDefaults) {
      arguments.Error(
          Concat("more than ", kMaxDefaults, " parameters by Attribute ", Quoted(target)));
      return true;
    }
    all->insert(all->end(), older->begin(), older->end());
  }
  defaults = std::move(all);
  return true;
}

bool DirectiveReader::OnReverseOrientation(Arguments& /*arguments*/) {
  graphics_.state().reverse_orientation = !graphics_.state().reverse_orientation;
  return true;
}

bool DirectiveReader::OnObjectBegin(Arguments& arguments) {
  std::string name;
  if (!arguments.ReadString("a name", name)) return false;
  if (open_object_ != nullptr) arguments.Error("ObjectBegin within ObjectBegin");
  Begin(arguments);
  const auto [object, is_new] = objects_.try_emplace(name);
  if (!is_new) arguments.Error(Concat("the object ", Quoted(name), " is defined twice"));
  open_object_ = &object->second;
  return true;
}

bool DirectiveReader::OnObjectEnd(Arguments& arguments) {
  if (End(arguments, "ObjectBegin")) open_object_ = nullptr;
  return true;
}

bool DirectiveReader::OnObjectInstance(Arguments& arguments) {
  std::string name;
  if (!arguments.ReadString("a name", name)) return false;
  if (open_object_ != nullptr) {
    arguments.Error("ObjectInstance within ObjectBegin");
    return true;
  }
  const auto object = objects_.find(name);
  if (object == objects_.end()) {
    arguments.Error(
        Concat("there is no object ", Quoted(name), "; define it by ObjectBegin first"));
    return true;
  }
  PlaceInstance(object->second, arguments);
  return true;
}

bool DirectiveReader::OnWorldBegin(Arguments& /*arguments*/) {
  in_world_ = true;
  GraphicsState& state = graphics_.state();
  state.to_world = {};
  state.changes_start = state.changes_end = true;
  coordinate_systems_["world"] = {};
  return true;
}

bool DirectiveReader::OnInclude(Arguments& arguments) {
  std::string path;
  if (!arguments.ReadString("a file name", path)) return false;
  IncludeFile(path, arguments.location(), &arguments.tokens());
  return true;
}

// As Include, but what the file changes of the graphics state ends with it.
bool DirectiveReader::OnImport(Arguments& arguments) {
  std::string path;
  if (!arguments.ReadString("a file name", path)) return false;
  const std::size_t outer_scopes = graphics_.open_scopes().size();
  Begin(arguments);
  IncludeFile(path, arguments.location(), nullptr);
  if (IsStopped()) return true;
  if (graphics_.open_scopes().size() != outer_scopes + 1) {
    arguments.Error(Concat("the scopes of the imported file ", Quoted(path), " are not balanced"));
    is_stopped_ = true;
    return true;
  }
  End(arguments, "Import");
  return true;
}

}  // namespace lucerna
