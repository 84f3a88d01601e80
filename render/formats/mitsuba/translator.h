// Translates the objects of a Mitsuba scene into directives.
//
// Each object is read by functions in the file of its tag: sensors, bsdfs, textures, emitters,
// shapes and media. Objects that have an id are translated when they are first used.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "render/formats/asset_reader.h"
#include "render/formats/diagnostic.h"
#include "render/formats/finish_scene.h"
#include "render/formats/mitsuba/document.h"
#include "render/formats/pbrt/directives.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/math/rgb.h"
#include "render/math/transform.h"
#include "render/scene/texture.h"

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
    bool is_null = false;  // nothing, between two media
  };
  // How a picture or a checkerboard lies on a surface, and by what its colours are multiplied.
  struct Placement {
    TextureMapping mapping;
    Texture::Wrap wrap_u = Texture::Wrap::kRepeat, wrap_v = Texture::Wrap::kRepeat;
    Rgb tint = Gray(1);
    float scale = 1;
  };
  // What objects around a bsdf have said of it.
  struct Wrapping {
    std::optional<Parameter> alpha;
    std::vector<Parameter> bumps;  // of the directive Material
    std::optional<Placement> normals;
  };
  // Factors of the lobes of a metal or a dielectric.
  struct Tints {
    Rgb reflection = Gray(1), transmission = Gray(1);
  };
  // A texture of one meaning.
  // The last is the share of light that a coat sends back to the base that shows the texture.
  using TextureUse = std::tuple<const MitsubaObject*, Meaning, double>;

  // Objects (translator.cc).
  [[nodiscard]] static std::string SubjectOf(const MitsubaObject& object);
  // Of the values and, as parameters of type texture, of the textures and volumes that have a name.
  [[nodiscard]] ParameterList ListOf(const MitsubaObject& object);
  [[nodiscard]] MadeDirective Directive(std::string_view name, const MitsubaObject& object) const;
  // The object that a reference is to, or the object itself; nullptr after an error.
  const MitsubaObject* Resolve(const MitsubaObject& object);
  // The same without an error.
  [[nodiscard]] const MitsubaObject* FindResolved(const MitsubaObject& object) const;
  // The first child of this tag or, unless it is empty, this name; nullptr when there is none.
  const MitsubaObject* ChildOf(const MitsubaObject& object, std::string_view tag,
                               std::string_view name = {}) const;
  // A name for what messages may mention, that nothing else has.
  std::string NewName(const MitsubaObject& object);
  void SetTransform(const Transform& to_world, const MitsubaObject& object);
  [[nodiscard]] static Transform ToWorld(const MitsubaObject& object);
  // False, and an error, when it is being translated already: it refers to itself. Else Close it.
  bool Open(const MitsubaObject& object);
  void Close(const MitsubaObject& object) { open_.erase(&object); }
  // Warns of objects that are part of this one and have none of these tags. Of textures with a name
  // the list of the object warns.
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
  // The value called `name`; of type texture where that is one that is not the same everywhere.
  std::optional<Parameter> ValueOf(const MitsubaObject& object, ParameterList& list,
                                   std::string_view name);
  // What a texture or volume is everywhere, where its type says that.
  std::optional<Parameter> SpectrumOf(const MitsubaObject& texture);
  // As a parameter of a directive.
  static Parameter ParameterOf(Parameter value, std::string name, Meaning meaning);
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
  Placement TranslateBitmap(const MitsubaObject& texture, ParameterList& list, MadeDirective& made);
  Placement TranslateCheckerboard(const MitsubaObject& texture, ParameterList& list,
                                  Meaning meaning, MadeDirective& made);
  // Of a texture that scales another. Absent after an error.
  std::optional<Placement> TranslateScale(const MitsubaObject& texture, ParameterList& list,
                                          Meaning meaning, MadeDirective& made);
  // Of a texture with so many cells to a unit.
  static TextureMapping MappingOf(const MitsubaObject& texture, ParameterList& list, double cells);
  // Gives it to the texture that was made last.
  void Place(const Placement& placement, std::size_t textures_before);
  static Placement WrappingOf(ParameterList& list);

  // bsdfs.cc. Absent after an error.
  std::optional<Surface> SurfaceOf(const MitsubaObject& bsdf);
  std::optional<Surface> TranslateBsdf(const MitsubaObject& bsdf, Wrapping wrapping);
  std::optional<Surface> TranslateOpenBsdf(const MitsubaObject& bsdf, Wrapping wrapping);
  bool AddMaterial(const MitsubaObject& bsdf, ParameterList& list, MadeDirective& made);
  bool AddDielectric(const MitsubaObject& bsdf, ParameterList& list, MadeDirective& made);
  bool AddConductor(const MitsubaObject& bsdf, ParameterList& list, MadeDirective& made);
  bool AddPlastic(const MitsubaObject& bsdf, ParameterList& list, MadeDirective& made);
  bool AddBlend(const MitsubaObject& bsdf, ParameterList& list, MadeDirective& made);
  bool AddMixture(const MitsubaObject& bsdf, ParameterList& list, MadeDirective& made);
  // The width of facets of a principled bsdf.
  Parameter SquaredRoughness(const MitsubaObject& bsdf, ParameterList& list);
  // The name of the material that it becomes.
  std::string TranslatePrincipled(const MitsubaObject& bsdf, ParameterList& list,
                                  const Wrapping& wrapping);
  void TintLastMaterial();
  // A factor of a lobe, white where there is none.
  Rgb FindTint(const MitsubaObject& bsdf, ParameterList& list, std::string_view name);
  // The two materials that a bsdf is made of.
  bool AddParts(const MitsubaObject& bsdf, ParameterList& list, MadeDirective& made);
  bool AddPhong(const MitsubaObject& bsdf, ParameterList& list, MadeDirective& made);
  bool AddCoating(const MitsubaObject& bsdf, ParameterList& list, MadeDirective& made);
  // The picture of a normal map, as a parameter of the directive Material. False after an error.
  bool AddNormalMap(const MitsubaObject& bsdf, ParameterList& list, Wrapping& wrapping);
  bool AddBumpMap(const MitsubaObject& bsdf, ParameterList& list, Wrapping& wrapping);
  // Makes a material that no bsdf of the file is; its name.
  std::string AddNamedMaterial(const MitsubaObject& around, std::string_view type,
                               std::vector<Parameter> parameters);
  // What is on a shape: its bsdf, or what Mitsuba takes for none. Absent where that is the default,
  // and after an error.
  std::optional<Surface> SurfaceOfShape(const MitsubaObject& shape, bool has_media);
  [[nodiscard]] bool HasTexture(const MitsubaObject& bsdf,
                                std::set<const MitsubaObject*>& visited) const;
  void AddRoughness(const MitsubaObject& bsdf, ParameterList& list, MadeDirective& made);
  double FindIndex(ParameterList& list, std::string_view name, double otherwise);

  void TranslateEmitter(const MitsubaObject& emitter);  // emitters.cc
  void TranslateEnvironment(const MitsubaObject& emitter, ParameterList& list);
  void TranslateAreaEmitter(const MitsubaObject& emitter);

  void TranslateShape(const MitsubaObject& shape);  // shapes.cc
  void TranslateGroup(const MitsubaObject& group);
  void TranslateInstance(const MitsubaObject& instance);
  void AddGeometry(const MitsubaObject& shape, ParameterList& list, MadeDirective made);
  void UseSurface(const Surface& surface, const MitsubaObject& shape, MadeDirective& made);
  // A mesh, or those of an OBJ file in the order of `materials` after that of all others; some may
  // be empty. Empty after an error.
  std::vector<TriangleMesh> ReadMeshesOf(const MitsubaObject& shape, ParameterList& list,
                                         std::span<const std::string> materials);
  // Of an old file, whose materials Mitsuba takes from a file that the OBJ file names.
  void WarnOfMaterials(const MitsubaObject& shape, std::string_view obj,
                       std::span<const std::string> materials);
  // The bsdfs that an old file gives to materials of an OBJ file, by their names.
  [[nodiscard]] std::vector<std::string> MaterialsNamedIn(const MitsubaObject& shape) const;

  // media.cc. Empty after an error, and where there is none.
  std::string MediumOf(const MitsubaObject& object, std::string_view name);
  std::string TranslateMedium(const MitsubaObject& medium);
  // Whether nothing in it differs from place to place.
  [[nodiscard]] bool IsEven(const MitsubaObject& medium) const;

  const MitsubaDocument& document_;
  AssetReader& assets_;
  Diagnostics& diagnostics_;
  DirectiveReader reader_{assets_, diagnostics_};
  std::set<std::string> names_;
  std::map<TextureUse, std::optional<std::string>> textures_;
  double returned_ = 0;  // TextureUse's share, of the textures that are looked for
  std::map<const MitsubaObject*, std::optional<Surface>> surfaces_;
  // Of the material that is made next; pbrt's directives have no words for them.
  std::optional<Tints> tints_;
  std::map<std::string, std::string, std::less<>> stand_ins_;  // materials by their type
  std::map<const MitsubaObject*, std::string> media_;
  std::map<const MitsubaObject*, std::string> groups_;
  std::set<const MitsubaObject*> open_;  // being translated
};

}  // namespace lucerna
