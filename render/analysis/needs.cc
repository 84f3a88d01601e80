#include "render/analysis/needs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <type_traits>
#include <utility>
#include <vector>

#include "render/analysis/reachability.h"
#include "render/base/text.h"
#include "render/math/double3.h"
#include "render/scene/materials_in_use.h"
#include "render/scene/scene_extent.h"
#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

constexpr std::array<std::string_view, kPartCount> kNames = {
    "photons",
    "specular-surfaces",
    "glossy-hitpoints",
    "caustic-hitpoints",
    "shading-normals",
    "textures",
    "round-shapes",
    "environment",
    "area-lights",
    "delta-lights",
    "unreachable-lights",
    "direct-sampling",
    "photon-directions",
    "photon-normals",
    "robust-rays",
    "split-triangles",
    "lens",
    "fresh-eye-paths",
    "frequency-photons",
    "occluder-edges",
    "curvature",
    "curved-mirrors",
    "texture-detail",
    "sky-detail",
    "glossy-window",
    "motion",
    "media",
    "alpha-masks",
    "instances",
    "dispersion",
    "spectra",
};

// Sets of eye paths: with fewer the edges of shapes would be seen not to be smooth.
constexpr int kEyeSampleSets = 64;
// All sets' hitpoints together; a worker keeps 16 bytes of each, the coordinator about 8.
constexpr std::int64_t kHitpointsOfSets = std::int64_t{1} << 24;

// With fewer triangles rays gain nothing by a better tree. With more of them they gain up to a
// fifteenth of all time, and building it takes some 0.15 microseconds a triangle longer.
constexpr std::size_t kFewestToSplit = 1000;

std::string Quoted(const Material& material) {
  return material.name.empty() ? std::string("a material without a name")
                               : Concat("material \"", material.name, "\"");
}

// The first material in use that `is_so`; nullptr without one.
template <typename Predicate>
const Material* FirstMaterial(const Scene& scene, const std::vector<std::uint8_t>& in_use,
                              Predicate is_so) {
  for (std::size_t i = 0; i < scene.materials.size(); ++i) {
    if (in_use[i] != 0 && is_so(scene.materials[i])) return &scene.materials[i];
  }
  return nullptr;
}

// Whether some vertex normal is another than its triangle's, beyond what six digits leave open.
bool IsSmoothed(const TriangleMesh& mesh) {
  if (mesh.normals.empty()) return false;
  constexpr double kTurned = 1e-5;  // [rad]
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    const std::uint32_t* corner = &mesh.indices[i - i % 3];
    const Double3 normal(mesh.normals[mesh.indices[i]]);
    const Double3 cross = TriangleCross(mesh.positions[corner[0]], mesh.positions[corner[1]],
                                        mesh.positions[corner[2]]);
    if (Length(Cross(normal, cross)) > kTurned * Length(cross)) return true;
  }
  return false;
}

// Curved surfaces that reflect or refract, however roughly.
bool HasCurvedMirrors(const Scene& scene) {
  const auto scatters = [&](const ShapeTraits& traits) {
    return HasNarrowLobes(scene.materials[static_cast<std::size_t>(traits.material)]);
  };
  // Meshes of objects count as flat (geometry/curvature.h).
  bool has_curved = std::ranges::any_of(scene.meshes, [&](const TriangleMesh& mesh) {
    return scatters(mesh.traits) && IsSmoothed(mesh);
  });
  ForEachAnalyticShape(scene, [&](const auto& shape) {
    has_curved = has_curved || (!shape.kIsFlat && scatters(shape.traits));
  });
  return has_curved;
}

bool HasCurvedShapes(const Scene& scene) {
  bool has_curved = false;
  ForEachAnalyticShape(scene,
                       [&](const auto& shape) { has_curved = has_curved || !shape.kIsFlat; });
  return has_curved;
}

// Calls `visit` for each flat analytic shape.
template <typename Visit>
void ForEachFlatShape(const Scene& scene, const Visit& visit) {
  ForEachAnalyticShape(scene, [&](const auto& shape) {
    if constexpr (std::decay_t<decltype(shape)>::kIsFlat) visit(shape);
  });
}

std::size_t CountLights(const Scene& scene) {
  std::size_t emitting = 0;
  ForEachShapeTraits(scene, [&](const ShapeTraits& traits) {
    emitting += traits.area_light != kNoAreaLight ? 1 : 0;
  });
  return emitting + DeltaLightCount(scene) + scene.infinite_lights.size();
}

// The faces of one-sided lights that nothing lies in front of.
std::size_t FacesAwayFromScene(const Scene& scene) {
  const Bounds box = BoundsOf(scene);
  const auto is_one_sided = [&](const ShapeTraits& traits) {
    return traits.area_light != kNoAreaLight &&
           !scene.area_lights[static_cast<std::size_t>(traits.area_light)].two_sided;
  };
  std::size_t count = 0;
  for (const TriangleMesh& mesh : scene.meshes) {
    if (!is_one_sided(mesh.traits)) continue;
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      const Vec3 p0 = mesh.positions[mesh.indices[i]];
      const Vec3 normal = TriangleNormal(p0, mesh.positions[mesh.indices[i + 1]],
                                         mesh.positions[mesh.indices[i + 2]]);
      count += FacesAway(p0, normal, box) ? 1 : 0;
    }
  }
  ForEachFlatShape(scene, [&](const auto& shape) {
    count += is_one_sided(shape.traits) && FacesAway(shape.center, shape.normal, box) ? 1 : 0;
  });
  return count;
}

// Whether all gathering surfaces are pieces of one plane that everything else, the camera too, lies
// in front of. Photons and eye paths then never come from behind them, and are all on one side.
bool GathersOnOneFloor(const Scene& scene) {
  const auto gathers = [&](const ShapeTraits& traits) {
    return Gathers(scene.materials[static_cast<std::size_t>(traits.material)]);
  };
  bool curves_gather = false;
  ForEachAnalyticShape(scene, [&](const auto& shape) {
    curves_gather = curves_gather || (!shape.kIsFlat && gathers(shape.traits));
  });
  // The camera is one point here, and instances and what moves may gather anywhere.
  if (curves_gather || !scene.instances.empty() || scene.motion.Moves() ||
      scene.camera.kind == Camera::Kind::kOrthographic ||
      scene.camera.kind == Camera::Kind::kSensors) {
    return false;
  }
  const Bounds box = BoundsOf(scene);
  const double near = 1e-6 * static_cast<double>(std::max(MaxAbs(box.low), MaxAbs(box.high)));
  bool has_floor = false;
  Double3 origin;
  Double3 up;  // unit
  const auto lies_in_floor = [&](Vec3 point) {
    return std::abs(Dot(Double3(point) - origin, up)) <= near;
  };
  // The first face is the floor; its winding does not tell which side is up.
  const auto take_floor = [&](Vec3 point, Double3 normal) {
    if (has_floor) return;
    has_floor = true;
    origin = Double3(point);
    up = normal * (1 / Length(normal));
  };
  for (const TriangleMesh& mesh : scene.meshes) {
    if (!gathers(mesh.traits)) continue;
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      const std::array<Vec3, 3> corners = {mesh.positions[mesh.indices[i]],
                                           mesh.positions[mesh.indices[i + 1]],
                                           mesh.positions[mesh.indices[i + 2]]};
      take_floor(corners[0], TriangleCross(corners[0], corners[1], corners[2]));
      if (!std::ranges::all_of(corners, lies_in_floor)) return false;
    }
  }
  bool all_in_floor = true;
  ForEachFlatShape(scene, [&](const auto& shape) {
    if (!gathers(shape.traits)) return;
    const Double3 normal(shape.normal);
    take_floor(shape.center, normal);
    // Tilted by less than what lifts its rim off the floor.
    const double tilt = Length(Cross(normal, up));
    all_in_floor = all_in_floor && lies_in_floor(shape.center) &&
                   tilt * static_cast<double>(shape.Reach()) <= near;
  });
  if (!has_floor || !all_in_floor) return false;
  const Vec3 eye = scene.camera.camera_to_world.Point({});
  if (Dot(Double3(eye) - origin, up) < 0) up = up * -1;
  if (!(Dot(Double3(eye) - origin, up) > LensReach(scene.camera) + near)) return false;
  const auto lies_in_front = [&](Vec3 point, double radius) {
    return Dot(Double3(point) - origin, up) >= radius - near;
  };
  bool all_in_front = std::ranges::all_of(scene.meshes, [&](const TriangleMesh& mesh) {
    return std::ranges::all_of(mesh.positions, [&](Vec3 point) { return lies_in_front(point, 0); });
  });
  ForEachAnalyticShape(scene, [&](const auto& shape) {
    auto radius = static_cast<double>(shape.Reach());
    if constexpr (std::decay_t<decltype(shape)>::kIsFlat)
      radius *= Length(Cross(Double3(shape.normal), up));
    all_in_front = all_in_front && lies_in_front(shape.center, radius);
  });
  return all_in_front;
}

}  // namespace

std::string_view NameOf(Part part) {
  return kNames[static_cast<std::size_t>(part)];
}

// Finds the needs of one job, group by group: later groups use what earlier ones found.
class NeedsFinder {
 public:
  NeedsFinder(const Scene& scene, const RenderSettings& settings)
      : scene_(scene), settings_(settings), in_use_(MaterialsInUse(scene)) {}

  SceneNeeds Find() && {
    FindSurfaces();
    FindLights();
    FindPhotons();
    FindRays();
    FindEyePaths();
    FindFrequency();
    AddRareParts();
    if (settings_.use_everything) ForceEverything();
    return std::move(needs_);
  }

 private:
  void Set(Part part, bool is_used, std::string reason) {
    needs_.Set(part, is_used, std::move(reason));
  }
  // The first material in use that is so; nullptr without one.
  template <typename Predicate>
  const Material* First(Predicate is_so) const {
    return FirstMaterial(scene_, in_use_, is_so);
  }

  void FindSurfaces() {
    gathers_ = First(Gathers);
    specular_ = First([](const Material& m) { return PropertiesOf(m).needs_choice(); });
    Set(Part::kSpecular, specular_ != nullptr,
        specular_ == nullptr ? std::string("every surface gathers photons or is black")
        : PropertiesOf(*specular_).has_parts
            ? Concat("paths choose between the two parts of ", Quoted(*specular_))
        : PropertiesOf(*specular_).is_mix
            ? Concat("paths choose one of the materials of ", Quoted(*specular_))
            : Concat("paths go on at ", Quoted(*specular_)));
    glossy_ = First([](const Material& m) {
      const MaterialProperties properties = PropertiesOf(m);
      if (!properties.has_parts) return properties.gathers && !properties.is_separable;
      Material second = m;
      second.parts = Parts::kSecond;
      return properties.gathers && !PropertiesOf(second).is_separable;
    });
    Set(Part::kGlossy, glossy_ != nullptr,
        glossy_ != nullptr
            ? Concat("photons are gathered on ", Quoted(*glossy_), ", which is not diffuse")
            : std::string("all hitpoints are diffuse"));

    const auto smoothed = std::ranges::count_if(scene_.meshes, IsSmoothed) +
                          std::ranges::count_if(scene_.object_meshes, IsSmoothed);
    const auto has_vertex_normals = [](const TriangleMesh& mesh) { return !mesh.normals.empty(); };
    const bool has_normals = std::ranges::any_of(scene_.meshes, has_vertex_normals) ||
                             std::ranges::any_of(scene_.object_meshes, has_vertex_normals);
    const Material* bumpy = First([](const Material& m) { return m.HasBumps(); });
    Set(Part::kShadingNormals, smoothed > 0 || bumpy != nullptr,
        smoothed > 0       ? Concat(smoothed, smoothed == 1 ? " mesh is" : " meshes are",
                                    " smoothed by vertex normals")
        : bumpy != nullptr ? Concat(Quoted(*bumpy), " has bumps")
        : has_normals      ? std::string("every vertex normal is that of its triangles")
                           : std::string("no mesh has vertex normals"));

    textured_ = First([](const Material& m) { return m.HasTexture(); });
    const Material* varied = First([](const Material& m) { return m.DependsOnPlace(); });
    Set(Part::kTextures, varied != nullptr,
        textured_ != nullptr ? Concat(Quoted(*textured_), " has one")
        : varied != nullptr ? Concat(Quoted(*varied), " is another one at each place or wavelength")
                            : std::string("no surface has one"));
    const Material* dispersive = First([](const Material& m) { return m.Disperses(); });
    Set(Part::kDispersion, dispersive != nullptr,
        dispersive != nullptr
            ? Concat(Quoted(*dispersive), " bends each wavelength differently")
            : std::string("no glass has an index that depends on the wavelength"));
    Set(Part::kRoundShapes, RoundShapes() > 0,
        RoundShapes() > 0 ? Concat("shapes that are given by a formula: ", RoundShapes())
                          : std::string("everything is made of triangles"));
  }

  void FindLights() {
    needs_.lights_ = FindUnreachableLights(scene_);
    const UnreachableLights& unreachable = needs_.lights_;
    const std::size_t count = CountLights(scene_);
    is_dark_ = unreachable.of_photons.size() == count;
    const LightNumbers numbers(scene_);
    // Lights [first, last), of which there are `all`.
    const auto set_kind = [&](Part part, std::size_t all, std::uint32_t first, std::uint32_t last,
                              std::string_view what, std::string_view none) {
      const auto left_out = static_cast<std::size_t>(std::ranges::count_if(
          unreachable.of_photons, [&](std::uint32_t n) { return n >= first && n < last; }));
      Set(part, left_out < all,
          left_out < all ? Concat(what, ": ", all - left_out)
          : all > 0 ? std::string("opaque closed geometry separates these lights from the view")
                    : std::string(none));
    };
    const std::size_t infinite = scene_.infinite_lights.size();
    const std::size_t delta = DeltaLightCount(scene_);
    set_kind(Part::kEnvironment, infinite, numbers.infinite, numbers.end, "infinite lights",
             "there is no infinite light");
    set_kind(Part::kAreaLights, count - delta - infinite, 0, numbers.delta, "shapes that emit",
             "no shape emits");
    set_kind(Part::kDeltaLights, delta, numbers.delta, numbers.infinite,
             "points, spots and distant lights", "every light has an extent");

    std::string reason;
    if (const std::size_t separated = unreachable.of_photons.size(); separated > 0) {
      reason = Concat("lights that opaque closed geometry separates from the view: ", separated);
    }
    if (const std::size_t away = FacesAwayFromScene(scene_); away > 0) {
      reason += Concat(reason.empty() ? "" : "; ",
                       "faces of lights that nothing lies in front of: ", away);
    }
    Set(Part::kUnreachableLights, false,
        reason.empty() ? "every light may reach what the camera sees" : reason);

    const bool is_lit = First(ScattersBroadly) != nullptr;
    const std::size_t enclosed = unreachable.of_sampling.size();
    const bool is_sampled = unreachable.of_photons.size() + enclosed < count;
    Set(Part::kDirectSampling, is_lit && is_sampled,
        !is_lit    ? std::string("no surface scatters light broadly")
        : is_dark_ ? std::string(kDark)
        : !is_sampled
            ? std::string("smooth surfaces enclose every light: all light comes by photons")
        : enclosed > 0
            ? Concat("direct light is sampled, except of lights that smooth surfaces enclose: ",
                     enclosed)
            : std::string("direct light is sampled; photons would be noisier"));
  }

  // Whether there are lights that eye paths never find, or only by chance.
  [[nodiscard]] bool HasSmallLights() const {
    return needs_.Uses(Part::kDeltaLights) || needs_.Uses(Part::kAreaLights) ||
           std::ranges::any_of(scene_.infinite_lights,
                               [](const InfiniteLight& light) { return light.HasDetail(); });
  }

  void FindCausticHitpoints() {
    const Material* narrow = First(GathersCaustics);
    const bool has_smooth = First(ScattersSmoothly) != nullptr;
    const bool is_used = narrow != nullptr && has_smooth && !is_dark_ && HasSmallLights();
    Set(Part::kCausticHitpoints, is_used,
        is_used ? Concat("smooth surfaces throw light on ", Quoted(*narrow), ", where paths go on")
        : narrow == nullptr
            ? std::string("rough surfaces are rough enough for all photons to be gathered on")
        : !has_smooth ? std::string("no surface is smooth")
        : is_dark_    ? std::string(kDark)
                      : std::string("eye paths that leave the scene find all the light there is"));
    if (is_used && gathers_ == nullptr) caustics_only_ = narrow;
  }

  void FindPhotons() {
    FindCausticHitpoints();
    const Material* receiver = gathers_ != nullptr ? gathers_ : caustics_only_;
    const auto scatters = std::ranges::find_if(scene_.media, &Medium::Scatters);
    const bool has_scattering = scatters != scene_.media.end();
    Set(Part::kPhotons, (receiver != nullptr || has_scattering) && !is_dark_,
        receiver == nullptr && has_scattering && !is_dark_
            ? Concat("the medium \"", scatters->name, "\" scatters them")
        : receiver == nullptr
            ? std::string("no surface is rough enough for photons to be gathered on")
        : is_dark_ ? std::string(kDark)
                   : Concat("they are gathered on ", Quoted(*receiver)));
    Set(Part::kPhotonDirections, glossy_ != nullptr,
        glossy_ != nullptr ? "glossy hitpoints need the directions of photons"
                           : "all hitpoints are diffuse");
    const bool is_one_sided =
        First([](const Material& m) { return Gathers(m) && Transmits(m); }) == nullptr;
    const bool is_one_floor = glossy_ == nullptr && is_one_sided && GathersOnOneFloor(scene_);
    Set(Part::kPhotonNormals, gathers_ != nullptr && !is_one_floor,
        gathers_ == nullptr ? "no surface gathers light"
        : is_one_floor      ? "all hitpoints lie on one side of one plane"
                            : "hitpoints must not take photons from another surface");
  }

  void FindRays() {
    const std::size_t triangles = scene_.TriangleCount();
    Set(Part::kRobustRays, triangles > 0,
        triangles > 0 ? "rays must not slip between the triangles of a closed shape"
                      : "there are no triangles");
    Set(Part::kSplitTriangles, triangles >= kFewestToSplit,
        triangles >= kFewestToSplit
            ? Concat("rays get through ", triangles, " triangles faster")
            : Concat("there is little to gain with so few triangles as ", triangles));
  }

  void FindEyePaths() {
    const bool has_lens = scene_.camera.lens_radius > 0;
    Set(Part::kLens, has_lens, has_lens ? "the camera has a lens" : "the camera is a pinhole");
    const std::int64_t pixels =
        std::int64_t{settings_.crop_width()} * std::int64_t{settings_.crop_height()};
    if (has_lens) {
      Set(Part::kFreshEyePaths, true, "the camera has a lens");
    } else if (scene_.motion.Moves()) {
      Set(Part::kFreshEyePaths, true, "each pass sees the scene at another time");
    } else if (std::ranges::any_of(scene_.media, &Medium::Scatters)) {
      Set(Part::kFreshEyePaths, true, "eye paths choose at random where they look into media");
    } else if (specular_ != nullptr) {
      Set(Part::kFreshEyePaths, true, Concat("eye paths choose at random at ", Quoted(*specular_)));
    } else if (pixels * kEyeSampleSets > kHitpointsOfSets) {
      Set(Part::kFreshEyePaths, true,
          Concat(kEyeSampleSets, " sets of ", pixels, " hitpoints are more than workers keep"));
    } else {
      Set(Part::kFreshEyePaths, false,
          Concat("nothing on an eye path is random but its place in the pixel: ", kEyeSampleSets,
                 " sets of eye paths take turns"));
      needs_.eye_sample_sets_ = kEyeSampleSets;
    }
  }

  void FindFrequency() {
    const bool is_used = UsesFrequency(settings_.radius_controller);
    Set(Part::kFrequency, is_used,
        Concat("radius controller ", NameOf(settings_.radius_controller),
               is_used ? " needs them" : " needs none"));
    const auto set = [&](Part part, bool has_it, std::string_view why, std::string_view why_not) {
      Set(part, is_used && has_it,
          std::string(!is_used ? "there are no frequency photons"
                      : has_it ? why
                               : why_not));
    };
    const std::size_t shapes = ShapeCount(scene_) + scene_.instances.size();
    set(Part::kOccluderEdges, shapes > 1 || scene_.TriangleCount() > 1,
        "shapes cast shadows on each other", "a single face shadows nothing");
    set(Part::kCurvature, needs_.Uses(Part::kShadingNormals) || HasCurvedShapes(scene_),
        "there are curved surfaces", "every surface is flat");
    set(Part::kCurvedMirrors, is_used && HasCurvedMirrors(scene_), "mirrors or glass are curved",
        "every mirror and all glass is flat");
    set(Part::kTextureDetail, textured_ != nullptr, "surfaces have textures",
        "no surface has a texture");
    const bool has_map = std::ranges::any_of(scene_.infinite_lights,
                                             [](const auto& light) { return light.HasDetail(); });
    set(Part::kSkyDetail, has_map, "an environment map lights the scene",
        "no environment map lights the scene");
    set(Part::kGlossyWindow, glossy_ != nullptr, "there are glossy hitpoints",
        "all hitpoints are diffuse");
  }

  void AddRareParts() {
    Set(Part::kSpectra, settings_.spectral,
        settings_.spectral ? "setting \"spectral\": each pass carries three wavelengths"
                           : "paths carry three colours");
    Set(Part::kMotion, scene_.motion.Moves(), MotionReason());
    const std::size_t media = scene_.media.size();
    Set(Part::kMedia, media > 0,
        media > 0 ? Concat("media that absorb or scatter light: ", media)
                  : std::string("all space is empty"));
    bool has_masks = false;
    ForEachShapeTraits(
        scene_, [&](const ShapeTraits& traits) { has_masks = has_masks || !IsWhole(traits); });
    Set(Part::kAlphaMasks, has_masks,
        has_masks ? "rays pass through a share of a shape" : "every shape is met by all rays");
    Set(Part::kInstances, !scene_.instances.empty(),
        scene_.instances.empty()
            ? std::string("everything is written out as shapes of its own: one tree")
            : Concat("instances: ", scene_.instances.size(),
                     ", of objects: ", scene_.objects.size(), ", which are in memory once"));
  }

  [[nodiscard]] std::string MotionReason() const {
    const SceneMotion& motion = scene_.motion;
    if (!motion.Moves()) return "nothing moves while the shutter is open";
    std::size_t shapes = 0;
    ForEachShapeTraits(
        scene_, [&](const ShapeTraits& traits) { shapes += traits.motion != kNoMotion ? 1 : 0; });
    for (const Instance& instance : scene_.instances)
      shapes += instance.motion != kNoMotion ? 1 : 0;
    std::string moving = shapes > 0 ? Concat("shapes that move: ", shapes) : std::string();
    if (motion.of_camera) moving += shapes > 0 ? "; the camera moves" : "the camera moves";
    return moving;
  }

  void ForceEverything() {
    const auto force = [&](std::initializer_list<Part> parts) {
      for (const Part part : parts) {
        if (!needs_.Uses(part)) Set(part, true, "everything is forced on");
      }
    };
    force({Part::kSpecular, Part::kGlossy, Part::kShadingNormals, Part::kTextures,
           Part::kUnreachableLights, Part::kDirectSampling, Part::kPhotonDirections,
           Part::kPhotonNormals, Part::kRobustRays, Part::kSplitTriangles, Part::kFreshEyePaths});
    if (gathers_ != nullptr) force({Part::kPhotons});
    if (needs_.Uses(Part::kFrequency)) {
      force({Part::kOccluderEdges, Part::kCurvature, Part::kCurvedMirrors, Part::kTextureDetail,
             Part::kSkyDetail, Part::kGlossyWindow});
    }
    needs_.eye_sample_sets_ = 0;
    needs_.lights_ = {};
  }

  [[nodiscard]] std::size_t RoundShapes() const {
    return ShapeCount(scene_) - scene_.meshes.size();
  }

  static constexpr std::string_view kDark = "no light reaches what the camera can see";

  const Scene& scene_;
  const RenderSettings& settings_;
  const std::vector<std::uint8_t> in_use_;  // [materials]
  // The first of their kind, or nullptr.
  const Material* gathers_ = nullptr;
  const Material* specular_ = nullptr;
  const Material* glossy_ = nullptr;
  const Material* textured_ = nullptr;
  // Where caustic photons alone are gathered, or nullptr.
  const Material* caustics_only_ = nullptr;
  bool is_dark_ = false;
  SceneNeeds needs_;
};

SceneNeeds NeedsOf(const Scene& scene, const RenderSettings& settings) {
  return NeedsFinder(scene, settings).Find();
}

}  // namespace lucerna
