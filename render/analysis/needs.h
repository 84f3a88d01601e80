// Which parts of the renderer a job uses, and why.
//
// Derived once from the scene and the settings, when a job is submitted; workers get the result
// with their leases. A part that is not used costs nothing: no memory, no bytes on the wire, no
// branch in a loop over photons. With `use_everything` all parts that can run without being needed
// are used, for comparison: the image is the same within its noise, and to the bit where the
// arithmetic is the same.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "render/geometry/intersector.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"
#include "render/transport/unreachable_lights.h"

namespace lucerna {

enum class Part : std::uint8_t {
  kPhotons,            // photon passes at all
  kSpecular,           // eye and photon paths through smooth and nearly smooth surfaces
  kGlossy,             // BSDF columns of hitpoints
  kCausticHitpoints,   // photons through smooth surfaces, gathered where eye paths go on
  kShadingNormals,     // vertex normals, and the horizon they bend
  kTextures,           // look-ups of materials
  kRoundShapes,        // spheres and disks beside triangles
  kEnvironment,        // sampling of environment lights
  kAreaLights,         // emission of shapes, and scattered rays that find it
  kDeltaLights,        // points, spots, parallel light
  kUnreachableLights,  // photons whose light never reaches what the camera can see
  kDirectSampling,     // direct light by samples, in place of photons
  kPhotonDirections,   // where photons came from, for glossy hitpoints
  kPhotonNormals,      // what keeps photons on their side of a thin wall
  kRobustRays,         // rays that do not slip through the edges of triangles
  kSplitTriangles,     // a tree of higher build quality: large triangles are in it more than once
  kLens,               // depth of field
  kFreshEyePaths,      // new eye paths in every pass, in place of a cycle of sample sets
  kFrequency,          // frequency photons
  kOccluderEdges,      // edges that photons pass, for their shadows' borders
  kCurvature,          // the bend of surfaces that light falls on
  kCurvedMirrors,      // second-order states at curved mirrors and glass
  kTextureDetail,      // the spectrum of textures
  kSkyDetail,          // the spectrum of environment maps
  kGlossyWindow,       // what a glossy lobe hides of the spectrum
  kMotion,
  kMedia,
  kAlphaMasks,
  kInstances,   // a second level of the acceleration structure
  kDispersion,  // a wavelength for each path
  kSpectra,     // three wavelengths for each pass
};
inline constexpr std::size_t kPartCount = static_cast<std::size_t>(Part::kSpectra) + 1;

[[nodiscard]] constexpr std::array<Part, kPartCount> AllParts() {
  std::array<Part, kPartCount> parts{};
  for (std::size_t i = 0; i < kPartCount; ++i)
    parts[i] = static_cast<Part>(i);
  return parts;
}

// Its name in reports: "shading-normals".
[[nodiscard]] std::string_view NameOf(Part part);

class SceneNeeds {
 public:
  SceneNeeds() = default;
  // As workers get them, without reasons: the parts that are used, bit by bit.
  SceneNeeds(std::uint64_t parts, int eye_sample_sets, UnreachableLights lights)
      : eye_sample_sets_(eye_sample_sets), lights_(std::move(lights)) {
    for (std::size_t i = 0; i < kPartCount; ++i)
      entries_[i].is_used = (parts >> i & 1) != 0;
  }
  [[nodiscard]] std::uint64_t parts() const {
    std::uint64_t parts = 0;
    for (std::size_t i = 0; i < kPartCount; ++i)
      parts |= static_cast<std::uint64_t>(entries_[i].is_used) << i;
    return parts;
  }

  [[nodiscard]] bool Uses(Part part) const { return entries_[Index(part)].is_used; }
  // A sentence: why it is used, or why not.
  [[nodiscard]] const std::string& ReasonOf(Part part) const {
    return entries_[Index(part)].reason;
  }

  // For needs that come without reasons.
  void GiveReason(Part part, std::string reason) {
    entries_[Index(part)].reason = std::move(reason);
  }

  // How many sets of eye paths there are, used in turn; 0: each pass has its own.
  [[nodiscard]] int eye_sample_sets() const { return eye_sample_sets_; }
  // Empty when Part::kUnreachableLights and Part::kDirectSampling are forced.
  [[nodiscard]] const UnreachableLights& unreachable_lights() const { return lights_; }
  [[nodiscard]] LightSelection lights() const { return {lights_, Uses(Part::kUnreachableLights)}; }
  [[nodiscard]] RayNeeds rays() const {
    return {Uses(Part::kRobustRays), Uses(Part::kSplitTriangles), Uses(Part::kShadingNormals)};
  }

  bool operator==(const SceneNeeds&) const = default;

 private:
  friend class NeedsFinder;
  struct Entry {
    bool is_used = false;
    std::string reason;
    bool operator==(const Entry&) const = default;
  };
  static constexpr std::size_t Index(Part part) { return static_cast<std::size_t>(part); }
  void Set(Part part, bool is_used, std::string reason) {
    entries_[Index(part)] = {is_used, std::move(reason)};
  }

  std::array<Entry, kPartCount> entries_;
  int eye_sample_sets_ = 0;
  UnreachableLights lights_;
};

[[nodiscard]] SceneNeeds NeedsOf(const Scene& scene, const RenderSettings& settings);

// How many passes use the same sets before new ones are drawn. With fewer the sets would hardly be
// worth keeping; without new ones the edges of shapes would never get smoother.
inline constexpr std::uint64_t kRoundsOfSets = 16;

// Which set of eye paths a pass uses, of all there will ever be; even where the pass is. Each time
// around the sets take turns in another order: the photons of passes are parts of a low-discrepancy
// sequence, of which every 64th would bring photons of the same parts of a light to a set.
// Requires 0 or a power of two.
[[nodiscard]] constexpr std::uint64_t EyeSetOf(std::uint64_t pass, int sets) {
  if (sets == 0) return pass;
  const auto n = static_cast<std::uint64_t>(sets);
  const std::uint64_t round = pass / n;
  // Pairs change places with those that differ from them in the digits of the round.
  const std::uint64_t turn = (pass % n) ^ (2 * (round % kRoundsOfSets) % n);
  return round / kRoundsOfSets * n + turn;
}

// Of how many of the sets what the camera's rays meet first is kept, kFirstHitBytes for each ray
// and kMostFirstHitBytes at most (tracing/first_hits.h).
inline constexpr std::size_t kFirstHitBytes = 4;
inline constexpr std::size_t kMostFirstHitBytes = std::size_t{64} << 20U;
[[nodiscard]] constexpr std::size_t KeptSets(int sets, std::size_t pixels) {
  return std::min(static_cast<std::size_t>(sets),
                  kMostFirstHitBytes / (kFirstHitBytes * std::max<std::size_t>(pixels, 1)));
}

}  // namespace lucerna
