// Translates the objects of a Mitsuba scene into directives.
//
// Each object is read by functions in the file of its tag: sensors, bsdfs, textures, emitters,
// shapes and media. Objects that have an id are translated when they are first used.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "render/formats/asset_reader.h"
#include "render/formats/diagnostic.h"
#include "render/formats/finish_scene.h"
#include "render/formats/mitsuba/document.h"
#include "render/formats/pbrt/directives.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/math/rgb.h"
#include "render/math/transform.h"

namespace lucerna {

class MitsubaTranslator {
 public:
  // All outlive the translator.
  MitsubaTranslator(const MitsubaDocument& document, AssetReader& assets, Diagnostics& diagnostics)
      : document_(document), assets_(assets), diagnostics_(diagnostics) {}

  // Call it once.
  [[nodiscard]] UnfinishedScene Translate();

 private:
  // What a value stands for, where a texture may stand in its place.
  enum class Meaning : std::uint8_t { kColor, kNumber };
  // What shapes need to know of a bsdf.
  struct Surface {
    std::string material;  // its name
    std::optional<Parameter> alpha;
  };
  // What objects around a bsdf have said of it.
  struct Wrapping {
    std::optional<Parameter> alpha;
    std::vector<Parameter> bumps;  // of the directive Material
  };
  // A texture of one meaning.
  using TextureUse = std::pair<const MitsubaObject*, Meaning>;

  // Objects (translator.cc).
  [[nodiscard]] static std::string SubjectOf(const MitsubaObject& object);
  [[nodiscard]] ParameterList ListOf(const MitsubaObject& object);
  [[nodiscard]] MadeDirective Directive(std::string_view name, const MitsubaObject& object) const;
  // The object that a reference is to, or the object itself; nullptr after an error.
  const MitsubaObject* Resolve(const MitsubaObject& object);
  // The first child of this tag or, unless it is empty, this name; nullptr when there is none.
  const MitsubaObject* ChildOf(const MitsubaObject& object, std::string_view tag,
                               std::string_view name = {});
  // A name for what messages may mention, that nothing else has.
  std::string NewName(const MitsubaObject& object);
  void SetTransform(const Transform& to_world, const MitsubaObject& object);
  [[nodiscard]] static Transform ToWorld(const MitsubaObject& object);
  // False, and an error, when it is being translated already: it refers to itself. Else Close it.
  bool Open(const MitsubaObject& object);
  void Close(const MitsubaObject& object) { open_.erase(&object); }
  // Warns of objects that are part of this one and have none of these tags.
  void RefuseOthers(const MitsubaObject& object, std::initializer_list<std::string_view> tags);

  // Values.
  [[nodiscard]] static Parameter MakeNumber(std::string name, double value,
                                            const SourceLocation& location);
  [[nodiscard]] static Parameter MakeColor(std::string name, Rgb value,
                                           const SourceLocation& location);
  [[nodiscard]] static Parameter MakeString(std::string name, std::string value,
                                            const SourceLocation& location);
  // The value or texture called `name`, as the parameter `as` of a directive.
  std::optional<Parameter> Find(const MitsubaObject& object, ParameterList& list,
                                std::string_view name, std::string as, Meaning meaning);
  // Light of the value called `name`, as it stands.
  Rgb FindLight(const MitsubaObject& object, ParameterList& list, std::string_view name);
  // A colour that no texture may stand for.
  Rgb FindColor(const MitsubaObject& object, ParameterList& list, std::string_view name,
                Rgb otherwise);

  void TranslateView();  // sensors.cc
  void TranslateIntegrator(const MitsubaObject& integrator);
  void TranslateFilm(const MitsubaObject& sensor);
  void TranslateFilter(const MitsubaObject& film);

  // textures.cc. The name of the texture; absent after an error.
  std::optional<std::string> TextureOf(const MitsubaObject& texture, Meaning meaning);
  std::optional<std::string> TranslateTexture(const MitsubaObject& texture, Meaning meaning);
  void TranslateBitmap(const MitsubaObject& texture, ParameterList& list, MadeDirective& made);
  void TranslateCheckerboard(const MitsubaObject& texture, ParameterList& list, Meaning meaning,
                             MadeDirective& made);
  void AddPlacement(const MitsubaObject& texture, ParameterList& list, double cells,
                    MadeDirective& made);

  // bsdfs.cc. Absent after an error.
  std::optional<Surface> SurfaceOf(const MitsubaObject& bsdf);
  std::optional<Surface> TranslateBsdf(const MitsubaObject& bsdf, Wrapping wrapping);
  std::optional<Surface> TranslateOpenBsdf(const MitsubaObject& bsdf, Wrapping wrapping);
  bool AddMaterial(const MitsubaObject& bsdf, ParameterList& list, MadeDirective& made);
  bool AddDielectric(ParameterList& list, MadeDirective& made);
  bool AddConductor(const MitsubaObject& bsdf, ParameterList& list, MadeDirective& made);
  bool AddPlastic(const MitsubaObject& bsdf, ParameterList& list, MadeDirective& made);
  bool AddBlend(const MitsubaObject& bsdf, ParameterList& list, MadeDirective& made);
  void AddRoughness(const MitsubaObject& bsdf, ParameterList& list, MadeDirective& made);
  double FindIndex(ParameterList& list, std::string_view name, double otherwise);

  void TranslateEmitter(const MitsubaObject& emitter);  // emitters.cc
  void TranslateEnvironment(const MitsubaObject& emitter, ParameterList& list);
  void TranslateAreaEmitter(const MitsubaObject& emitter);

  void TranslateShape(const MitsubaObject& shape);  // shapes.cc
  void TranslateGroup(const MitsubaObject& group);
  void TranslateInstance(const MitsubaObject& instance);
  void AddGeometry(const MitsubaObject& shape, ParameterList& list, MadeDirective made);
  std::optional<TriangleMesh> ReadMeshOf(const MitsubaObject& shape, ParameterList& list);

  // media.cc. Empty after an error, and where there is none.
  std::string MediumOf(const MitsubaObject& object, std::string_view name);
  std::string TranslateMedium(const MitsubaObject& medium);

  const MitsubaDocument& document_;
  AssetReader& assets_;
  Diagnostics& diagnostics_;
  DirectiveReader reader_{assets_, diagnostics_};
  std::set<std::string> names_;
  std::map<TextureUse, std::optional<std::string>> textures_;
  std::map<const MitsubaObject*, std::optional<Surface>> surfaces_;
  std::map<const MitsubaObject*, std::string> media_;
  std::map<const MitsubaObject*, std::string> groups_;
  std::set<const MitsubaObject*> open_;  // being translated
};

}  // namespace lucerna
