// Which lights are there, how strong is each, and where does their light go?
//
// Every emitting triangle and analytic shape and every other light is one emitter; all emitters of
// a mesh are one light. Emitters are chosen in proportion to their power (luminance), so that all
// photons carry about the same flux, but for kEvenPhotonShare of the photons, which is even among
// the lights: a light with a millionth of the power is sampled all the same. With a single light
// there is no such share.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "render/frequency/spectrum.h"
#include "render/geometry/intersector.h"
#include "render/math/fixed_point.h"
#include "render/math/rgb.h"
#include "render/math/rng.h"
#include "render/math/vector.h"
#include "render/scene/scene.h"
#include "render/scene/shape_lists.h"
#include "render/transport/light_tree.h"
#include "render/transport/picture_spread.h"
#include "render/transport/primary_numbers.h"
#include "render/transport/unreachable_lights.h"

namespace lucerna {

// A photon as it leaves its light.
struct Emission {
  Ray ray;
  Rgb flux;  // [W]: of all photons together, so an estimate divides by their number
  std::uint32_t emitter = 0;  // number of the light, for LightSet::emitter
  // The density with which photons leave there, of all emitters that send some the same way
  // [choice × m⁻²·sr⁻¹, across the ray]; +infinity for delta lights.
  float density = 0;
};

enum class EmitterKind : std::uint8_t {
  kTriangle,
#define LUCERNA_KIND(Name, list, name) k##Name,
  LUCERNA_ANALYTIC_SHAPES(LUCERNA_KIND)  // scene/analytic_shapes.h
  LUCERNA_DELTA_LIGHTS(LUCERNA_KIND)     // scene/light_list.h
#undef LUCERNA_KIND
#define LUCERNA_KIND(Name, name) k##Name,
  LUCERNA_INFINITE_LIGHTS(LUCERNA_KIND)  // scene/infinite_light.h
#undef LUCERNA_KIND
};

// "triangle", "sphere", "point light".
[[nodiscard]] std::string_view NameOf(EmitterKind kind);

struct Emitter {
  EmitterKind kind = EmitterKind::kPoint;
  std::uint32_t geometry = 0;  // kTriangle: the mesh
  std::uint32_t primitive =
      0;  // triangle, or index among the shapes or lights of the kind, or the infinite lights
  bool two_sided = false;
  bool is_invisible = false;     // no ray finds it: only sampling and photons do
  bool is_seen_through = false;  // its far walls shine as well, through near ones
  bool is_masked = false;        // what it sends is multiplied by the texture of its shape's alpha
  float mask_share = 1;          // the mean of that texture, or a little more
  bool is_sampled = true;        // for direct light
  std::int32_t spread = -1;      // of an area light with a picture: index of its spread
  float area = 0;
  float choice = 0;           // probability for a photon: its share of the power
  float direct_choice = 0;    // probability for direct light, wherever it arrives
  std::uint32_t in_tree = 0;  // number in the tree of lights, if there is one
  Rgb radiance;               // or intensity, or irradiance, or what a picture is multiplied by
  Rgb power;
  const Uplift* uplift = nullptr;  // of the scene
  std::uint8_t light = 0;          // index into LightSet::lights()
};

// At most so many lights are counted one by one.
inline constexpr std::size_t kMaxLightGroups = 64;

// A light that sends photons.
struct LightGroup {
  EmitterKind kind = EmitterKind::kPoint;
  std::uint32_t emitters = 0;
  // More than 1: the faintest lights together, the other members but `power` are meaningless.
  std::uint32_t lights = 1;
  Rgb power;
  Vec3 position;  // of an area light its centre; at infinity, the direction its light travels in
  bool is_at_infinity = false;
  // The largest flux that one of its photons has, over their mean [luminance]: 1 where all photons
  // carry the same.
  float largest_share = 1;
};

// Light that arrives at a point from one emitter.
struct LightSample {
  Vec3 wi;                  // from the point to the light, unit
  bool is_distant = false;  // the light is at infinity
  Vec3 target;              // else: where the light comes from, just off the light's own surface
  Rgb radiance_over_pdf;  // [W·m⁻²·sr⁻¹ / (choice × solid angle)]; for delta lights irradiance
                          // on a plane facing the light, over the choice
  // choice × pdf_solid_angle [sr⁻¹]; 0 for lights that no ray finds, such as delta lights
  float pdf = 0;
  std::uint32_t emitter = 0;  // number of the light that was drawn
};

class InfiniteEmission;
struct EmissionNumbers;

// Around all shapes.
struct BoundingSphere {
  Vec3 center;
  float radius = 0;
};

class LightSet {
 public:
  // Keeps references to scene and intersector. Photons come from all lights, and direct light is
  // drawn from all, except those that `selection` leaves out.
  LightSet(const Scene& scene, const Intersector& intersector,
           const LightSelection& selection = {});

  // Takes over the colours of lights, and the scene's uplift, that have changed in the scene. How
  // lights are drawn, lights() and TotalPower() stay as they were.
  void TakeColors();

  [[nodiscard]] bool empty() const { return emitters_.empty(); }
  // How many emitters there are.
  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(emitters_.size()); }
  [[nodiscard]] const Emitter& emitter(std::uint32_t number) const { return emitters_[number]; }
  // [W] per channel, of all emitters.
  [[nodiscard]] Rgb TotalPower() const { return total_power_; }
  // [W·m⁻²·sr⁻¹] at least the largest channel that a ray can find, of all emitters.
  [[nodiscard]] float LargestRadiance() const;
  // The lights that send photons, in the order of their emitters, at most kMaxLightGroups; of more
  // lights the last entry stands for the faintest together.
  [[nodiscard]] const std::vector<LightGroup>& lights() const { return lights_; }
  // How many lights have less than kFaintShare of the power: their photons carry so far less than a
  // quantum (math/fixed_point.h) that hardly one of a billion adds anything. What they light
  // directly is right, and what that light lights is dark.
  [[nodiscard]] std::size_t faint_lights() const { return faint_lights_; }
  // Draws a photon. u_choice picks the emitter, in double because a light may have less than 2^-24
  // of the power; u_place and u_direction the rest. False when
  // the numbers give nothing (outside a spot's cone).
  [[nodiscard]] bool SampleEmission(double u_choice, float u_place1, float u_place2,
                                    float u_direction1, float u_direction2,
                                    Emission& emission) const;

  // With which numbers SampleEmission draws a photon of this emitter that leaves along `ray`,
  // about: the inverse, for guides (photon_guide.h). What the photon does not depend on is drawn
  // from `rng`. Of light from infinity the ray may begin anywhere on its line. Absent for emitters
  // that send no photons.
  [[nodiscard]] std::optional<PrimaryNumbers> NumbersOf(std::uint32_t emitter, const Ray& ray,
                                                        KeyedRng& rng) const;
  // The emitter at a point of a surface, if any.
  [[nodiscard]] std::optional<std::uint32_t> EmitterAt(const SurfacePoint& point) const;
  // Of the infinite lights the one that most likely sent a photon that came to `from` from
  // `direction`, if any.
  [[nodiscard]] std::optional<std::uint32_t> InfiniteEmitter(Vec3 from, Vec3 direction) const;
  // Whether a photon of this emitter that lands there first, or is scattered there, brings light:
  // not before it has come through its portal.
  [[nodiscard]] bool Lights(std::uint32_t emitter, Vec3 landing) const {
    return emitters_[emitter].kind != EmitterKind::kPortal || IsBehindPortal(emitter, landing);
  }

  // The spectrum of a photon of a delta light, absent for other emitters. `edge_strength`: see
  // frequency/bandwidth.h.
  [[nodiscard]] std::optional<Spectrum> DeltaSource(const Emission& emission, double edge_strength,
                                                    const SpectrumLimits& limits) const;

  // Draws light arriving at `from`, without a test whether anything is in the way: of several
  // emitters one by what each brings there, but for kShareAnywhere of the choice. False when the
  // drawn emitter sends nothing there.
  [[nodiscard]] bool SampleDirect(const LitPoint& from, double u_choice, float u1, float u2,
                                  LightSample& sample) const;

  // Radiance that `point` sends towards `wo`.
  [[nodiscard]] Rgb EmittedRadiance(const SurfacePoint& point, Vec3 wo) const;
  // The density with which SampleDirect, seen from `from`, draws the emitting `point`
  // [choice × sr⁻¹].
  [[nodiscard]] float PdfDirect(const LitPoint& from, const SurfacePoint& point) const;

  // The density with which photons leave `point`, in every direction into which it emits (see
  // Emission::density).
  [[nodiscard]] float EmissionDensity(const SurfacePoint& point) const;
  // The same of photons from infinity that travel against `direction` on the line through `from`.
  [[nodiscard]] float EmissionDensityInfinite(Vec3 from, Vec3 direction) const;

  // Radiance of all infinite lights that arrives at `from` from a direction in which no shape is.
  [[nodiscard]] Rgb InfiniteRadiance(Vec3 from, Vec3 direction) const;
  // The density with which SampleDirect draws a direction by any of them [choice × sr⁻¹].
  [[nodiscard]] float PdfDirectInfinite(const LitPoint& from, Vec3 direction) const;
  // [those that are not black], in the order of Emitter::primitive; see
  // transport/infinite_emission.h.
  [[nodiscard]] const std::vector<std::shared_ptr<InfiniteEmission>>& infinite_lights() const {
    return infinite_lights_;
  }

 private:
  using Kind = EmitterKind;

  // Fills in the choices of all emitters.
  void ShareOut();
  void PlantTree();
  [[nodiscard]] TreeLight InTree(const Emitter& emitter) const;
  // The probability with which SampleDirect draws it.
  [[nodiscard]] float DirectChoice(const Emitter& emitter, const LitPoint& from) const;
  // The same for a share `by_tree` of the tree's choices.
  [[nodiscard]] static float DirectChoice(const Emitter& emitter, float by_tree);
  // Light from one emitter over `choice`; see SampleDirect.
  [[nodiscard]] bool SampleEmitter(const Emitter& emitter, const LitPoint& from, float choice,
                                   float u1, float u2, LightSample& sample) const;
  // Fills in lights(), given for each emitter the light it belongs to and the power of each light.
  void GroupLights(const std::vector<std::size_t>& light_of,
                   const std::vector<double>& light_power);
  [[nodiscard]] Vec3 CentreOf(const Emitter& emitter) const;
  [[nodiscard]] float LargestShareOf(const Emitter& emitter) const;
  [[nodiscard]] const Emitter& Choose(const std::vector<double>& cumulative, double u) const;
  [[nodiscard]] const Emitter* EmitterOf(const SurfacePoint& point) const;
  [[nodiscard]] static float AreaDensity(const Emitter& emitter);
  [[nodiscard]] bool IsBehindPortal(std::uint32_t emitter, Vec3 landing) const;

  // Of emitters with a picture (transport/picture_spread.h):
  [[nodiscard]] const AreaLight& LightOf(const ShapeTraits& traits) const;
  [[nodiscard]] const ShapeTraits& TraitsOf(const Emitter& emitter) const;
  [[nodiscard]] const PictureSpread& SpreadOf(const Emitter& emitter) const {
    return spreads_[static_cast<std::size_t>(emitter.spread)];
  }
  [[nodiscard]] Rgb PictureRadiance(const Emitter& emitter, Vec2 uv) const;
  // Of masked emitters: the share of its light that one sends at a place, and Emitter::mask_share,
  // from `side` × `side` places.
  [[nodiscard]] float ShareAt(const Emitter& emitter, const TexturePlace& place) const;
  [[nodiscard]] float MaskShare(const Emitter& emitter, int side) const;
  // Texture coordinates of the place that PointOn draws with these numbers.
  [[nodiscard]] Vec2 UvOn(const Emitter& emitter, float u1, float u2, Vec3 position) const;
  // The share of the light at a point of the emitter, over its share of the area.
  [[nodiscard]] float SpreadAt(const Emitter& emitter, const SurfacePoint& point) const;
  // NumbersOf for emitters on shapes.
  [[nodiscard]] EmissionNumbers AreaNumbers(const Emitter& emitter, const Ray& ray) const;
  void PointOn(const Emitter& emitter, float u1, float u2, Vec3& position, Vec3& normal,
               float& clearance) const;

  const Scene& scene_;
  BoundingSphere sphere_;
  std::vector<Emitter> emitters_;
  std::vector<double> cumulative_, direct_cumulative_;  // [emitters] of the choices
  // Of the emitters that are sampled, where there are several.
  std::optional<LightTree> tree_;
  std::vector<std::uint32_t> of_tree_;  // [lights of the tree] emitters
  // [meshes]: number of the first emitter, or -1.
  std::vector<std::int64_t> first_emitter_;
  // [shapes of a kind]: number of its emitter, or -1.
  std::array<std::vector<std::int32_t>, kShapeKinds> shape_emitter_;
  Rgb total_power_;
  std::vector<std::shared_ptr<InfiniteEmission>> infinite_lights_;
  std::size_t first_infinite_ = 0;  // emitter of the first
  std::vector<LightGroup> lights_;
  std::size_t faint_lights_ = 0;
  std::vector<PictureSpread> spreads_;
  float largest_of_areas_ = 0;
};

// The share of direct light for which emitters are chosen by power, and evenly among lights,
// wherever it arrives: what the tree takes for the strongest light may be behind a wall.
inline constexpr float kShareAnywhere = 0.25F;
// The share of photons that is even among the lights of a scene with several.
inline constexpr double kEvenPhotonShare = 0.05;
// One billionth of a quantum, for which photons of about the whole power are made.
inline constexpr double kFaintShare = 1e-9 / (1 << kFluxBits);

}  // namespace lucerna
