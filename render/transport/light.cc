#include "render/transport/light.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <type_traits>
#include <utility>

#include "render/geometry/shape_geometry.h"
#include "render/geometry/surface_uv.h"
#include "render/math/color_space.h"
#include "render/math/double3.h"
#include "render/math/uplift.h"
#include "render/math/warp.h"
#include "render/scene/scene_extent.h"
#include "render/transport/infinite_emission.h"
#include "render/transport/light_kinds.h"

namespace lucerna {
namespace {

// The kinds of delta light that are.
bool IsAtInfinity(EmitterKind kind) {
  switch (kind) {
#define LUCERNA_CASE(Name, list, name) \
  case EmitterKind::k##Name:           \
    return Name##Light::kIsAtInfinity;
    LUCERNA_DELTA_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
    default:
      return false;
  }
}

// How much of the choice of direct light is even among the lights. By power alone, a light nearby
// that has a millionth of the power of another is found once in a million samples.
constexpr double kEvenShareOfLights = 0.1;

// Cells of pictures on area lights: of a side of one emitter, and of all together.
constexpr int kMostSpreadSide = 256;
constexpr double kMostSpreadCells = 1 << 22;
// Places along a side of each emitter at which the texture of its alpha is looked up, at least.
constexpr int kFewestMaskPlaces = 4;

// The share of a shape's light that its alpha leaves, where that is the same everywhere: the share
// of rays that meet it, as in pbrt-v4. A light that no ray meets (alpha 0) keeps all of it.
float EvenShare(const ShapeTraits& traits) {
  return traits.alpha == 0 || traits.alpha_texture != kNoTexture ? 1 : traits.alpha;
}

// Of the picture of a light, in the scene's colours.
Rgb PixelsAt(const Scene& scene, const AreaLight& light, Vec2 uv) {
  const Rgb color = light.PixelAt(uv);
  return scene.uplift == nullptr ? ToWorking(color) : scene.uplift->Unbounded(color);
}

}  // namespace

std::string_view NameOf(EmitterKind kind) {
  switch (kind) {
    case EmitterKind::kTriangle:
      return "triangle";
#define LUCERNA_CASE(Name, list, name) \
  case EmitterKind::k##Name:           \
    return name;
      LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
#define LUCERNA_CASE(Name, list, name) \
  case EmitterKind::k##Name:           \
    return name " light";
      LUCERNA_DELTA_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
#define LUCERNA_CASE(Name, name) \
  case EmitterKind::k##Name:     \
    return name;
      LUCERNA_INFINITE_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  return "light";
}

LightSet::LightSet(const Scene& scene, const Intersector& intersector,
                   const LightSelection& selection)
    : scene_(scene) {
  const LightNumbers numbers(scene);
  const auto add = [&](Emitter emitter, std::uint32_t number) {
    const UnreachableLights& unreachable = selection.unreachable;
    if (std::ranges::binary_search(unreachable.of_photons, number)) emitter.power = {};
    emitter.is_sampled = Luminance(emitter.power) > 0 &&
                         !std::ranges::binary_search(unreachable.of_sampling, number);
    emitters_.push_back(emitter);
  };
  const Bounds& bounds = intersector.bounds();
  if (!bounds.empty()) {
    sphere_.center = bounds.Center();
    sphere_.radius = 0.5F * bounds.Diagonal();
  }
  first_emitter_.assign(scene.meshes.size(), -1);

  const auto area_emitter = [&](Kind kind, const ShapeTraits& traits, float area) {
    const AreaLight& light = LightOf(traits);
    Emitter emitter;
    emitter.kind = kind;
    emitter.two_sided = light.two_sided;
    emitter.area = area;
    emitter.is_invisible = traits.alpha == 0;
    emitter.is_seen_through = light.two_sided && !IsWhole(traits);
    emitter.is_masked = traits.alpha_texture != kNoTexture;
    const float factor = EvenShare(traits);
    emitter.radiance = light.radiance * factor;
    emitter.power = emitter.radiance * (kPi * area * (light.two_sided ? 2.0F : 1.0F));
    if (light.picture != nullptr) emitter.spread = 0;  // numbered below
    largest_of_areas_ = std::max(largest_of_areas_, MaxChannel(light.Largest() * factor));
    return emitter;
  };
  // The power of two, up to `most`, of a side of each of the emitters that `counts`, whose squares
  // are at most `most_of_all` together.
  const auto side_of = [&](const auto& counts, int most, double most_of_all) {
    double emitters = 0;
    const auto count = [&](const ShapeTraits& traits, double of_shape) {
      if (traits.area_light != kNoAreaLight && counts(traits)) emitters += of_shape;
    };
    for (const TriangleMesh& mesh : scene.meshes) {
      const std::size_t triangles = mesh.indices.size() / 3;
      count(mesh.traits, static_cast<double>(triangles));
    }
    ForEachAnalyticShape(scene, [&](const auto& shape) { count(shape.traits, 1); });
    int side = most;
    while (side > 1 && emitters * side * side > most_of_all)
      side /= 2;
    return side;
  };
  const int most_cells =
      side_of([&](const ShapeTraits& traits) { return LightOf(traits).picture != nullptr; },
              kMostSpreadSide, kMostSpreadCells);
  const int mask_places =
      std::max(kFewestMaskPlaces,
               side_of([](const ShapeTraits& traits) { return traits.alpha_texture != kNoTexture; },
                       kMostSpreadSide, kMostSpreadCells));
  const auto mask = [&](Emitter& emitter) {
    if (!emitter.is_masked) return;
    emitter.mask_share = MaskShare(emitter, mask_places);
    emitter.power *= emitter.mask_share;
  };
  // Takes the place of an even power.
  const auto spread = [&](Emitter& emitter, const AreaLight& light, PictureSpread of_picture) {
    const float factor = EvenShare(TraitsOf(emitter));
    emitter.power =
        of_picture.mean() * (factor * kPi * emitter.area * (light.two_sided ? 2.0F : 1.0F));
    emitter.spread = static_cast<std::int32_t>(spreads_.size());
    spreads_.push_back(std::move(of_picture));
  };
  for (std::uint32_t m = 0; m < scene.meshes.size(); ++m) {
    const TriangleMesh& mesh = scene.meshes[m];
    if (mesh.traits.area_light == kNoAreaLight) continue;
    first_emitter_[m] = static_cast<std::int64_t>(emitters_.size());
    for (std::uint32_t t = 0; t < mesh.indices.size() / 3; ++t) {
      const std::uint32_t* corner = &mesh.indices[std::size_t{3} * t];
      const Vec3 p0 = mesh.positions[corner[0]];
      const auto area = static_cast<float>(
          Length(TriangleCross(p0, mesh.positions[corner[1]], mesh.positions[corner[2]])) / 2);
      Emitter emitter = area_emitter(Kind::kTriangle, mesh.traits, area);
      emitter.geometry = m;
      emitter.primitive = t;
      if (emitter.spread >= 0) {
        const AreaLight& light = LightOf(mesh.traits);
        spread(emitter, light, PictureSpread::OfTriangle(light, UvsOf(mesh, t), most_cells));
      }
      mask(emitter);
      const Vec3 normal = TriangleNormal(p0, mesh.positions[corner[1]], mesh.positions[corner[2]]);
      // What nothing can receive is not sent.
      if (!selection.includes_faces_away && !emitter.two_sided && FacesAway(p0, normal, bounds)) {
        emitter.power = {};
      }
      add(emitter, m);
    }
  }
  const auto add_shapes = [&](const auto& shapes, ShapeKind shape_kind, Kind kind,
                              std::uint32_t first) {
    std::vector<std::int32_t>& numbers_of_kind =
        shape_emitter_[static_cast<std::size_t>(shape_kind)];
    numbers_of_kind.assign(shapes.size(), -1);
    for (std::uint32_t i = 0; i < shapes.size(); ++i) {
      const auto& shape = shapes[i];
      if (shape.traits.area_light == kNoAreaLight) continue;
      numbers_of_kind[i] = static_cast<std::int32_t>(emitters_.size());
      Emitter emitter = area_emitter(kind, shape.traits, shape.template Area<float>());
      emitter.primitive = i;
      if (emitter.spread >= 0) {
        const AreaLight& light = LightOf(shape.traits);
        const auto uv_of = [&](Vec2 u) {
          return UvOf(shape, SampleFace(shape, u.x, u.y).position);
        };
        spread(emitter, light, PictureSpread::OfSurface(light, uv_of, most_cells));
      }
      mask(emitter);
      if constexpr (std::decay_t<decltype(shape)>::kIsFlat) {
        if (!selection.includes_faces_away && !emitter.two_sided &&
            FacesAway(shape.center, shape.normal, bounds)) {
          emitter.power = {};
        }
      }
      add(emitter, first + i);
    }
  };
#define LUCERNA_ADD(Name, list, name) \
  add_shapes(scene.list, ShapeKind::k##Name, Kind::k##Name, numbers.list);
  LUCERNA_ANALYTIC_SHAPES(LUCERNA_ADD)
#undef LUCERNA_ADD
#define LUCERNA_ADD(Name, list, name)                      \
  for (std::uint32_t i = 0; i < scene.list.size(); ++i) {  \
    const Name##Light& light = scene.list[i];              \
    Emitter emitter;                                       \
    emitter.kind = Kind::k##Name;                          \
    emitter.primitive = i;                                 \
    emitter.radiance = light.Strength();                   \
    emitter.power = Name##Emission::Power(light, sphere_); \
    add(emitter, numbers.list + i);                        \
  }
  LUCERNA_DELTA_LIGHTS(LUCERNA_ADD)
#undef LUCERNA_ADD
  first_infinite_ = emitters_.size();
#define LUCERNA_MAKE(Name, name)                                  \
  std::ranges::move(Make##Name##Emissions(scene.infinite_lights), \
                    std::back_inserter(infinite_lights_));
  LUCERNA_INFINITE_LIGHTS(LUCERNA_MAKE)
#undef LUCERNA_MAKE
  for (std::uint32_t i = 0; i < infinite_lights_.size(); ++i) {
    Emitter emitter;
    emitter.kind = infinite_lights_[i]->kind();
    emitter.primitive = i;
    emitter.radiance = infinite_lights_[i]->MeanRadiance();
    emitter.power = infinite_lights_[i]->Power(sphere_);
    // Infinite lights are unreachable together or not at all.
    add(emitter, numbers.infinite);
  }

  ShareOut();
}

void LightSet::TakeColors() {
  for (const auto& light : infinite_lights_)
    light->TakeColors(scene_.infinite_lights, scene_.uplift);
  for (Emitter& emitter : emitters_) {
    emitter.uplift = scene_.uplift;
    const bool sends = emitter.choice > 0;
    switch (emitter.kind) {
#define LUCERNA_CASE(Name, list, name) case Kind::k##Name:
      case Kind::kTriangle:
        LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE) {
#undef LUCERNA_CASE
          const ShapeTraits& traits = TraitsOf(emitter);
          emitter.radiance = LightOf(traits).radiance * EvenShare(traits);
          // What a picture sends is computed for each photon.
          if (sends && emitter.spread < 0) {
            emitter.power =
                emitter.radiance * (kPi * emitter.area * (emitter.two_sided ? 2.0F : 1.0F));
            emitter.power *= emitter.mask_share;
          }
          break;
        }
#define LUCERNA_CASE(Name, list, name)                                                         \
  case Kind::k##Name:                                                                          \
    emitter.radiance = scene_.list[emitter.primitive].Strength();                              \
    if (sends) emitter.power = Name##Emission::Power(scene_.list[emitter.primitive], sphere_); \
    break;
        LUCERNA_DELTA_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
#define LUCERNA_CASE(Name, name) case Kind::k##Name:
        LUCERNA_INFINITE_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
        emitter.radiance = infinite_lights_[emitter.primitive]->MeanRadiance();
        if (sends) emitter.power = infinite_lights_[emitter.primitive]->Power(sphere_);
        break;
    }
  }
}

void LightSet::ShareOut() {
  // A mesh is one light, whatever it is cut into.
  const auto is_same_light = [](const Emitter& a, const Emitter& b) {
    return a.kind == Kind::kTriangle && b.kind == Kind::kTriangle && a.geometry == b.geometry;
  };
  std::vector<double> light_power;
  std::vector<std::size_t> light_of;
  double total = 0;
  double sampled_total = 0;
  double sampled_lights = 0;
  for (std::size_t i = 0; i < emitters_.size(); ++i) {
    if (i == 0 || !is_same_light(emitters_[i - 1], emitters_[i])) light_power.push_back(0);
    const auto power = static_cast<double>(Luminance(emitters_[i].power));
    light_of.push_back(light_power.size() - 1);
    // The first of a light's emitters that is sampled counts for it.
    if (emitters_[i].is_sampled) {
      sampled_total += power;
      sampled_lights += light_power.back() == 0 ? 1 : 0;
    }
    light_power.back() += power;
    total += power;
    total_power_ += emitters_[i].power;
  }
  if (!(total > 0)) {
    // No light at all: nothing is ever drawn.
    emitters_.clear();
    return;
  }
  faint_lights_ = static_cast<std::size_t>(std::ranges::count_if(
      light_power, [&](double power) { return power > 0 && power < kFaintShare * total; }));
  const auto sending = static_cast<double>(
      std::ranges::count_if(light_power, [](double power) { return power > 0; }));
  const double even_share = sending > 1 ? kEvenPhotonShare : 0;
  double sum = 0;
  double even_sum = 0;
  double direct_sum = 0;
  for (std::size_t i = 0; i < emitters_.size(); ++i) {
    const auto power = static_cast<double>(Luminance(emitters_[i].power));
    double choice = power / total;
    if (even_share > 0 && power > 0) {
      const double even = power / light_power[light_of[i]] / sending;
      choice += even_share * (even - choice);
      even_sum += even;
    }
    double direct_choice = 0;
    if (emitters_[i].is_sampled) {
      const double even = power / light_power[light_of[i]] / sampled_lights;
      const double by_power = power / sampled_total;
      direct_choice = by_power + kEvenShareOfLights * (even - by_power);
    }
    sum += power;
    direct_sum += direct_choice;
    cumulative_.push_back(sum / total + even_share * (even_sum - sum / total));
    direct_cumulative_.push_back(direct_sum);
    emitters_[i].choice = static_cast<float>(choice);
    emitters_[i].direct_choice = static_cast<float>(direct_choice);
  }
  GroupLights(light_of, light_power);
  PlantTree();
}

void LightSet::PlantTree() {
  std::vector<TreeLight> lights;
  for (std::uint32_t number = 0; number < emitters_.size(); ++number) {
    if (!emitters_[number].is_sampled) continue;
    emitters_[number].in_tree = static_cast<std::uint32_t>(of_tree_.size());
    of_tree_.push_back(number);
    lights.push_back(InTree(emitters_[number]));
  }
  if (lights.size() > 1) tree_.emplace(std::move(lights));
}

TreeLight LightSet::InTree(const Emitter& emitter) const {
  TreeLight light;
  const auto power = static_cast<double>(Luminance(emitter.power));
  const auto one_sided = [&](Vec3 normal) {
    light.intensity = power / std::numbers::pi;
    light.axis = normal;
    light.cos_facing = 1;
  };
  const auto of_shape = [&](const auto& shape) {
    light.center = shape.center;
    light.radius = shape.Reach();
    if constexpr (std::decay_t<decltype(shape)>::kIsFlat) {
      if (!emitter.two_sided) one_sided(shape.normal);
    }
  };
  // Of what shines all around.
  light.intensity = power / (4 * std::numbers::pi);
  switch (emitter.kind) {
    case Kind::kTriangle: {
      const TriangleMesh& mesh = scene_.meshes[emitter.geometry];
      const std::uint32_t* corner = &mesh.indices[std::size_t{3} * emitter.primitive];
      const Vec3 p0 = mesh.positions[corner[0]];
      const Vec3 p1 = mesh.positions[corner[1]];
      const Vec3 p2 = mesh.positions[corner[2]];
      light.center = CentreOf(emitter);
      for (const Vec3 p : {p0, p1, p2})
        light.radius = std::max(light.radius, Length(p - light.center));
      if (!emitter.two_sided) one_sided(TriangleNormal(p0, p1, p2));
      return light;
    }
#define LUCERNA_CASE(Name, list, name)        \
  case Kind::k##Name:                         \
    of_shape(scene_.list[emitter.primitive]); \
    return light;
      LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
#define LUCERNA_CASE(Name, list, name) \
  case Kind::k##Name:                  \
    return Name##Emission::InTree(scene_.list[emitter.primitive], emitter);
      LUCERNA_DELTA_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
#define LUCERNA_CASE(Name, name) case Kind::k##Name:
      LUCERNA_INFINITE_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
      return infinite_lights_[emitter.primitive]->InTree(power, sphere_);
  }
  return light;
}

void LightSet::GroupLights(const std::vector<std::size_t>& light_of,
                           const std::vector<double>& light_power) {
  std::vector<std::size_t> strongest;
  for (std::size_t light = 0; light < light_power.size(); ++light) {
    if (light_power[light] > 0) strongest.push_back(light);
  }
  const std::size_t sending = strongest.size();
  if (sending > kMaxLightGroups) {
    std::ranges::stable_sort(
        strongest, [&](std::size_t a, std::size_t b) { return light_power[a] > light_power[b]; });
    strongest.resize(kMaxLightGroups - 1);
    std::ranges::sort(strongest);
  }
  constexpr std::size_t kNone = ~std::size_t{0};
  std::vector<std::size_t> group_of(light_power.size(), kNone);
  for (std::size_t group = 0; group < strongest.size(); ++group)
    group_of[strongest[group]] = group;
  lights_.assign(strongest.size(), {});
  if (sending > kMaxLightGroups) {
    const auto others = static_cast<std::uint32_t>(sending - strongest.size());
    lights_.push_back({.lights = others, .power = {}, .position = {}});
  }
  for (std::size_t i = 0; i < emitters_.size(); ++i) {
    Emitter& emitter = emitters_[i];
    if (IsBlack(emitter.power)) continue;
    const std::size_t found = group_of[light_of[i]];
    const std::size_t group = found == kNone ? lights_.size() - 1 : found;
    emitter.light = static_cast<std::uint8_t>(group);
    LightGroup& light = lights_[group];
    light.kind = emitter.kind;
    light.power += emitter.power;
    light.position = light.position + CentreOf(emitter);
    light.is_at_infinity = IsAtInfinity(emitter.kind);
    light.largest_share = std::max(light.largest_share, LargestShareOf(emitter));
    ++light.emitters;
  }
  for (LightGroup& light : lights_)
    light.position = light.position / static_cast<float>(std::max(1U, light.emitters));
}

float LightSet::LargestShareOf(const Emitter& emitter) const {
  const float of_picture = emitter.spread >= 0 ? SpreadOf(emitter).largest_share() : 1;
  // A mask that is next to white makes photons differ too.
  constexpr float kLeastOfMask = 1.001F;
  if (emitter.is_masked) return std::max(of_picture / emitter.mask_share, kLeastOfMask);
  if (emitter.spread >= 0) return of_picture;
  switch (emitter.kind) {
#define LUCERNA_CASE(Name, name) case Kind::k##Name:
    LUCERNA_INFINITE_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
    return infinite_lights_[emitter.primitive]->LargestShare();
    default:
      return 1;
  }
}

Vec3 LightSet::CentreOf(const Emitter& emitter) const {
  switch (emitter.kind) {
    case Kind::kTriangle: {
      const TriangleMesh& mesh = scene_.meshes[emitter.geometry];
      const std::uint32_t* corner = &mesh.indices[std::size_t{3} * emitter.primitive];
      return (mesh.positions[corner[0]] + mesh.positions[corner[1]] + mesh.positions[corner[2]]) *
             (1.0F / 3);
    }
#define LUCERNA_CASE(Name, list, name) \
  case Kind::k##Name:                  \
    return scene_.list[emitter.primitive].center;
      LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
#define LUCERNA_CASE(Name, list, name) \
  case Kind::k##Name:                  \
    return scene_.list[emitter.primitive].Place();
      LUCERNA_DELTA_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
    default:
      return {};
  }
}

const Emitter& LightSet::Choose(const std::vector<double>& cumulative, double u) const {
  auto found = std::upper_bound(cumulative.begin(), cumulative.end(), u);
  if (found == cumulative.end()) --found;
  // Rounding may leave the end to an emitter that is never drawn.
  while (found != cumulative.begin() && *found == *(found - 1))
    --found;
  return emitters_[static_cast<std::size_t>(found - cumulative.begin())];
}

void LightSet::PointOn(const Emitter& emitter, float u1, float u2, Vec3& position, Vec3& normal,
                       float& clearance) const {
  switch (emitter.kind) {
    case Kind::kTriangle: {
      const TriangleMesh& mesh = scene_.meshes[emitter.geometry];
      const std::uint32_t* corner = &mesh.indices[std::size_t{3} * emitter.primitive];
      const Vec3 p0 = mesh.positions[corner[0]];
      const Vec3 e1 = mesh.positions[corner[1]] - p0;
      const Vec3 e2 = mesh.positions[corner[2]] - p0;
      float b1 = 0;
      float b2 = 0;
      SquareToTriangle(u1, u2, b1, b2);
      position = p0 + e1 * b1 + e2 * b2;
      normal = TriangleNormal(p0, mesh.positions[corner[1]], mesh.positions[corner[2]]);
      clearance = kClearance * (MaxAbs(p0) + MaxAbs(e1) + MaxAbs(e2));
      return;
    }
#define LUCERNA_CASE(Name, list, name)                  \
  case Kind::k##Name: {                                 \
    const Name& shape = scene_.list[emitter.primitive]; \
    const ShapeFace face = SampleFace(shape, u1, u2);   \
    position = face.position;                           \
    normal = face.normal;                               \
    clearance = ClearanceOf(shape);                     \
    return;                                             \
  }
      LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
    default:
      LUCERNA_CHECK(false);
  }
}

bool LightSet::SampleEmission(double u_choice, float u_place1, float u_place2, float u_direction1,
                              float u_direction2, Emission& emission) const {
  if (emitters_.empty()) return false;
  const Emitter& emitter = Choose(cumulative_, u_choice);
  emission.ray.t_max = HUGE_VALF;
  emission.flux = emitter.power / emitter.choice;
  emission.emitter = static_cast<std::uint32_t>(&emitter - emitters_.data());
  emission.density = HUGE_VALF;
  switch (emitter.kind) {
#define LUCERNA_CASE(Name, list, name) case Kind::k##Name:
    case Kind::kTriangle:
      LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE) {
#undef LUCERNA_CASE
        Vec3 position;
        Vec3 normal;
        float clearance = 0;
        float density = 1;
        if (emitter.spread >= 0) {
          const Vec2 place = SpreadOf(emitter).Sample(u_place1, u_place2, density);
          u_place1 = place.x;
          u_place2 = place.y;
        }
        PointOn(emitter, u_place1, u_place2, position, normal, clearance);
        if (emitter.spread >= 0) {
          if (!(density > 0)) return false;
          emission.flux =
              PictureRadiance(emitter, UvOn(emitter, u_place1, u_place2, position)) *
              (kPi * emitter.area * (emitter.two_sided ? 2.0F : 1.0F) / (emitter.choice * density));
          if (IsBlack(emission.flux)) return false;
        } else if (emitter.is_masked) {
          emission.flux = emitter.radiance *
                          (kPi * emitter.area * (emitter.two_sided ? 2.0F : 1.0F) / emitter.choice);
        }
        if (emitter.is_masked) {
          const Vec2 uv = UvOn(emitter, u_place1, u_place2, position);
          emission.flux *= ShareAt(emitter, {uv, position, normal});
          if (IsBlack(emission.flux)) return false;
        }
        if (emitter.two_sided) {
          if (u_direction1 < 0.5F) {
            u_direction1 *= 2;
          } else {
            u_direction1 = 2 * u_direction1 - 1;
            normal = -normal;
          }
        }
        const Vec3 local = SquareToCosineHemisphere(u_direction1, u_direction2);
        emission.ray.direction = Frame(normal).ToWorld(local);
        emission.ray.origin = position + normal * clearance;
        if (!emitter.is_invisible) {
          emission.density = AreaDensity(emitter);
          if (emitter.spread >= 0) emission.density *= density;
        }
        return local.z > 0;
      }
#define LUCERNA_CASE(Name, list, name)                                                      \
  case Kind::k##Name:                                                                       \
    return Name##Emission::SampleEmission(scene_.list[emitter.primitive], emitter, sphere_, \
                                          {u_place1, u_place2, u_direction1, u_direction2}, \
                                          emission);
      LUCERNA_DELTA_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
#define LUCERNA_CASE(Name, name) case Kind::k##Name:
      LUCERNA_INFINITE_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
      if (!infinite_lights_[emitter.primitive]->SampleEmission(
              emitter, sphere_, {u_place1, u_place2, u_direction1, u_direction2}, emission)) {
        return false;
      }
      emission.density = EmissionDensityInfinite(emission.ray.origin, -emission.ray.direction);
      return true;
  }
  return false;
}

std::optional<PrimaryNumbers> LightSet::NumbersOf(std::uint32_t number, const Ray& ray,
                                                  KeyedRng& rng) const {
  const double before = number == 0 ? 0 : cumulative_[number - 1];
  const double share = cumulative_[number] - before;
  if (!(share > 0)) return std::nullopt;
  const Emitter& emitter = emitters_[number];
  EmissionNumbers u;
  for (float* const value : {&u.place1, &u.place2, &u.direction1, &u.direction2})
    *value = rng.Uniform();
  const double choice = before + share * static_cast<double>(rng.Uniform());
  switch (emitter.kind) {
#define LUCERNA_CASE(Name, list, name) case Kind::k##Name:
    case Kind::kTriangle:
      LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
      u = AreaNumbers(emitter, ray);
      break;
#define LUCERNA_CASE(Name, list, name)                                            \
  case Kind::k##Name:                                                             \
    Name##Emission::FindNumbers(scene_.list[emitter.primitive], sphere_, ray, u); \
    break;
      LUCERNA_DELTA_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
#define LUCERNA_CASE(Name, name) case Kind::k##Name:
      LUCERNA_INFINITE_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
      u = infinite_lights_[emitter.primitive]->FindNumbers(sphere_, ray.origin, -ray.direction);
      break;
  }
  PrimaryNumbers numbers = {u.place1, u.place2, u.direction1, u.direction2, choice};
  // Of cones too narrow for a float they are no numbers.
  for (double& value : numbers)
    value = value > 0 ? std::min(value, 1 - 0x1p-32) : 0;
  return numbers;
}

EmissionNumbers LightSet::AreaNumbers(const Emitter& emitter, const Ray& ray) const {
  // With which numbers PointOn draws about this place.
  const Vec2 place = [&]() -> Vec2 {
    switch (emitter.kind) {
#define LUCERNA_CASE(Name, list, name) \
  case Kind::k##Name:                  \
    return FaceNumbers(scene_.list[emitter.primitive], ray.origin);
      LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
      default:
        break;
    }
    const TriangleMesh& mesh = scene_.meshes[emitter.geometry];
    const std::uint32_t* corner = &mesh.indices[std::size_t{3} * emitter.primitive];
    const Vec3 p0 = mesh.positions[corner[0]];
    const Vec3 p1 = mesh.positions[corner[1]];
    const Vec3 p2 = mesh.positions[corner[2]];
    const Double3 cross = TriangleCross(p0, p1, p2);
    const double area2 = Dot(cross, cross);
    if (!(area2 > 0)) return {};
    return TriangleToSquare(
        static_cast<float>(Dot(TriangleCross(p0, ray.origin, p2), cross) / area2),
        static_cast<float>(Dot(TriangleCross(p0, p1, ray.origin), cross) / area2));
  }();
  constexpr float kBelowOne = 0x1.fffffep-1F;
  Vec3 position;
  Vec3 normal;
  float clearance = 0;
  PointOn(emitter, std::min(place.x, kBelowOne), std::min(place.y, kBelowOne), position, normal,
          clearance);
  const Vec3 leaving = Normalize(ray.direction);
  const bool is_other_side = emitter.two_sided && Dot(leaving, normal) < 0;
  const Vec3 local = Frame(is_other_side ? -normal : normal).ToLocal(leaving);
  Vec2 direction = DiskToSquare(local.x, local.y);
  if (emitter.two_sided) direction.x = 0.5F * (direction.x + (is_other_side ? 1.0F : 0.0F));
  const Vec2 numbers = emitter.spread >= 0 ? SpreadOf(emitter).NumbersAt(place) : place;
  return {numbers.x, numbers.y, direction.x, direction.y};
}

std::optional<std::uint32_t> LightSet::EmitterAt(const SurfacePoint& point) const {
  const Emitter* emitter = EmitterOf(point);
  if (emitter == nullptr) return std::nullopt;
  return static_cast<std::uint32_t>(emitter - emitters_.data());
}

std::optional<std::uint32_t> LightSet::InfiniteEmitter(Vec3 from, Vec3 direction) const {
  std::optional<std::uint32_t> likeliest;
  float largest = 0;
  for (std::size_t i = 0; i < infinite_lights_.size() && !emitters_.empty(); ++i) {
    const std::size_t number = first_infinite_ + i;
    const float density = infinite_lights_[i]->Density(from, direction, emitters_[number].choice);
    if (density > largest) {
      largest = density;
      likeliest = static_cast<std::uint32_t>(number);
    }
  }
  return likeliest;
}

std::optional<Spectrum> LightSet::DeltaSource(const Emission& emission, double edge_strength,
                                              const SpectrumLimits& limits) const {
  const Emitter& emitter = emitters_[emission.emitter];
  switch (emitter.kind) {
#define LUCERNA_CASE(Name, list, name)                                               \
  case Kind::k##Name:                                                                \
    return Name##Emission::Source(scene_.list[emitter.primitive], emitter, emission, \
                                  edge_strength, limits);
    LUCERNA_DELTA_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
    default:
      return std::nullopt;
  }
}

float LightSet::DirectChoice(const Emitter& emitter, float by_tree) {
  return kShareAnywhere * emitter.direct_choice + (1 - kShareAnywhere) * by_tree;
}

float LightSet::DirectChoice(const Emitter& emitter, const LitPoint& from) const {
  if (!tree_ || !emitter.is_sampled) return emitter.direct_choice;
  return DirectChoice(emitter, tree_->Probability(from, emitter.in_tree));
}

bool LightSet::SampleDirect(const LitPoint& from, double u_choice, float u1, float u2,
                            LightSample& sample) const {
  if (emitters_.empty() || direct_cumulative_.back() == 0) return false;
  if (!tree_) {
    const Emitter& emitter = Choose(direct_cumulative_, u_choice);
    return SampleEmitter(emitter, from, emitter.direct_choice, u1, u2, sample);
  }
  constexpr auto kAnywhere = static_cast<double>(kShareAnywhere);
  if (u_choice < kAnywhere) {
    const Emitter& emitter = Choose(direct_cumulative_, u_choice / kAnywhere);
    return SampleEmitter(emitter, from, DirectChoice(emitter, from), u1, u2, sample);
  }
  const std::optional<LightTree::Choice> drawn =
      tree_->Draw(from, (u_choice - kAnywhere) / (1 - kAnywhere));
  if (!drawn) return false;
  const Emitter& emitter = emitters_[of_tree_[drawn->light]];
  return SampleEmitter(emitter, from, DirectChoice(emitter, drawn->probability), u1, u2, sample);
}

bool LightSet::SampleEmitter(const Emitter& emitter, const LitPoint& lit, float choice, float u1,
                             float u2, LightSample& sample) const {
  const Vec3 from = lit.position;
  sample.emitter = static_cast<std::uint32_t>(&emitter - emitters_.data());
  switch (emitter.kind) {
#define LUCERNA_CASE(Name, list, name)                                                           \
  case Kind::k##Name: {                                                                          \
    SeenPlace seen;                                                                              \
    if (emitter.is_seen_through ||                                                               \
        !SampleSeen(scene_.list[emitter.primitive], from, u1, u2, seen)) {                       \
      break;                                                                                     \
    }                                                                                            \
    sample.wi = seen.wi;                                                                         \
    sample.is_distant = false;                                                                   \
    sample.target = seen.target;                                                                 \
    sample.pdf = choice / seen.inverse_pdf;                                                      \
    sample.radiance_over_pdf = emitter.radiance / sample.pdf;                                    \
    if (emitter.spread >= 0) {                                                                   \
      const Vec2 uv = UvOf(scene_.list[emitter.primitive], seen.target);                         \
      sample.radiance_over_pdf = PictureRadiance(emitter, uv) / sample.pdf;                      \
    }                                                                                            \
    if (emitter.is_masked) {                                                                     \
      const auto& shape = scene_.list[emitter.primitive];                                        \
      const Vec2 u = FaceNumbers(shape, seen.target);                                            \
      sample.radiance_over_pdf *= ShareAt(                                                       \
          emitter, {UvOf(shape, seen.target), seen.target, SampleFace(shape, u.x, u.y).normal}); \
    }                                                                                            \
    if (emitter.is_invisible) sample.pdf = 0;                                                    \
    return true;                                                                                 \
  }
    LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
#define LUCERNA_CASE(Name, list, name)                                                         \
  case Kind::k##Name:                                                                          \
    return Name##Emission::SampleDirect(scene_.list[emitter.primitive], emitter, choice, from, \
                                        sample);
    LUCERNA_DELTA_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
#define LUCERNA_CASE(Name, name) case Kind::k##Name:
    LUCERNA_INFINITE_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
    if (!infinite_lights_[emitter.primitive]->Sample(from, u1, u2, sample.wi)) return false;
    sample.is_distant = true;
    // Whichever drew it, light from this direction is that of all infinite lights.
    sample.pdf = PdfDirectInfinite(lit, sample.wi);
    if (!(sample.pdf > 0)) return false;
    sample.radiance_over_pdf = InfiniteRadiance(from, sample.wi) / sample.pdf;
    return true;
    default:
      break;
  }
  // By area.
  Vec3 position;
  Vec3 normal;
  float clearance = 0;
  float density = 1;
  if (emitter.spread >= 0) {
    const Vec2 place = SpreadOf(emitter).Sample(u1, u2, density);
    u1 = place.x;
    u2 = place.y;
  }
  PointOn(emitter, u1, u2, position, normal, clearance);
  const Vec3 outward = normal;
  const Vec3 to = position - from;
  const float distance2 = LengthSquared(to);
  if (!(distance2 > 0)) return false;
  sample.wi = to / std::sqrt(distance2);
  float cosine = -Dot(sample.wi, normal);
  if (emitter.two_sided && cosine < 0) {
    cosine = -cosine;
    normal = -normal;
  }
  if (!(cosine > 0)) return false;
  sample.is_distant = false;
  sample.target = position + normal * clearance;
  sample.pdf = choice * distance2 / (cosine * emitter.area);
  if (emitter.spread >= 0) sample.pdf *= density;
  sample.radiance_over_pdf =
      (emitter.spread >= 0 ? PictureRadiance(emitter, UvOn(emitter, u1, u2, position))
                           : emitter.radiance) /
      sample.pdf;
  if (emitter.is_masked) {
    sample.radiance_over_pdf *=
        ShareAt(emitter, {UvOn(emitter, u1, u2, position), position, outward});
  }
  if (emitter.is_invisible) sample.pdf = 0;
  return true;
}

Rgb LightSet::EmittedRadiance(const SurfacePoint& point, Vec3 wo) const {
  if (point.area_light == kNoAreaLight) return {};
  const AreaLight& light = scene_.area_lights[static_cast<std::size_t>(point.area_light)];
  if (!light.two_sided && !(Dot(point.geometric_normal, wo) > 0)) return {};
  if (light.picture == nullptr) return light.radiance;
  return light.radiance * PixelsAt(scene_, light, UvAt(scene_, point));
}

const AreaLight& LightSet::LightOf(const ShapeTraits& traits) const {
  return scene_.area_lights[static_cast<std::size_t>(traits.area_light)];
}

const ShapeTraits& LightSet::TraitsOf(const Emitter& emitter) const {
  switch (emitter.kind) {
#define LUCERNA_CASE(Name, list, name) \
  case Kind::k##Name:                  \
    return scene_.list[emitter.primitive].traits;
    LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
    default:
      return scene_.meshes[emitter.geometry].traits;
  }
}

float LightSet::ShareAt(const Emitter& emitter, const TexturePlace& place) const {
  return std::clamp(TextureNumber(scene_.textures, TraitsOf(emitter).alpha_texture, place), 0.0F,
                    1.0F);
}

float LightSet::MaskShare(const Emitter& emitter, int side) const {
  const auto along = [&](int i) {
    return (static_cast<float>(i) + 0.5F) / static_cast<float>(side);
  };
  double sum = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      Vec3 position;
      Vec3 normal;
      float clearance = 0;
      PointOn(emitter, along(x), along(y), position, normal, clearance);
      sum += static_cast<double>(
          ShareAt(emitter, {UvOn(emitter, along(x), along(y), position), position, normal}));
    }
  }
  // What was missed between the places has power too: checks of results allow for no more than
  // there is (EmissionCheck).
  const double places = static_cast<double>(side) * side;
  return static_cast<float>(std::min(1.0, sum / places * (1 + 2.0 / side) + 1 / places));
}

Rgb LightSet::PictureRadiance(const Emitter& emitter, Vec2 uv) const {
  return emitter.radiance * PixelsAt(scene_, LightOf(TraitsOf(emitter)), uv);
}

Vec2 LightSet::UvOn(const Emitter& emitter, float u1, float u2, Vec3 position) const {
  switch (emitter.kind) {
#define LUCERNA_CASE(Name, list, name) \
  case Kind::k##Name:                  \
    return UvOf(scene_.list[emitter.primitive], position);
    LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
    default:
      break;
  }
  float b1 = 0;
  float b2 = 0;
  SquareToTriangle(u1, u2, b1, b2);
  const std::array<Vec2, 3> uv = UvsOf(scene_.meshes[emitter.geometry], emitter.primitive);
  const float rest = 1 - b1 - b2;
  return {uv[0].x * rest + uv[1].x * b1 + uv[2].x * b2,
          uv[0].y * rest + uv[1].y * b1 + uv[2].y * b2};
}

float LightSet::SpreadAt(const Emitter& emitter, const SurfacePoint& point) const {
  switch (emitter.kind) {
#define LUCERNA_CASE(Name, list, name) \
  case Kind::k##Name:                  \
    return SpreadOf(emitter).Density(FaceNumbers(scene_.list[emitter.primitive], point.position));
    LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
    default:
      return SpreadOf(emitter).Density(TriangleToSquare(point.u, point.v));
  }
}

const Emitter* LightSet::EmitterOf(const SurfacePoint& point) const {
  if (point.area_light == kNoAreaLight || emitters_.empty()) return nullptr;
  std::int64_t number = -1;
  if (point.geometry < first_emitter_.size()) {
    number = first_emitter_[point.geometry] + point.primitive;
  } else {
    number = shape_emitter_[point.geometry - first_emitter_.size()][point.primitive];
  }
  return &emitters_[static_cast<std::size_t>(number)];
}

float LightSet::PdfDirect(const LitPoint& lit, const SurfacePoint& point) const {
  const Emitter* emitter = EmitterOf(point);
  if (emitter == nullptr) return 0;
  const Vec3 from = lit.position;
  const float choice = DirectChoice(*emitter, lit);
  if (emitter->kind != Kind::kTriangle && !emitter->is_seen_through) {
    const float inverse_pdf =
        VisitShape(scene_, KindOf(scene_, point.geometry), point.primitive,
                   [&](const auto& shape) { return SeenInversePdf(shape, from); });
    if (inverse_pdf > 0) return choice / inverse_pdf;
  }
  const Vec3 to = point.position - from;
  const float distance2 = LengthSquared(to);
  const float cosine = std::abs(Dot(to, point.geometric_normal)) / std::sqrt(distance2);
  if (!(cosine > 0)) return 0;
  const float pdf = choice * distance2 / (cosine * emitter->area);
  return emitter->spread >= 0 ? pdf * SpreadAt(*emitter, point) : pdf;
}

float LightSet::LargestRadiance() const {
  const float of_areas = emitters_.empty() ? 0 : largest_of_areas_;
  float from_infinity = 0;
  for (const auto& light : infinite_lights_)
    from_infinity += light->LargestRadiance();
  return std::max(of_areas, from_infinity);
}

float LightSet::AreaDensity(const Emitter& emitter) {
  return emitter.choice / (emitter.area * kPi * (emitter.two_sided ? 2.0F : 1.0F));
}

float LightSet::EmissionDensity(const SurfacePoint& point) const {
  const Emitter* emitter = EmitterOf(point);
  if (emitter == nullptr) return 0;
  const float density = AreaDensity(*emitter);
  return emitter->spread >= 0 ? density * SpreadAt(*emitter, point) : density;
}

bool LightSet::IsBehindPortal(std::uint32_t emitter, Vec3 landing) const {
  return infinite_lights_[emitters_[emitter].primitive]->Lights(landing);
}

float LightSet::EmissionDensityInfinite(Vec3 from, Vec3 direction) const {
  if (emitters_.empty()) return 0;
  float pdf = 0;
  for (std::size_t i = 0; i < infinite_lights_.size(); ++i)
    pdf += infinite_lights_[i]->PhotonDensity(from, direction,
                                              emitters_[first_infinite_ + i].choice, sphere_);
  return pdf / (kPi * sphere_.radius * sphere_.radius);
}

Rgb LightSet::InfiniteRadiance(Vec3 from, Vec3 direction) const {
  Rgb radiance;
  for (const auto& light : infinite_lights_)
    radiance += light->Radiance(from, direction);
  return radiance;
}

float LightSet::PdfDirectInfinite(const LitPoint& from, Vec3 direction) const {
  if (emitters_.empty()) return 0;
  float pdf = 0;
  for (std::size_t i = 0; i < infinite_lights_.size(); ++i) {
    pdf += infinite_lights_[i]->Density(from.position, direction,
                                        DirectChoice(emitters_[first_infinite_ + i], from));
  }
  return pdf;
}

}  // namespace lucerna
