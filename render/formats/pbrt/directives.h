// Carries out the directives of pbrt texts, one after the other.
//
// One table says which directives there are and where each may stand. Each has a function of its
// own, which reads its arguments and changes the graphics state or the scene; what a shape, light,
// material, texture or camera of some type is read from is in the files of these names.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/status.h"
#include "render/formats/asset_reader.h"
#include "render/formats/diagnostic.h"
#include "render/formats/finish_scene.h"
#include "render/formats/pbrt/arguments.h"
#include "render/formats/pbrt/graphics_state.h"
#include "render/formats/pbrt/materials.h"
#include "render/formats/pbrt/media.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/formats/pbrt/shapes.h"
#include "render/formats/pbrt/textures.h"
#include "render/formats/pbrt/tokenizer.h"
#include "render/math/transform.h"
#include "render/scene/scene.h"

namespace lucerna {

[[nodiscard]] bool IsDirective(std::string_view word);

class DirectiveReader {
 public:
  // Both outlive the reader.
  DirectiveReader(AssetReader& assets, Diagnostics& diagnostics)
      : assets_(assets), diagnostics_(diagnostics) {
    scene_.materials.emplace_back();  // of shapes that name none
  }

  // Call it once.
  [[nodiscard]] UnfinishedScene Read(const std::string& main_path, std::string_view text);

  // For formats that are translated into directives, in place of Read: any number of directives,
  // where a text may have them, then Finish. False when nothing more is to be read.
  bool CarryOut(MadeDirective made);
  // Shape "trianglemesh" with this mesh, whose indices are sound.
  bool AddMesh(MadeDirective made, TriangleMesh mesh);
  [[nodiscard]] UnfinishedScene Finish();
  [[nodiscard]] Scene& scene() { return scene_; }

 private:
  // Reads the directive's arguments and carries it out. Returns false when the arguments broke off
  // at something unexpected, which is reported; the text is then skipped to the next directive.
  using Handler = bool (DirectiveReader::*)(Arguments& arguments);
  enum class Phase : std::uint8_t { kAnywhere, kBeforeWorld, kInWorld };
  struct Directive {
    std::string_view name;
    Handler handler;
    Phase phase;
  };
  friend bool IsDirective(std::string_view word);
  static std::span<const Directive> Directives();
  static const Directive* FindDirective(std::string_view name);

  // Texts (directives.cc).
  // `including` (may be null): the text whose parameters may go on where the file ends.
  void IncludeFile(const std::string& path, const SourceLocation& location, Tokenizer* including);
  void ReadText(const std::string& path, std::string_view text, Tokenizer* including);
  void ReadDirectives(Tokenizer& tokens);
  // Stops where the text brings more than may be in memory, or more errors than anybody reads.
  void CheckRoom(const SourceLocation& location);
  void ReportUnknown(const Token& token);
  static void SkipToDirective(Tokenizer& tokens);
  [[nodiscard]] bool IsStopped() const { return is_stopped_ || assets_.is_over_limit(); }
  void ReportUnclosedScopes();
  void ReportNamedMaterials();
  void ReportNamedMedia();

  // Arguments.
  ParameterList ListFor(const Arguments& arguments, std::string_view type,
                        std::vector<Parameter> parameters,
                        const GraphicsState::Defaults& defaults = nullptr);
  bool RefusePbrtV3(const Arguments& arguments);

  // Transforms (transform_directives.cc).
  bool Concatenate(Arguments& arguments, const StatusOr<Transform>& transform,
                   bool is_projective = false);
  bool Replace(Arguments& arguments, const Transform& transform, bool is_projective = false);
  bool Replace(Arguments& arguments, const TransformPair& transforms);
  bool ReadMatrix(Arguments& arguments, Transform& transform, bool& is_projective);
  // False, and reported, where the current transforms are not affine.
  bool CheckAffine(Arguments& arguments);
  bool OnIdentity(Arguments& arguments);
  bool OnTranslate(Arguments& arguments);
  bool OnScale(Arguments& arguments);
  bool OnRotate(Arguments& arguments);
  bool OnLookAt(Arguments& arguments);
  bool OnTransform(Arguments& arguments);
  bool OnConcatTransform(Arguments& arguments);
  bool OnCoordinateSystem(Arguments& arguments);
  bool OnCoordSysTransform(Arguments& arguments);
  bool OnActiveTransform(Arguments& arguments);
  bool OnTransformTimes(Arguments& arguments);

  // Motion (motion_directives.cc).
  // Reports what is wrong.
  std::optional<AnimatedTransform> Animated(const TransformPair& transforms, Arguments& arguments);
  // Of shapes at the current transforms; kNoMotion where these do not move.
  std::int32_t MotionHere(Arguments& arguments);
  // Of a shape of an object that moves as `within` in the object's space, where the current
  // transforms put an instance.
  std::int32_t MotionOfInstance(std::int32_t within, Arguments& arguments);
  // Of what pbrt-v4 does not move.
  void WarnIfMoved(const Arguments& arguments, std::string_view what);

  // Scopes (directives.cc).
  void Begin(Arguments& arguments);
  bool End(Arguments& arguments, std::string_view begun_by);
  // The same; with a warning where nothing has begun within this file.
  void EndAttributes(Arguments& arguments, std::string_view begun_by);
  bool OnAttributeBegin(Arguments& arguments);
  bool OnAttributeEnd(Arguments& arguments);
  bool OnTransformBegin(Arguments& arguments);
  bool OnTransformEnd(Arguments& arguments);
  bool OnAttribute(Arguments& arguments);
  bool OnReverseOrientation(Arguments& arguments);
  bool OnObjectBegin(Arguments& arguments);
  bool OnObjectEnd(Arguments& arguments);
  bool OnObjectInstance(Arguments& arguments);
  bool OnWorldBegin(Arguments& arguments);
  bool OnInclude(Arguments& arguments);
  bool OnImport(Arguments& arguments);
  bool OnPbrtV3(Arguments& arguments);

  // The parts of a scene (scene_directives.cc).
  struct NamedMaterial {
    std::int32_t index = 0;
    SourceLocation location;  // where it is first mentioned
    bool is_defined = false;
    bool is_used = false;
  };
  // Whether it is another one at each place of a surface, or not defined yet.
  [[nodiscard]] bool MayDependOnPlace(std::int32_t material) const;
  NamedMaterial& Named(const std::string& name, const SourceLocation& location);
  MaterialSources MaterialSourcesHere();
  struct NamedMedium {
    std::int32_t index = kNoMedium;
    SourceLocation location;  // where it is first mentioned
    bool is_defined = false;
  };
  NamedMedium& MediumCalled(const std::string& name, const SourceLocation& location);
  bool AddShape(Arguments& arguments, std::optional<TriangleMesh> mesh);
  // Reports an error and stops the reading when the scene has no room for these shapes.
  bool HasRoomFor(const ShapeSet& shapes, Arguments& arguments);
  void AddShapes(ShapeSet shapes);
  // For ShapeTraits::source.
  std::int32_t SourceAt(const SourceLocation& location);

  // Instances (instance_directives.cc).
  struct Object {
    // Its meshes are in the scene once it is shared.
    ShapeSet shapes;
    std::uint64_t triangles = 0;
    bool has_instance = false;
    bool has_moving_parts = false;        // then it is always written out
    std::optional<std::uint32_t> shared;  // index in Scene::objects
  };
  // Copies of an object's meshes, which are replaced by an instance when the object is shared after
  // all.
  struct WrittenOutMeshes {
    Object* object = nullptr;
    Transform to_world;
    std::int32_t motion = kNoMotion;
    std::size_t first = 0, count = 0;  // in Scene::meshes
  };
  void PlaceInstance(Object& object, Arguments& arguments);
  void AddInstance(Object& object, const Transform& to_world, Arguments& arguments);
  void Share(Object& object);
  void ReplaceWrittenOut();
  bool OnCamera(Arguments& arguments);
  bool OnFilm(Arguments& arguments);
  bool OnPixelFilter(Arguments& arguments);
  bool OnSampler(Arguments& arguments);
  bool OnIntegrator(Arguments& arguments);
  bool OnAccelerator(Arguments& arguments);
  bool OnColorSpace(Arguments& arguments);
  bool OnOption(Arguments& arguments);
  bool OnMaterial(Arguments& arguments);
  bool OnMakeNamedMaterial(Arguments& arguments);
  bool OnNamedMaterial(Arguments& arguments);
  bool OnAreaLightSource(Arguments& arguments);
  bool OnLightSource(Arguments& arguments);
  bool OnShape(Arguments& arguments);
  bool OnTexture(Arguments& arguments);
  bool OnMediumInterface(Arguments& arguments);
  bool OnMakeNamedMedium(Arguments& arguments);

  AssetReader& assets_;
  Diagnostics& diagnostics_;
  UnfinishedScene unfinished_;
  Scene& scene_ = unfinished_.scene;

  int depth_ = 0;                        // of files that include files
  std::vector<std::string> open_texts_;  // paths, the main file's first
  // In scene_.source_files, by SourceLocation::file.
  std::map<const std::string*, std::uint32_t> source_files_;
  std::uint64_t texts_read_ = 0;
  std::uint64_t shapes_cost_ = 0;
  std::uint64_t shapes_bytes_ = 0;
  std::uint64_t densities_bytes_ = 0;  // of media
  std::uint64_t cloud_points_left_ = kMostCloudPoints;
  bool is_stopped_ = false;

  GraphicsStack graphics_;
  bool in_world_ = false;
  // As pbrt-v4 has it where a text says nothing.
  double transform_start_ = 0, transform_end_ = 1;
  // Of the last motion, which the shapes that come next share: its number, and that of the object's
  // motion that it is made of.
  std::int32_t last_motion_ = kNoMotion, last_within_ = kNoMotion;
  TransformPair last_transforms_;
  std::map<std::string, TransformPair> coordinate_systems_;
  std::map<std::string, NamedMaterial> named_materials_;
  std::vector<bool> materials_on_shapes_;  // of those that have shapes, by index
  std::map<std::string, NamedMedium> named_media_;
  MaterialNames defined_materials_;
  DeclaredTextures textures_;
  std::map<std::string, Object> objects_;
  Object* open_object_ = nullptr;  // between ObjectBegin and ObjectEnd
  std::vector<WrittenOutMeshes> written_out_;
  std::uint64_t written_out_triangles_ = 0;
  std::uint64_t instanced_triangles_ = 0;  // each wherever it stands
};

}  // namespace lucerna
