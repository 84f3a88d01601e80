#include "render/scene/pbrt_parser.h"

#include <algorithm>
#include <array>
#include <cfloat>
#include <charconv>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_join.h"

#include "render/base/text.h"
#include "render/scene/parameter_list.h"
#include "render/scene/ply_file.h"
#include "render/scene/scene_builder.h"
#include "render/scene/scene_extent.h"
#include "render/scene/scene_unit.h"
#include "render/scene/tokenizer.h"

namespace lucerna {
namespace {

// A scene farther than so many times its size from the origin gets a warning. Up to there images
// agree within their noise (docs/numerics.md).
constexpr double kFarSizes = 1e4;
constexpr std::size_t kMaxNesting = 1000;  // AttributeBegin within AttributeBegin

std::optional<double> ParseNumber(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size()) return std::nullopt;
  // Out of range is too large or too small; absl's slower reader says which.
  if (error == std::errc::result_out_of_range && !absl::SimpleAtod(ToAbsl(text), &value)) {
    return std::nullopt;
  }
  if (error != std::errc() && error != std::errc::result_out_of_range) return std::nullopt;
  return value;
}

bool IsNumeric(std::string_view type) {
  return type != "bool" && type != "string" && type != "texture";
}

class PbrtParser {
 public:
  PbrtParser(SceneFiles& files, const SceneLimits& limits) : files_(files), limits_(limits) {}

  ParsedScene Run(const std::string& main_path);

 private:
  // Reads the directive's arguments and does what it says. Returns false when the arguments broke
  // off at something unexpected, which it has reported; the text is then skipped to the next
  // directive.
  using Handler = bool (PbrtParser::*)();
  enum class Phase : std::uint8_t { kAnywhere, kBeforeWorld, kInWorld };
  struct Directive {
    std::string_view name;
    Handler handler;
    Phase phase;
  };

  // What AttributeBegin saves and AttributeEnd restores. Large parts are shared, so that a copy
  // is small however much the text put into them.
  using Defaults = std::shared_ptr<const std::vector<Parameter>>;
  struct GraphicsState {
    Transform to_world;  // before WorldBegin: world to camera, as pbrt writes it
    bool reverse_orientation = false;
    std::int32_t material = 0;
    std::shared_ptr<const AreaEmission> area_emission;
    std::int32_t area_light = kNoAreaLight;  // of an emission without power: the same everywhere
    std::array<Defaults, 4> defaults;        // for kShapeTarget and so on
  };
  enum Target : std::uint8_t { kShapeTarget, kLightTarget, kMaterialTarget, kTextureTarget };
  struct Saved {
    std::string_view begun_by;
    Place place;
    GraphicsState state;
  };
  struct NamedMaterial {
    std::int32_t index = 0;
    Place place;  // where it is first mentioned
    bool is_defined = false;
    bool is_used = false;
  };

  static std::span<const Directive> Directives();
  static const Directive* FindDirective(std::string_view name);

  // Texts.
  void ParseFile(const std::string& path, const Place& place);
  void ParseText();
  void SkipToDirective();
  StatusOr<std::string> ReadCounted(const std::string& path);
  StatusOr<TriangleMesh> ReadMesh(const std::string& path);
  StatusOr<std::shared_ptr<const Picture>> ReadImage(const std::string& path,
                                                     const PixelEncoding& encoding);
  PictureReader ImageReader() {
    return [this](const std::string& file, const PixelEncoding& encoding) {
      return ReadImage(file, encoding);
    };
  }

  // Arguments.
  bool ReadNumbers(std::span<double> numbers);
  bool ReadString(std::string_view what, std::string& out);
  bool ReadParameters(std::vector<Parameter>& parameters);
  bool ReadParameter(std::vector<Parameter>& parameters);
  bool ReadValue(Parameter& parameter, bool is_known_type);
  // The type in quotes that follows the directive, then its parameters.
  bool ReadTyped(std::string& type, std::vector<Parameter>& parameters);
  ParameterList ListFor(std::string_view type, std::vector<Parameter> parameters,
                        const Defaults& defaults = nullptr);
  void Error(std::string message) { diagnostics_.Error(place_, std::move(message)); }
  bool RefusePbrtV3();

  // Transforms.
  bool Concatenate(const StatusOr<Transform>& transform);
  bool Replace(const Transform& transform);
  bool ReadMatrix(Transform& transform);
  bool DoIdentity();
  bool DoTranslate();
  bool DoScale();
  bool DoRotate();
  bool DoLookAt();
  bool DoTransform();
  bool DoConcatTransform();
  bool DoCoordinateSystem();
  bool DoCoordSysTransform();
  bool DoActiveTransform();
  bool DoTransformTimes();

  // Scopes.
  void Begin();
  bool End(std::string_view begun_by);
  bool DoAttributeBegin();
  bool DoAttributeEnd();
  bool DoTransformBegin();
  bool DoTransformEnd();
  bool DoAttribute();
  bool DoReverseOrientation();
  bool DoObjectBegin();
  bool DoObjectEnd();
  bool DoObjectInstance();
  bool DoWorldBegin();
  bool DoInclude();
  bool DoImport();

  // The parts of a scene.
  bool DoCamera();
  bool DoFilm();
  bool DoPixelFilter();
  bool DoSampler();
  bool DoIntegrator();
  bool DoAccelerator();
  bool DoColorSpace();
  bool DoOption();
  bool DoMaterial();
  bool DoMakeNamedMaterial();
  bool DoNamedMaterial();
  bool DoAreaLightSource();
  bool DoLightSource();
  bool DoShape();
  void WarnOfNoArea(const Place& place, const std::string& subject);
  bool DoTexture();
  bool DoMediumInterface();
  bool DoMakeNamedMedium();
  bool DoPbrtV3();

  NamedMaterial& Named(const std::string& name);
  void AddShapes(ShapeSet shapes);
  void Finish();

  SceneFiles& files_;
  const SceneLimits limits_;
  Diagnostics diagnostics_;
  Scene scene_;
  std::set<std::string> file_names_;  // what Place::file points to
  const std::string* main_name_ = nullptr;

  // The text being read, and the directive being read in it.
  Tokenizer* tokens_ = nullptr;
  std::string_view directive_;
  Place place_;
  int depth_ = 0;
  bool is_stopped_ = false;

  // What was spent of the limits. Every reading counts, also of a file that was read before.
  std::uint64_t texts_read_ = 0;
  std::uint64_t bytes_read_ = 0;
  std::uint64_t shapes_cost_ = 0;
  std::uint64_t picture_bytes_ = 0;

  GraphicsState state_;
  std::vector<Saved> saved_;
  bool in_world_ = false;
  bool has_camera_ = false;
  double exposure_time_s_ = 1;
  std::map<std::string, Transform> coordinate_systems_;
  std::map<std::string, NamedMaterial> named_materials_;
  TextureNames textures_;
  std::set<std::string> float_textures_;
  struct KnownPicture {
    PixelEncoding encoding;
    std::shared_ptr<const Picture> picture;
  };
  std::multimap<std::string, KnownPicture> pictures_;  // by path: each is in memory once
  std::map<std::string, ShapeSet> objects_;
  ShapeSet* open_object_ = nullptr;  // between ObjectBegin and ObjectEnd
  // Meshes that emit, which may turn out to have no area in single precision.
  struct EmittingMesh {
    std::size_t mesh;  // index in the scene
    Place place;
    std::string subject;
  };
  std::vector<EmittingMesh> emitting_meshes_;
};

std::span<const PbrtParser::Directive> PbrtParser::Directives() {
  using P = PbrtParser;
  static constexpr Directive kDirectives[] = {
      {"Accelerator", &P::DoAccelerator, Phase::kBeforeWorld},
      {"ActiveTransform", &P::DoActiveTransform, Phase::kAnywhere},
      {"AreaLightSource", &P::DoAreaLightSource, Phase::kInWorld},
      {"Attribute", &P::DoAttribute, Phase::kAnywhere},
      {"AttributeBegin", &P::DoAttributeBegin, Phase::kInWorld},
      {"AttributeEnd", &P::DoAttributeEnd, Phase::kInWorld},
      {"Camera", &P::DoCamera, Phase::kBeforeWorld},
      {"ColorSpace", &P::DoColorSpace, Phase::kAnywhere},
      {"ConcatTransform", &P::DoConcatTransform, Phase::kAnywhere},
      {"CoordSysTransform", &P::DoCoordSysTransform, Phase::kAnywhere},
      {"CoordinateSystem", &P::DoCoordinateSystem, Phase::kAnywhere},
      {"Film", &P::DoFilm, Phase::kBeforeWorld},
      {"Identity", &P::DoIdentity, Phase::kAnywhere},
      {"Import", &P::DoImport, Phase::kInWorld},
      {"Include", &P::DoInclude, Phase::kAnywhere},
      {"Integrator", &P::DoIntegrator, Phase::kBeforeWorld},
      {"LightSource", &P::DoLightSource, Phase::kInWorld},
      {"LookAt", &P::DoLookAt, Phase::kAnywhere},
      {"MakeNamedMaterial", &P::DoMakeNamedMaterial, Phase::kInWorld},
      {"MakeNamedMedium", &P::DoMakeNamedMedium, Phase::kAnywhere},
      {"Material", &P::DoMaterial, Phase::kInWorld},
      {"MediumInterface", &P::DoMediumInterface, Phase::kAnywhere},
      {"NamedMaterial", &P::DoNamedMaterial, Phase::kInWorld},
      {"ObjectBegin", &P::DoObjectBegin, Phase::kInWorld},
      {"ObjectEnd", &P::DoObjectEnd, Phase::kInWorld},
      {"ObjectInstance", &P::DoObjectInstance, Phase::kInWorld},
      {"Option", &P::DoOption, Phase::kAnywhere},
      {"PixelFilter", &P::DoPixelFilter, Phase::kBeforeWorld},
      {"ReverseOrientation", &P::DoReverseOrientation, Phase::kInWorld},
      {"Rotate", &P::DoRotate, Phase::kAnywhere},
      {"Sampler", &P::DoSampler, Phase::kBeforeWorld},
      {"Scale", &P::DoScale, Phase::kAnywhere},
      {"Shape", &P::DoShape, Phase::kInWorld},
      {"Texture", &P::DoTexture, Phase::kInWorld},
      {"Transform", &P::DoTransform, Phase::kAnywhere},
      {"TransformBegin", &P::DoTransformBegin, Phase::kInWorld},
      {"TransformEnd", &P::DoTransformEnd, Phase::kInWorld},
      {"TransformTimes", &P::DoTransformTimes, Phase::kAnywhere},
      {"Translate", &P::DoTranslate, Phase::kAnywhere},
      {"WorldBegin", &P::DoWorldBegin, Phase::kBeforeWorld},
      // pbrt-v3 and older.
      {"Renderer", &P::DoPbrtV3, Phase::kAnywhere},
      {"SurfaceIntegrator", &P::DoPbrtV3, Phase::kAnywhere},
      {"Volume", &P::DoPbrtV3, Phase::kAnywhere},
      {"VolumeIntegrator", &P::DoPbrtV3, Phase::kAnywhere},
      {"WorldEnd", &P::DoPbrtV3, Phase::kAnywhere},
  };
  return kDirectives;
}

const PbrtParser::Directive* PbrtParser::FindDirective(std::string_view name) {
  for (const Directive& directive : Directives()) {
    if (directive.name == name) return &directive;
  }
  return nullptr;
}

ParsedScene PbrtParser::Run(const std::string& main_path) {
  main_name_ = &*file_names_.insert(main_path).first;
  scene_.materials.push_back(Material());  // of shapes that name none
  ParseFile(main_path, {main_name_, 0, 0});
  if (!is_stopped_) Finish();
  return {std::move(scene_), diagnostics_.Take()};
}

// ---- texts

StatusOr<std::string> PbrtParser::ReadCounted(const std::string& path) {
  std::string normal_path = path;
  while (normal_path.starts_with("./"))
    normal_path.erase(0, 2);
  LUCERNA_ASSIGN_OR_RETURN(std::string bytes, files_.Read(normal_path));
  bytes_read_ += bytes.size();
  if (bytes_read_ > limits_.max_total_bytes) {
    is_stopped_ = true;
    return absl::ResourceExhaustedError(
        Concat("the scene reads more than ", limits_.max_total_bytes, " bytes"));
  }
  return bytes;
}

StatusOr<TriangleMesh> PbrtParser::ReadMesh(const std::string& path) {
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, ReadCounted(path));
  StatusOr<TriangleMesh> mesh = ParsePly(bytes);
  if (mesh.ok()) return mesh;
  return absl::InvalidArgumentError(Concat(path, ": ", mesh.status().message()));
}

StatusOr<std::shared_ptr<const Picture>> PbrtParser::ReadImage(const std::string& path,
                                                               const PixelEncoding& encoding) {
  const auto [first, last] = pictures_.equal_range(path);
  for (auto known = first; known != last; ++known) {
    if (known->second.encoding == encoding) return known->second.picture;
  }
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, ReadCounted(path));
  StatusOr<Picture> picture =
      ReadPicture(bytes, path, encoding, limits_.max_picture_bytes - picture_bytes_);
  if (!picture.ok()) {
    return Status(picture.status().code(), Concat(path, ": ", picture.status().message()));
  }
  picture_bytes_ += SizeBytes(*picture);
  auto shared = std::make_shared<const Picture>(*std::move(picture));
  pictures_.emplace(path, KnownPicture{encoding, shared});
  return shared;
}

void PbrtParser::ParseFile(const std::string& path, const Place& place) {
  if (depth_ >= limits_.max_include_depth) {
    diagnostics_.Error(
        place, Concat("files include one another more than ", limits_.max_include_depth, " deep"));
    return;
  }
  if (++texts_read_ > limits_.max_files) {
    diagnostics_.Error(place, Concat("more than ", limits_.max_files, " files are included"));
    is_stopped_ = true;
    return;
  }
  const StatusOr<std::string> text = ReadCounted(path);
  if (!text.ok()) {
    diagnostics_.Error(place, std::string(text.status().message()));
    return;
  }
  const std::string* name = &*file_names_.insert(path).first;
  if (text->find('\0') != std::string::npos) {
    diagnostics_.Error({name, 0, 0}, "this is not a pbrt text file: it holds binary data");
    return;
  }
  Tokenizer tokens(name, *text, diagnostics_);
  Tokenizer* const outer_tokens = std::exchange(tokens_, &tokens);
  const Place outer_place = place_;
  ++depth_;
  ParseText();
  --depth_;
  tokens_ = outer_tokens;
  place_ = outer_place;
}

void PbrtParser::ParseText() {
  while (!is_stopped_) {
    const Token token = tokens_->Next();
    if (token.kind == Token::Kind::kEnd) return;
    place_ = token.place;
    const Directive* directive =
        token.kind == Token::Kind::kWord ? FindDirective(token.text) : nullptr;
    if (directive == nullptr) {
      if (token.kind == Token::Kind::kWord) {
        std::string_view closest;
        if (!diagnostics_.IsFull(Diagnostic::Severity::kError)) {
          std::vector<std::string_view> names;
          for (const Directive& known : Directives()) {
            if (known.handler != &PbrtParser::DoPbrtV3) names.push_back(known.name);
          }
          closest = ClosestOf(token.text, names);
        }
        Error(Concat("unknown directive ", Quoted(token.text),
                     closest.empty() ? "" : Concat("; did you mean ", closest, "?")));
      } else {
        Error(Concat("expected a directive, not ", Quoted(token.text)));
      }
      SkipToDirective();
      continue;
    }
    directive_ = directive->name;
    if (directive->phase == Phase::kBeforeWorld && in_world_) {
      Error(Concat(directive_, " must come before WorldBegin"));
    } else if (directive->phase == Phase::kInWorld && !in_world_) {
      Error(Concat(directive_, " must come after WorldBegin"));
    }
    if (!(this->*directive->handler)()) SkipToDirective();
  }
}

void PbrtParser::SkipToDirective() {
  while (true) {
    const Token& token = tokens_->Peek();
    if (token.kind == Token::Kind::kEnd) return;
    if (token.kind == Token::Kind::kWord && FindDirective(token.text) != nullptr) return;
    tokens_->Next();
  }
}

// ---- arguments

bool PbrtParser::ReadNumbers(std::span<double> numbers) {
  const bool has_brackets = tokens_->Peek().kind == Token::Kind::kOpen;
  if (has_brackets) tokens_->Next();
  for (double& number : numbers) {
    const Token& token = tokens_->Peek();
    const std::optional<double> value =
        token.kind == Token::Kind::kWord ? ParseNumber(token.text) : std::nullopt;
    if (!value.has_value() || !std::isfinite(*value)) {
      diagnostics_.Error(token.place, Concat(directive_, " takes ", numbers.size(),
                                             " finite numbers, not ", Quoted(token.text)));
      return false;
    }
    number = *value;
    tokens_->Next();
  }
  if (!has_brackets) return true;
  const Token& token = tokens_->Peek();
  if (token.kind == Token::Kind::kClose) {
    tokens_->Next();
    return true;
  }
  diagnostics_.Error(token.place, Concat(directive_, " takes ", numbers.size(),
                                         " numbers; expected ], not ", Quoted(token.text)));
  return false;
}

bool PbrtParser::ReadString(std::string_view what, std::string& out) {
  const Token& token = tokens_->Peek();
  if (token.kind != Token::Kind::kString) {
    diagnostics_.Error(token.place,
                       Concat(directive_, " takes ", what, " in quotes, not ", Quoted(token.text)));
    return false;
  }
  out = std::string(token.text);
  tokens_->Next();
  return true;
}

bool PbrtParser::ReadParameters(std::vector<Parameter>& parameters) {
  while (tokens_->Peek().kind == Token::Kind::kString) {
    if (!ReadParameter(parameters)) return false;
  }
  return true;
}

bool PbrtParser::ReadParameter(std::vector<Parameter>& parameters) {
  const Token declaration = tokens_->Next();
  const std::vector<std::string_view> words = WordsOf(declaration.text);
  if (words.size() != 2) {
    diagnostics_.Error(declaration.place, Concat("expected a parameter as \"type name\", not ",
                                                 Quoted(declaration.text)));
    return false;
  }
  Parameter parameter;
  parameter.place = declaration.place;
  parameter.type = std::string(words[0]);
  parameter.name = std::string(words[1]);
  const std::vector<std::string_view>& types = KnownParameterTypes();
  const bool is_known_type = std::find(types.begin(), types.end(), parameter.type) != types.end();
  if (!is_known_type) {
    diagnostics_.Error(parameter.place, Concat("unknown parameter type ", Quoted(parameter.type),
                                               "; there are ", Listed(types)));
  }
  if (tokens_->Peek().kind != Token::Kind::kOpen) {
    if (!ReadValue(parameter, is_known_type)) return false;
  } else {
    const Place open = tokens_->Next().place;
    while (tokens_->Peek().kind != Token::Kind::kClose) {
      const Token& token = tokens_->Peek();
      const bool is_next_directive =
          token.kind == Token::Kind::kWord && FindDirective(token.text) != nullptr;
      if (token.kind == Token::Kind::kEnd || token.kind == Token::Kind::kOpen ||
          is_next_directive) {
        diagnostics_.Error(open,
                           Concat("the values of ", Quoted(parameter.name), " have no closing ]"));
        return false;
      }
      if (!ReadValue(parameter, is_known_type)) return false;
    }
    tokens_->Next();
  }
  if (is_known_type) parameters.push_back(std::move(parameter));
  return true;
}

bool PbrtParser::ReadValue(Parameter& parameter, bool is_known_type) {
  const Token token = tokens_->Peek();
  const auto unexpected = [&](std::string_view wanted) {
    diagnostics_.Error(token.place, Concat(Quoted(parameter.name), " of ", directive_, " takes ",
                                           wanted, ", not ", Quoted(token.text)));
    // A wrong word among values is one mistake; what follows it may still be right.
    const bool is_value = token.kind == Token::Kind::kWord || token.kind == Token::Kind::kString;
    if (!is_value || FindDirective(token.text) != nullptr) return false;
    tokens_->Next();
    // It is counted as a value, so that its absence is not a second error.
    if (parameter.type == "bool") {
      parameter.bools.push_back(false);
    } else if (IsNumeric(parameter.type)) {
      parameter.numbers.push_back(0);
    } else {
      parameter.strings.emplace_back();
    }
    return true;
  };
  if (!is_known_type) {
    if (token.kind != Token::Kind::kWord && token.kind != Token::Kind::kString) return false;
    tokens_->Next();
    return true;
  }
  const bool takes_string =
      parameter.type == "string" || parameter.type == "texture" || parameter.type == "spectrum";
  if (token.kind == Token::Kind::kString && takes_string) {
    parameter.strings.emplace_back(token.text);
  } else if (parameter.type == "bool") {
    // pbrt-v4 still reads the quoted form of older files.
    const bool is_word = token.kind == Token::Kind::kWord || token.kind == Token::Kind::kString;
    if (!is_word || (token.text != "true" && token.text != "false")) {
      return unexpected("true or false");
    }
    parameter.bools.push_back(token.text == "true");
  } else if (IsNumeric(parameter.type)) {
    const std::optional<double> value =
        token.kind == Token::Kind::kWord ? ParseNumber(token.text) : std::nullopt;
    if (!value.has_value()) return unexpected(takes_string ? "numbers or a name" : "numbers");
    if (!(std::abs(*value) <= 3.4e38)) return unexpected("finite numbers below 3.4e38");
    if (parameter.type == "integer" &&
        (*value != std::floor(*value) || std::abs(*value) > 2147483648.0)) {
      return unexpected("whole numbers of 32 bits");
    }
    parameter.numbers.push_back(*value);
  } else {
    return unexpected("text in quotes");
  }
  tokens_->Next();
  return true;
}

bool PbrtParser::ReadTyped(std::string& type, std::vector<Parameter>& parameters) {
  return ReadString("a type", type) && ReadParameters(parameters);
}

ParameterList PbrtParser::ListFor(std::string_view type, std::vector<Parameter> parameters,
                                  const Defaults& defaults) {
  return ParameterList(Concat(directive_, " ", Quoted(type)), place_, std::move(parameters),
                       defaults.get(), diagnostics_);
}

bool PbrtParser::RefusePbrtV3() {
  diagnostics_.OnlyError(place_, "this is a pbrt-v3 file; convert it with \"pbrt --upgrade\"");
  is_stopped_ = true;
  return true;
}

bool PbrtParser::DoPbrtV3() {
  return RefusePbrtV3();
}

// ---- transforms

bool PbrtParser::Replace(const Transform& transform) {
  if (transform.IsFinite() && transform.Inverse().ok()) {
    state_.to_world = transform;
  } else {
    Error(Concat(directive_, " makes a transform that cannot be inverted"));
  }
  return true;
}

bool PbrtParser::Concatenate(const StatusOr<Transform>& transform) {
  if (transform.ok()) return Replace(state_.to_world * *transform);
  Error(std::string(transform.status().message()));
  return true;
}

bool PbrtParser::DoIdentity() {
  return Replace(Transform());
}

bool PbrtParser::DoTranslate() {
  std::array<double, 3> v{};
  return ReadNumbers(v) && Concatenate(Transform::Translate(v[0], v[1], v[2]));
}

bool PbrtParser::DoScale() {
  std::array<double, 3> v{};
  return ReadNumbers(v) && Concatenate(Transform::Scale(v[0], v[1], v[2]));
}

bool PbrtParser::DoRotate() {
  std::array<double, 4> v{};
  return ReadNumbers(v) && Concatenate(Transform::Rotate(v[0], v[1], v[2], v[3]));
}

bool PbrtParser::DoLookAt() {
  std::array<double, 9> v{};
  return ReadNumbers(v) &&
         Concatenate(Transform::LookAt({v[0], v[1], v[2]}, {v[3], v[4], v[5]}, {v[6], v[7], v[8]}));
}

bool PbrtParser::ReadMatrix(Transform& transform) {
  std::array<double, 16> v{};
  if (!ReadNumbers(v)) return false;
  std::array<std::array<double, 4>, 4> rows{};
  for (std::size_t i = 0; i < 16; ++i)
    rows[i % 4][i / 4] = v[i];  // column by column
  if (rows[3] != std::array<double, 4>{0, 0, 0, 1}) {
    Error(Concat(directive_, " must be affine: its 4th, 8th, 12th and 16th numbers are 0, ",
                 "0, 0 and 1"));
    return true;
  }
  transform = Transform(rows);
  return true;
}

bool PbrtParser::DoTransform() {
  Transform transform = state_.to_world;
  return ReadMatrix(transform) && Replace(transform);
}

bool PbrtParser::DoConcatTransform() {
  Transform transform;
  return ReadMatrix(transform) && Concatenate(transform);
}

bool PbrtParser::DoCoordinateSystem() {
  std::string name;
  if (!ReadString("a name", name)) return false;
  coordinate_systems_[name] = state_.to_world;
  return true;
}

bool PbrtParser::DoCoordSysTransform() {
  std::string name;
  if (!ReadString("a name", name)) return false;
  const auto system = coordinate_systems_.find(name);
  if (system == coordinate_systems_.end()) {
    Error(Concat("there is no coordinate system ", Quoted(name)));
    return true;
  }
  return Replace(system->second);
}

bool PbrtParser::DoActiveTransform() {
  const Token token = tokens_->Peek();
  if (token.kind != Token::Kind::kWord ||
      (token.text != "All" && token.text != "StartTime" && token.text != "EndTime")) {
    Error("ActiveTransform takes StartTime, EndTime or All");
    return false;
  }
  if (token.text != "All") Error("motion blur is not supported (ActiveTransform)");
  tokens_->Next();
  return true;
}

bool PbrtParser::DoTransformTimes() {
  std::array<double, 2> v{};
  Error("motion blur is not supported (TransformTimes)");
  return ReadNumbers(v);
}

// ---- scopes

void PbrtParser::Begin() {
  if (saved_.size() >= kMaxNesting) {
    Error(Concat("scopes are nested more than ", kMaxNesting, " deep"));
    is_stopped_ = true;
    return;
  }
  saved_.push_back({directive_, place_, state_});
}

bool PbrtParser::End(std::string_view begun_by) {
  if (saved_.empty() || saved_.back().begun_by != begun_by) {
    Error(saved_.empty()
              ? Concat(directive_, " without ", begun_by)
              : Concat(directive_, " where the ", saved_.back().begun_by, " of ",
                       *saved_.back().place.file, ":", saved_.back().place.line, " is still open"));
    return false;
  }
  state_ = std::move(saved_.back().state);
  saved_.pop_back();
  return true;
}

bool PbrtParser::DoAttributeBegin() {
  Begin();
  return true;
}

bool PbrtParser::DoAttributeEnd() {
  End("AttributeBegin");
  return true;
}

// pbrt-v4 reads TransformBegin as AttributeBegin.
bool PbrtParser::DoTransformBegin() {
  Begin();
  return true;
}

bool PbrtParser::DoTransformEnd() {
  End("TransformBegin");
  return true;
}

bool PbrtParser::DoAttribute() {
  std::string target;
  std::vector<Parameter> parameters;
  if (!ReadString("a target", target) || !ReadParameters(parameters)) return false;
  std::optional<Target> known;
  if (target == "shape") known = kShapeTarget;
  if (target == "light") known = kLightTarget;
  if (target == "material") known = kMaterialTarget;
  if (target == "texture") known = kTextureTarget;
  if (!known.has_value()) {
    if (target != "medium") {
      Error(Concat("Attribute takes shape, light, material, medium or texture, not ",
                   Quoted(target)));
    }
    return true;  // media are refused where they are made
  }
  // The newest first: of two defaults of one name the later counts.
  auto all = std::make_shared<std::vector<Parameter>>(std::move(parameters));
  if (const Defaults& older = state_.defaults[*known]; older != nullptr) {
    constexpr std::size_t kMaxDefaults = 100;
    if (all->size() + older->size() > kMaxDefaults) {
      Error(Concat("more than ", kMaxDefaults, " parameters by Attribute ", Quoted(target)));
      return true;
    }
    all->insert(all->end(), older->begin(), older->end());
  }
  state_.defaults[*known] = std::move(all);
  return true;
}

bool PbrtParser::DoReverseOrientation() {
  state_.reverse_orientation = !state_.reverse_orientation;
  return true;
}

bool PbrtParser::DoObjectBegin() {
  std::string name;
  if (!ReadString("a name", name)) return false;
  if (open_object_ != nullptr) Error("ObjectBegin within ObjectBegin");
  Begin();
  const auto [object, is_new] = objects_.try_emplace(name);
  if (!is_new) Error(Concat("the object ", Quoted(name), " is defined twice"));
  open_object_ = &object->second;
  return true;
}

bool PbrtParser::DoObjectEnd() {
  if (End("ObjectBegin")) open_object_ = nullptr;
  return true;
}

bool PbrtParser::DoObjectInstance() {
  std::string name;
  if (!ReadString("a name", name)) return false;
  if (open_object_ != nullptr) {
    Error("ObjectInstance within ObjectBegin");
    return true;
  }
  const auto object = objects_.find(name);
  if (object == objects_.end()) {
    Error(Concat("there is no object ", Quoted(name), "; define it by ObjectBegin first"));
    return true;
  }
  // Before it is laid out, because that is what takes the memory.
  if (object->second.Cost() > limits_.max_triangles - shapes_cost_) {
    Error(Concat("the scene has more than ", limits_.max_triangles, " triangles"));
    is_stopped_ = true;
    return true;
  }
  StatusOr<ShapeSet> shapes = Instantiate(object->second, state_.to_world);
  if (!shapes.ok()) {
    Error(std::string(shapes.status().message()));
    return true;
  }
  AddShapes(*std::move(shapes));
  return true;
}

bool PbrtParser::DoWorldBegin() {
  in_world_ = true;
  state_.to_world = Transform();
  coordinate_systems_["world"] = Transform();
  return true;
}

bool PbrtParser::DoInclude() {
  std::string path;
  if (!ReadString("a file name", path)) return false;
  ParseFile(path, place_);
  return true;
}

// As Include, but what the file changes of the graphics state ends with it.
bool PbrtParser::DoImport() {
  std::string path;
  if (!ReadString("a file name", path)) return false;
  directive_ = "Import";
  const std::size_t outer_scopes = saved_.size();
  Begin();
  ParseFile(path, place_);
  if (is_stopped_) return true;
  directive_ = "Import";
  if (saved_.size() != outer_scopes + 1) {
    Error(Concat("the scopes of the imported file ", Quoted(path), " are not balanced"));
    is_stopped_ = true;
    return true;
  }
  End("Import");
  return true;
}

// ---- the parts of a scene

bool PbrtParser::DoCamera() {
  std::string type;
  std::vector<Parameter> parameters;
  if (!ReadTyped(type, parameters)) return false;
  if (has_camera_) Error("the scene has a second camera");
  has_camera_ = true;
  ParameterList list = ListFor(type, std::move(parameters));
  ReadCamera(type, list, scene_.camera, exposure_time_s_);
  // Replace() lets only invertible transforms pass.
  scene_.camera.camera_to_world = state_.to_world.Inverse().value();
  coordinate_systems_["camera"] = scene_.camera.camera_to_world;
  return true;
}

bool PbrtParser::DoFilm() {
  std::string type;
  std::vector<Parameter> parameters;
  if (!ReadTyped(type, parameters)) return false;
  if (type == "image") return RefusePbrtV3();
  ParameterList list = ListFor(type, std::move(parameters));
  ReadFilm(type, list, scene_.film);
  return true;
}

bool PbrtParser::DoPixelFilter() {
  std::string type;
  std::vector<Parameter> parameters;
  if (!ReadTyped(type, parameters)) return false;
  ParameterList list = ListFor(type, std::move(parameters));
  ReadPixelFilter(type, list, scene_.filter);
  return true;
}

bool PbrtParser::DoSampler() {
  std::string type;
  std::vector<Parameter> parameters;
  if (!ReadTyped(type, parameters)) return false;
  ParameterList list = ListFor(type, std::move(parameters));
  ReadSampler(type, list, scene_.integrator);
  return true;
}

bool PbrtParser::DoIntegrator() {
  std::string type;
  std::vector<Parameter> parameters;
  if (!ReadTyped(type, parameters)) return false;
  ParameterList list = ListFor(type, std::move(parameters));
  ReadIntegrator(type, list, scene_.integrator);
  return true;
}

bool PbrtParser::DoAccelerator() {
  std::string type;
  std::vector<Parameter> parameters;
  if (!ReadTyped(type, parameters)) return false;
  diagnostics_.Note(place_, Concat("Accelerator ", Quoted(type), " is ignored"));
  return true;
}

bool PbrtParser::DoColorSpace() {
  std::string name;
  if (!ReadString("a name", name)) return false;
  if (name != "srgb") {
    diagnostics_.Warning(
        place_, Concat("ColorSpace ", Quoted(name), " is not supported; colours are read as srgb"));
  }
  return true;
}

bool PbrtParser::DoOption() {
  std::vector<Parameter> parameters;
  if (!ReadParameters(parameters)) return false;
  for (const Parameter& parameter : parameters) {
    diagnostics_.Note(parameter.place, Concat("Option ", Quoted(parameter.name), " is ignored"));
  }
  return true;
}

bool PbrtParser::DoMaterial() {
  std::string type;
  std::vector<Parameter> parameters;
  if (!ReadTyped(type, parameters)) return false;
  if (IsPbrtV3Material(type)) return RefusePbrtV3();
  ParameterList list = ListFor(type, std::move(parameters), state_.defaults[kMaterialTarget]);
  state_.material = static_cast<std::int32_t>(scene_.materials.size());
  scene_.materials.push_back(MakeMaterial(type, list, textures_));
  return true;
}

PbrtParser::NamedMaterial& PbrtParser::Named(const std::string& name) {
  const auto [material, is_new] = named_materials_.try_emplace(name);
  if (is_new) {
    material->second.index = static_cast<std::int32_t>(scene_.materials.size());
    material->second.place = place_;
    scene_.materials.push_back(Material());
  }
  return material->second;
}

bool PbrtParser::DoMakeNamedMaterial() {
  std::string name;
  std::vector<Parameter> parameters;
  if (!ReadString("a name", name) || !ReadParameters(parameters)) return false;
  ParameterList list = ListFor(name, std::move(parameters), state_.defaults[kMaterialTarget]);
  const std::optional<std::string> type = list.FindString("type");
  if (type.has_value() && IsPbrtV3Material(*type)) return RefusePbrtV3();
  NamedMaterial& named = Named(name);
  if (named.is_defined) Error(Concat("the material ", Quoted(name), " is defined twice"));
  named.is_defined = true;
  if (!type.has_value()) {
    if (!list.Has("type")) list.Error("needs \"string type\"");
    return true;
  }
  Material material;
  if (*type == "diffuse" || *type == "conductor" || *type == "dielectric") {
    material = MakeMaterial(*type, list, textures_);
  } else {
    // Names the type, which the subject of the list does not.
    ParameterList unsupported(Concat("the type ", Quoted(*type), " of ", list.subject()), place_,
                              {}, nullptr, diagnostics_);
    material = MakeMaterial(*type, unsupported, textures_);
  }
  material.name = name;
  scene_.materials[static_cast<std::size_t>(named.index)] = std::move(material);
  return true;
}

bool PbrtParser::DoNamedMaterial() {
  std::string name;
  if (!ReadString("a name", name)) return false;
  NamedMaterial& named = Named(name);  // may be defined later
  if (!std::exchange(named.is_used, true)) named.place = place_;
  state_.material = named.index;
  return true;
}

bool PbrtParser::DoAreaLightSource() {
  std::string type;
  std::vector<Parameter> parameters;
  if (!ReadTyped(type, parameters)) return false;
  ParameterList list = ListFor(type, std::move(parameters), state_.defaults[kLightTarget]);
  const AreaEmission emission = MakeAreaEmission(type, list);
  state_.area_light = kNoAreaLight;
  state_.area_emission.reset();
  if (IsBlack(emission.radiance)) {
    if (type == "diffuse") {
      list.Warning("", "emits nothing, its L or scale is 0: its shapes are no lights");
    }
    return true;
  }
  if (!emission.power_w.has_value()) {
    state_.area_light = static_cast<std::int32_t>(scene_.area_lights.size());
    scene_.area_lights.push_back(MakeAreaLight(emission, 1));
  }
  state_.area_emission = std::make_shared<const AreaEmission>(emission);
  return true;
}

bool PbrtParser::DoLightSource() {
  std::string type;
  std::vector<Parameter> parameters;
  if (!ReadTyped(type, parameters)) return false;
  ParameterList list = ListFor(type, std::move(parameters), state_.defaults[kLightTarget]);
  AddLight(type, list, state_.to_world, ImageReader(), scene_);
  return true;
}

void PbrtParser::WarnOfNoArea(const Place& place, const std::string& subject) {
  diagnostics_.Warning(place, Concat(subject, " has no area: it emits no light"));
}

bool PbrtParser::DoShape() {
  std::string type;
  std::vector<Parameter> parameters;
  if (!ReadTyped(type, parameters)) return false;
  ParameterList list = ListFor(type, std::move(parameters), state_.defaults[kShapeTarget]);
  ShapePlacement placement = {
      state_.to_world, state_.reverse_orientation, {state_.material, state_.area_light}};
  if (state_.area_emission != nullptr && open_object_ != nullptr) {
    list.Error("emits light inside an object, which is not supported; move it out of ObjectBegin");
    placement.traits.area_light = kNoAreaLight;
  }
  const Place place = place_;
  const bool is_light = state_.area_emission != nullptr && open_object_ == nullptr;
  ShapeSet shapes =
      MakeShapes(type, list, placement, [this](const std::string& file) { return ReadMesh(file); });
  if (shapes.Cost() > limits_.max_triangles - shapes_cost_) {
    diagnostics_.Error(place,
                       Concat("the scene has more than ", limits_.max_triangles, " triangles"));
    is_stopped_ = true;
    return true;
  }
  if (is_light && !diagnostics_.has_error() && !(shapes.Area() > 0))
    WarnOfNoArea(place, list.subject());
  if (is_light) {
    for (std::size_t i = 0; i < shapes.meshes.size(); ++i) {
      if (shapes.meshes[i].indices.empty()) continue;
      emitting_meshes_.push_back({scene_.meshes.size() + i, place, list.subject()});
    }
  }
  if (is_light && state_.area_emission->power_w.has_value() && shapes.Cost() > 0) {
    if (!shapes.meshes.empty() && shapes.meshes[0].indices.size() > 3) {
      list.Warning("", "gets its power as a whole; pbrt-v4 gives it to each triangle");
    }
    const AreaLight light = MakeAreaLight(*state_.area_emission, shapes.Area());
    if (!IsFinite(light.radiance)) list.Error("is too small for its power");
    const auto index = static_cast<std::int32_t>(scene_.area_lights.size());
    scene_.area_lights.push_back(light);
    for (TriangleMesh& mesh : shapes.meshes)
      mesh.traits.area_light = index;
    for (Sphere& sphere : shapes.spheres)
      sphere.traits.area_light = index;
    for (Disk& disk : shapes.disks)
      disk.traits.area_light = index;
  }
  AddShapes(std::move(shapes));
  return true;
}

void PbrtParser::AddShapes(ShapeSet shapes) {
  shapes_cost_ += shapes.Cost();
  const auto append = [](auto& to, auto& from) {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  };
  append(open_object_ != nullptr ? open_object_->meshes : scene_.meshes, shapes.meshes);
  append(open_object_ != nullptr ? open_object_->spheres : scene_.spheres, shapes.spheres);
  append(open_object_ != nullptr ? open_object_->disks : scene_.disks, shapes.disks);
}

bool PbrtParser::DoTexture() {
  std::string name;
  std::string kind;
  std::string type;
  std::vector<Parameter> parameters;
  if (!ReadString("a name", name) || !ReadString("a kind", kind) || !ReadString("a type", type) ||
      !ReadParameters(parameters)) {
    return false;
  }
  if (kind == "float") {
    // Nothing here takes one: a parameter that refers to it is refused, whatever it is.
    if (!float_textures_.insert(name).second) {
      Error(Concat("the float texture ", Quoted(name), " is defined twice"));
    }
    return true;
  }
  if (kind == "color") return RefusePbrtV3();
  if (kind != "spectrum") {
    Error(Concat("Texture ", Quoted(name), " must be of spectrum or float, not ", Quoted(kind)));
    return true;
  }
  if (textures_.contains(name)) {
    Error(Concat("the texture ", Quoted(name), " is defined twice"));
    return true;
  }
  ParameterList list(Concat("Texture ", Quoted(name)), place_, std::move(parameters),
                     state_.defaults[kTextureTarget].get(), diagnostics_);
  // Made first: a texture may not be a part of itself.
  NamedTexture made = MakeTexture(type, list, textures_, ImageReader(), scene_.textures);
  textures_.emplace(name, std::move(made));
  return true;
}

bool PbrtParser::DoMediumInterface() {
  std::string inside;
  std::string outside;
  if (!ReadString("a name", inside)) return false;
  if (tokens_->Peek().kind == Token::Kind::kString && !ReadString("a name", outside)) return false;
  if (!inside.empty() || !outside.empty()) {
    Error("participating media are not supported (MediumInterface)");
  }
  return true;
}

bool PbrtParser::DoMakeNamedMedium() {
  std::string name;
  std::vector<Parameter> parameters;
  if (!ReadString("a name", name) || !ReadParameters(parameters)) return false;
  Error(Concat("participating media are not supported (MakeNamedMedium ", Quoted(name), ")"));
  return true;
}

void PbrtParser::Finish() {
  const Place whole = {main_name_, 0, 0};
  for (const Saved& saved : saved_) {
    diagnostics_.Error(saved.place, Concat(saved.begun_by, " is never closed"));
  }
  for (const auto& [name, material] : named_materials_) {
    if (!material.is_defined) {
      diagnostics_.Error(material.place, Concat("there is no material ", Quoted(name),
                                                "; define it by MakeNamedMaterial"));
    } else if (!material.is_used) {
      diagnostics_.Note(material.place, Concat("the material ", Quoted(name), " is not used"));
    }
  }
  scene_.film.exposure *= exposure_time_s_;
  // After another error, what is missing may only have been skipped.
  if (diagnostics_.has_error()) return;
  for (const TriangleMesh& mesh : scene_.meshes) {
    const Material& material = scene_.materials[static_cast<std::size_t>(mesh.traits.material)];
    if (mesh.uvs.empty() && material.texture != kNoTexture) {
      diagnostics_.Warning(whole,
                           "a mesh with a texture has no uv: every triangle shows half of it");
    }
  }
  const SceneExtent extent = ExtentOf(scene_);
  if (extent.size > 0 && extent.from_origin > kFarSizes * extent.size) {
    const double sizes = extent.from_origin / extent.size;
    diagnostics_.Warning(
        whole, Concat("the scene lies ", std::round(sizes),
                      " times its own size from the origin, where single precision keeps 1/",
                      std::round(std::max(1.0, 0x1p24 / sizes)), " of that size; move it nearer"));
  }
  if (!in_world_) diagnostics_.Error(whole, "the scene has no WorldBegin");
  if (!has_camera_) diagnostics_.Error(whole, "the scene has no camera");
  if (scene_.meshes.empty() && scene_.spheres.empty() && scene_.disks.empty()) {
    diagnostics_.Warning(whole, "the scene has no shapes");
  }
  if (scene_.area_lights.empty() && scene_.point_lights.empty() && scene_.spot_lights.empty() &&
      scene_.distant_lights.empty() && scene_.infinite_lights.empty()) {
    diagnostics_.Warning(whole, "the scene has no light: the image will be black");
  }
  if (const Status chosen = ChooseUnit(scene_); !chosen.ok()) {
    diagnostics_.Error(whole, std::string(chosen.message()));
  }
  std::size_t dropped = 0;
  for (TriangleMesh& mesh : scene_.meshes)
    dropped += DropTriangles(mesh, FLT_MIN);
  for (const EmittingMesh& light : emitting_meshes_) {
    if (scene_.meshes[light.mesh].indices.empty()) WarnOfNoArea(light.place, light.subject);
  }
  std::erase_if(scene_.meshes, [](const TriangleMesh& mesh) { return mesh.indices.empty(); });
  if (dropped > 0) {
    diagnostics_.Note(whole, Concat(dropped, dropped == 1 ? " triangle has" : " triangles have",
                                    " no area in single precision and are dropped"));
  }
}

}  // namespace

bool ParsedScene::ok() const {
  return std::none_of(diagnostics.begin(), diagnostics.end(), [](const Diagnostic& diagnostic) {
    return diagnostic.severity == Diagnostic::Severity::kError;
  });
}

Status ParsedScene::ToStatus() const {
  std::vector<std::string> errors;
  for (const Diagnostic& diagnostic : diagnostics) {
    if (diagnostic.severity == Diagnostic::Severity::kError)
      errors.push_back(diagnostic.ToString());
  }
  if (errors.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrJoin(errors, "\n"));
}

ParsedScene ParsePbrt(SceneFiles& files, const std::string& main_path, const SceneLimits& limits) {
  return PbrtParser(files, limits).Run(main_path);
}

}  // namespace lucerna
