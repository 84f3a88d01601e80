#include "render/transport/subsurface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "render/base/parallel.h"
#include "render/base/shared_values.h"
#include "render/math/warp.h"
#include "render/transport/bsdf.h"
#include "render/transport/material_at.h"
#include "render/transport/media.h"
#include "render/transport/microfacet.h"

namespace lucerna {
namespace {

// Depths of sources below a surface, for each distance.
constexpr int kDepths = 100;
// The share of light within the radius that is probed. What lies beyond is spread over what lies
// within.
constexpr float kProbed = 0.999F;
// Surfaces of the material along one probe, among which one is chosen. More are a fault of the
// scene.
constexpr int kMostAlongProbe = 256;

// Means of the Fresnel reflectance over cosines of light that meets the surface from inside, times
// the cosine and its square.
struct Moments {
  double first = 0, second = 0;
};
Moments MomentsInside(double ior) {
  constexpr int kSteps = 4096;
  Moments moments;
  for (int i = 0; i < kSteps; ++i) {
    const double cosine = (i + 0.5) / kSteps;
    float cos_t = 0;
    const auto reflected = static_cast<double>(
        FresnelDielectric(static_cast<float>(cosine), 1 / static_cast<float>(ior), cos_t));
    moments.first += reflected * cosine / kSteps;
    moments.second += reflected * cosine * cosine / kSteps;
  }
  return moments;
}

// Depths of sources along a beam in a medium of extinction 1, each of as much light.
std::array<double, kDepths> SourceDepths() {
  std::array<double, kDepths> depths{};
  for (int i = 0; i < kDepths; ++i)
    depths[static_cast<std::size_t>(i)] = -std::log(1 - (i + 0.5) / kDepths);
  return depths;
}

// Of a flux of 1 that goes straight down into a half space of extinction 1, what comes out per area
// at a distance r > 0, of light that was scattered once, over the albedo: where it can leave the
// surface without total reflection (Habel et al. 2013, section 4).
double ScatteredOnce(double ior, float g, double r) {
  static const std::array<double, kDepths> kSources = SourceDepths();
  const double critical = r * std::sqrt(ior * ior - 1);
  double sum = 0;
  for (const double depth : kSources) {
    const double z = critical + depth;
    const double distance = std::sqrt(r * r + z * z);
    const double cosine = z / distance;
    float cos_t = 0;
    const auto reflected = static_cast<double>(
        FresnelDielectric(static_cast<float>(cosine), 1 / static_cast<float>(ior), cos_t));
    const auto phase = static_cast<double>(PhaseHenyeyGreenstein(static_cast<float>(-cosine), g));
    sum +=
        std::exp(-(distance + critical)) / (distance * distance) * phase * (1 - reflected) * cosine;
  }
  return sum / kDepths;
}

// The same of light that was scattered often: diffusion from sources along the beam, each with its
// mirror image above the surface (section 3).
class ScatteredOften {
 public:
  ScatteredOften(const Moments& inside, double g, double albedo) {
    const double absorption = 1 - albedo;
    const double scattering = albedo * (1 - g);  // reduced
    extinction_ = absorption + scattering;
    // Grosjean's diffusion coefficient (d'Eon & Irving 2011, section 4).
    diffusion_ = (2 * absorption + scattering) / (3 * extinction_ * extinction_);
    falloff_ = std::sqrt(absorption / diffusion_);
    mirrored_depth_ = -2 * diffusion_ * (1 + 3 * inside.second) / (1 - 2 * inside.first);
    const double share = scattering / extinction_;
    factor_ = share * share / (4 * kPi64 * kDepths);
    of_fluence_ = 0.25 * (1 - 2 * inside.first);
    of_flux_ = 0.5 * (1 - 3 * inside.second);
  }

  [[nodiscard]] double At(double r) const {
    static const std::array<double, kDepths> kSources = SourceDepths();
    if (!(factor_ > 0)) return 0;
    double sum = 0;
    for (const double depth : kSources) {
      const double z = depth / extinction_;
      const double mirrored = -z + 2 * mirrored_depth_;
      const double to_source = std::sqrt(r * r + z * z);
      const double to_mirrored = std::sqrt(r * r + mirrored * mirrored);
      const double fade = std::exp(-falloff_ * to_source);
      const double fade_mirrored = std::exp(-falloff_ * to_mirrored);
      const double fluence = (fade / to_source - fade_mirrored / to_mirrored) / diffusion_;
      const double flux =
          z * (1 + falloff_ * to_source) * fade / (to_source * to_source * to_source) -
          mirrored * (1 + falloff_ * to_mirrored) * fade_mirrored /
              (to_mirrored * to_mirrored * to_mirrored);
      // Near the beam diffusion says too much.
      const double near = 1 - std::exp(-2 * extinction_ * (to_source + z));
      sum += near * (fluence * of_fluence_ + flux * of_flux_);
    }
    return factor_ * sum;
  }

 private:
  double extinction_ = 1, diffusion_ = 1, falloff_ = 0;
  double mirrored_depth_ = 0, of_fluence_ = 0, of_flux_ = 0, factor_ = 0;
};

// Whether the surface that a probe meets belongs to the material, alone or in a mix.
bool IsOf(const Scene& scene, std::uint32_t met, std::uint32_t material) {
  if (met == material) return true;
  const Material& mix = scene.materials[met];
  return mix.kind == Material::Kind::kMix && std::ranges::any_of(mix.mixed, [&](std::int32_t part) {
           return IsOf(scene, static_cast<std::uint32_t>(part), material);
         });
}

// One channel of R around a point, in scene units, cut off at the radius that is probed.
struct Profile {
  const SubsurfaceTable* table = nullptr;
  SubsurfaceTable::Mix mix;
  float reflectance = 0;  // of the mix
  float extinction = 0;   // [1/length]
  float widest = 0;       // radius that is probed [length]

  // R over the reflectance [1/area], at the distance or at the projection of a point that is at
  // `distance`.
  [[nodiscard]] float At(float r, float distance) const {
    if (!(distance <= widest) || widest == 0) return 0;
    const float least = 0.1F * SubsurfaceTable::kFirstNode;
    const float optical = std::max(r * extinction, least);
    return table->Density(mix, optical) * extinction * extinction /
           (2 * kPi * optical * kProbed * reflectance);
  }
};

}  // namespace

SubsurfaceTable MakeSubsurfaceTable(float ior, float g) {
  constexpr std::size_t kRows = SubsurfaceTable::kRows;
  constexpr std::size_t kNodes = SubsurfaceTable::kNodes;
  SubsurfaceTable table;
  table.nodes.push_back(0);
  for (std::size_t i = 1; i < kNodes; ++i)
    table.nodes.push_back(i == 1 ? SubsurfaceTable::kFirstNode
                                 : table.nodes.back() * SubsurfaceTable::kGrowth);
  // At no distance light that was scattered once has a density above 0.
  const auto distance = [&](std::size_t node) {
    return static_cast<double>(table.nodes[std::max<std::size_t>(node, 1)]);
  };
  std::array<double, kNodes> once{};
  for (std::size_t node = 0; node < kNodes; ++node)
    once[node] = ScatteredOnce(static_cast<double>(ior), g, distance(node));
  const Moments inside = MomentsInside(static_cast<double>(ior));
  // Denser where the reflectance grows fastest, next to an albedo of 1.
  constexpr double kDenser = 8;
  for (std::size_t row = 0; row < kRows; ++row) {
    const double albedo =
        -std::expm1(-kDenser * static_cast<double>(row) / (kRows - 1)) / -std::expm1(-kDenser);
    const ScatteredOften often(inside, static_cast<double>(g), albedo);
    table.albedos.push_back(static_cast<float>(albedo));
    double sum = 0;
    double before = 0;
    for (std::size_t node = 0; node < kNodes; ++node) {
      const double r = distance(node);
      const double density = std::max(2 * kPi64 * r * (albedo * once[node] + often.At(r)), 0.0);
      if (node > 0) {
        sum += 0.5 * (before + density) *
               static_cast<double>(table.nodes[node] - table.nodes[node - 1]);
      }
      before = density;
      table.densities.push_back(static_cast<float>(density));
      table.cumulatives.push_back(static_cast<float>(sum));
    }
    table.reflectances.push_back(static_cast<float>(sum));
  }
  return table;
}

void PrepareSubsurface(std::vector<Material>& materials, int threads) {
  using Key = std::pair<float, float>;
  const auto key_of = [](const Material& material) { return Key(material.ior, material.phase_g); };
  static SharedValues<Key, SubsurfaceTable> shared;
  std::map<Key, std::shared_ptr<const SubsurfaceTable>> tables;
  std::vector<std::pair<Key, SubsurfaceTable*>> wanted;
  for (const Material& material : materials) {
    if (material.kind != Material::Kind::kSubsurface) continue;
    const Key key = key_of(material);
    auto& table = tables[key];
    if (table == nullptr) table = shared.Find(key);
    if (table != nullptr) continue;
    const auto made = std::make_shared<SubsurfaceTable>();
    wanted.emplace_back(key, made.get());
    table = made;
  }
  if (tables.empty()) return;
  ThreadTeam(threads).For(wanted.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      *wanted[i].second = MakeSubsurfaceTable(wanted[i].first.first, wanted[i].first.second);
  });
  for (const auto& [key, table] : tables)
    shared.Share(key, table);
  for (Material& material : materials) {
    if (material.kind != Material::Kind::kSubsurface) continue;
    const std::shared_ptr<const SubsurfaceTable>& table = tables[key_of(material)];
    material.owned_below = table;
    material.below = table.get();
    if (material.scatters_for_reflectance) continue;
    material.extinction = material.absorption + material.scattering;
    const auto reflectance = [&](float absorbed, float scattered) {
      // The model gives back up to 3 % more than enters where hardly anything is absorbed.
      return scattered > 0
                 ? std::min(table->ReflectanceOf(scattered / (absorbed + scattered)), 1.0F)
                 : 0.0F;
    };
    material.reflectance = {reflectance(material.absorption.r, material.scattering.r),
                            reflectance(material.absorption.g, material.scattering.g),
                            reflectance(material.absorption.b, material.scattering.b)};
  }
}

bool SampleBelow(const Scene& scene, const Intersector& intersector, const Material& material,
                 const SurfacePoint& surface, Vec3 wo, float u_axis, float u_radius, float u_turn,
                 float u_choice, LeftBelow& left, int& rays) {
  std::array<Profile, 3> profiles;
  std::size_t count = 0;
  std::array<std::size_t, 3> with_light{};
  // Channels that leave nearer than rounding, where they entered: they have no width.
  constexpr float kClearances = 8;
  std::size_t count_at_point = 0;
  Rgb at_point;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    Profile& profile = profiles[channel];
    profile.table = material.below;
    profile.mix = material.below->MixOf(material.reflectance[static_cast<int>(channel)]);
    profile.reflectance = material.below->Cumulative(profile.mix, SubsurfaceTable::kNodes - 1);
    profile.extinction = material.extinction[static_cast<int>(channel)];
    if (!(profile.reflectance > 0) || !(profile.extinction > 0)) continue;
    profile.widest = material.below->RadiusWithin(profile.mix, kProbed * profile.reflectance) /
                     profile.extinction;
    with_light[count++] = channel;
    if (profile.widest > kClearances * surface.clearance) continue;
    profile.widest = 0;
    ++count_at_point;
    at_point +=
        {channel == 0 ? 1.0F : 0.0F, channel == 1 ? 1.0F : 0.0F, channel == 2 ? 1.0F : 0.0F};
  }
  if (count == 0) return false;
  const float side = Dot(wo, surface.geometric_normal) < 0 ? -1.0F : 1.0F;

  // An axis to probe along. On a plane only those along the normal find light, on round and small
  // shapes the others do too: with 0.6 no shape from a free path to a plane has much more noise
  // than with its best share (docs/decisions/subsurface.md).
  const Frame frame(surface.geometric_normal);
  const std::array<Vec3, 3> axes = {frame.s, frame.t, frame.n};
  constexpr std::array<float, 3> kAxisShares = {0.2F, 0.2F, 0.6F};
  std::size_t axis = 0;
  float rest = u_axis;
  while (axis < 2 && rest >= kAxisShares[axis])
    rest -= kAxisShares[axis++];
  rest /= kAxisShares[axis];
  // A channel, and a radius of it.
  const auto drawn =
      std::min(static_cast<std::size_t>(rest * static_cast<float>(count)), count - 1);
  const Profile& of_channel = profiles[with_light[drawn]];
  if (of_channel.widest == 0) {
    left.surface = surface;
    left.up = surface.shading_normal * side;
    left.weight = at_point * (static_cast<float>(count) / static_cast<float>(count_at_point));
    return true;
  }
  const float radius =
      of_channel.table->RadiusWithin(of_channel.mix, u_radius * kProbed * of_channel.reflectance) /
      of_channel.extinction;
  const float half = std::sqrt(std::max(Square(of_channel.widest) - Square(radius), 0.0F));
  const float turn = 2 * kPi * u_turn;
  const Vec3 across = axes[(axis + 1) % 3] * (radius * std::cos(turn)) +
                      axes[(axis + 2) % 3] * (radius * std::sin(turn));
  int met = 0;
  const Vec3 direction = -axes[axis];
  Ray ray = {surface.position + across + axes[axis] * half, direction, 2 * half};
  for (int i = 0; i < kMostAlongProbe; ++i) {
    Hit hit;
    ++rays;
    if (!intersector.Intersect(ray, hit)) break;
    const SurfacePoint found = intersector.SurfaceAt(ray, hit);
    if (IsOf(scene, found.material, surface.material)) {
      ++met;
      // One of all of them: the n-th takes the place of the one before with probability 1/n.
      const float chance = 1 / static_cast<float>(met);
      if (u_choice < chance) {
        left.surface = found;
        u_choice /= chance;
      } else {
        u_choice = (u_choice - chance) / (1 - chance);
      }
      u_choice = std::min(u_choice, 0x1.fffffep-1F);
    }
    const Vec3 next = LeavingPoint(found, direction);
    const float passed = Dot(next - ray.origin, direction);
    if (!(passed < ray.t_max)) break;
    ray = {next, direction, ray.t_max - passed};
  }
  if (met == 0) return false;

  // The density of the point, over all axes and channels that might have been drawn.
  const Vec3 way = left.surface.position - surface.position;
  const float distance = Length(way);
  float density = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const float projected =
        std::sqrt(std::max(LengthSquared(way) - Square(Dot(way, axes[i])), 0.0F));
    float of_channels = 0;
    for (std::size_t c = 0; c < count; ++c)
      of_channels += profiles[with_light[c]].At(projected, distance);
    density += kAxisShares[i] * std::abs(Dot(left.surface.geometric_normal, axes[i])) *
               of_channels / static_cast<float>(count);
  }
  if (!(density > 0)) return false;
  const auto weight = [&](std::size_t channel) {
    const Profile& profile = profiles[channel];
    return profile.widest > 0 ? profile.At(distance, distance) * static_cast<float>(met) / density
                              : 0.0F;
  };
  left.weight = {weight(0), weight(1), weight(2)};
  left.surface.material = surface.material;
  std::optional<Material> storage;
  (void)MaterialAt(scene, left.surface, wo, storage);
  left.up = left.surface.shading_normal * side;
  return true;
}

}  // namespace lucerna
