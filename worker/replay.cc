#include "worker/replay.h"

#include <algorithm>
#include <utility>

#include "render/analysis/pass_time.h"
#include "render/analysis/prepared_scene.h"
#include "render/geometry/intersector.h"
#include "render/scene/shape_lists.h"
#include "render/wire/messages.h"
#include "worker/connection.h"
#include "worker/photon_path.h"
#include "worker/scene_cache.h"

namespace lucerna {
namespace {

// More than any job has; keeps the number of a photon within 64 bits.
constexpr std::uint64_t kMostPasses = std::uint64_t{1} << 24;

v1::Triple TripleOf(float x, float y, float z) {
  v1::Triple triple;
  triple.set_x(x);
  triple.set_y(y);
  triple.set_z(z);
  return triple;
}
v1::Triple TripleOf(Vec3 v) {
  return TripleOf(v.x, v.y, v.z);
}
v1::Triple TripleOf(Rgb c) {
  return TripleOf(c.r, c.g, c.b);
}

// A place as the scene's file has it.
v1::Triple PlaceOf(Vec3 position, const Scene& scene) {
  return TripleOf(position * static_cast<float>(scene.unit));
}

// " (room.pbrt:12)".
std::string InParentheses(const std::string& source) {
  return source.empty() ? "" : absl::StrCat(" (", source, ")");
}

std::string NameOf(const Emitter& light, const Scene& scene) {
  if (light.kind == EmitterKind::kTriangle) {
    return absl::StrCat("triangle ", light.primitive, " of mesh ", light.geometry,
                        InParentheses(scene.SourceOf(scene.meshes[light.geometry].traits)));
  }
  if (light.kind == EmitterKind::kInfinite) return "the even sky";
  const std::string name = absl::StrCat(std::string(NameOf(light.kind)), " ", light.primitive);
  switch (light.kind) {
#define LUCERNA_CASE(Name, list, name_of_kind) \
  case EmitterKind::k##Name:                   \
    return absl::StrCat(name, InParentheses(scene.SourceOf(scene.list[light.primitive].traits)));
    LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
    default:
      return name;
  }
}

std::string NameOfShape(const SurfacePoint& surface, const Scene& scene) {
  const TriangleMesh* const mesh = MeshOf(scene, surface.geometry);
  const std::string source = InParentheses(scene.SourceOf(
      mesh != nullptr ? mesh->traits
                      : VisitShape(scene, KindOf(scene, surface.geometry), surface.primitive,
                                   [](const auto& shape) { return shape.traits; })));
  if (surface.instance != kNoInstance) {
    return absl::StrCat("triangle ", surface.primitive, " of a mesh of instance ", surface.instance,
                        source);
  }
  if (mesh != nullptr) {
    return absl::StrCat("triangle ", surface.primitive, " of mesh ", surface.geometry, source);
  }
  return absl::StrCat(std::string(NameOf(KindOf(scene, surface.geometry))), " ", surface.primitive,
                      source);
}

v1::PhotonEnd EndToProto(PhotonEnd end) {
  switch (end) {
    case PhotonEnd::kNotEmitted:
      return v1::PHOTON_END_NOT_EMITTED;
    case PhotonEnd::kEscaped:
      return v1::PHOTON_END_ESCAPED;
    case PhotonEnd::kAbsorbed:
      return v1::PHOTON_END_ABSORBED;
    case PhotonEnd::kSmoothing:
      return v1::PHOTON_END_SMOOTHING;
    case PhotonEnd::kRoulette:
      return v1::PHOTON_END_ROULETTE;
    case PhotonEnd::kDepth:
      return v1::PHOTON_END_DEPTH;
    case PhotonEnd::kNotFinite:
      return v1::PHOTON_END_NOT_FINITE;
  }
  return v1::PHOTON_END_UNSPECIFIED;
}

v1::DepositFate FateOf(const PhotonLanding& landing) {
  if (landing.leaves_deposit) return v1::DEPOSIT_FATE_LEFT;
  if (!landing.gathers) return v1::DEPOSIT_FATE_NOT_GATHERED;
  return landing.is_indirect ? v1::DEPOSIT_FATE_TOO_BRIGHT : v1::DEPOSIT_FATE_DIRECT;
}

std::string ChosenIn(const PhotonLanding& landing) {
  if (landing.medium != kNoMedium) return "phase function";
  return absl::StrCat(!landing.has_narrow_lobes ? "diffuse "
                      : landing.is_smooth       ? "smooth "
                                                : "rough ",
                      landing.transmits ? "transmission" : "reflection");
}

v1::PhotonPath::Landing LandingToProto(const PhotonLanding& landing, const Scene& scene) {
  v1::PhotonPath::Landing message;
  if (landing.medium != kNoMedium) {
    const Medium& medium = scene.media[static_cast<std::size_t>(landing.medium)];
    message.set_shape(absl::StrCat("medium ", landing.medium));
    message.set_material(medium.name);
  } else {
    message.set_shape(NameOfShape(landing.surface, scene));
    message.set_material(absl::StrCat(landing.surface.material, " (",
                                      std::string(NameOf(landing.material_kind)), ")"));
  }
  message.set_distance(static_cast<double>(landing.distance) * scene.unit);
  *message.mutable_position() = PlaceOf(landing.surface.position, scene);
  *message.mutable_geometric_normal() = TripleOf(landing.surface.geometric_normal);
  *message.mutable_shading_normal() = TripleOf(landing.surface.shading_normal);
  *message.mutable_flux_arriving() = TripleOf(landing.arriving);
  if (landing.was_received) {
    *message.mutable_flux_landed() = TripleOf(landing.landed);
    message.set_deposit(FateOf(landing));
  }
  if (landing.was_scattered) {
    v1::PhotonPath::Landing::Scattering& scattering = *message.mutable_scattering();
    scattering.set_chosen(ChosenIn(landing));
    *scattering.mutable_direction() = TripleOf(landing.leaving);
    *scattering.mutable_flux() = TripleOf(landing.scattered);
    scattering.set_survival(landing.survival);
    scattering.set_survived(landing.went_on);
    *scattering.mutable_flux_leaving() =
        TripleOf(landing.went_on ? landing.leaving_flux : landing.scattered);
  }
  return message;
}

v1::PhotonPath PathToProto(const PhotonHistory& history, const PreparedScene& prepared) {
  const Scene& scene = prepared.scene();
  v1::PhotonPath path;
  path.set_end(EndToProto(history.end));
  if (history.end == PhotonEnd::kNotEmitted) return path;
  v1::PhotonPath::Emission& emission = *path.mutable_emission();
  emission.set_light(NameOf(prepared.lights().emitter(history.emission.emitter), scene));
  *emission.mutable_position() = PlaceOf(history.emission.ray.origin, scene);
  *emission.mutable_direction() = TripleOf(history.emission.ray.direction);
  *emission.mutable_flux() = TripleOf(history.emission.flux);
  path.set_wavelength_nm(static_cast<double>(history.wavelength_nm));
  for (const PhotonLanding& landing : history.landings)
    *path.add_landings() = LandingToProto(landing, scene);
  return path;
}

}  // namespace

StatusOr<v1::PhotonPaths> ReplayInScene(Scene rec709, const RenderSettings& settings,
                                        const SceneNeeds& needs, PhotonRange photons,
                                        std::uint64_t photons_per_pass, const PhotonGuide* guide) {
  if (photons.pass >= kMostPasses || photons.first >= photons_per_pass ||
      photons.count > photons_per_pass - photons.first) {
    return absl::OutOfRangeError(absl::StrCat(
        "there is no photon ", photons.pass, ":",
        photons.first + std::max<std::uint64_t>(photons.count, 1) - 1,
        ": passes count from 0, and the photons of each from 0 to ", photons_per_pass - 1));
  }
  PreparedScene prepared(std::move(rec709));
  LUCERNA_RETURN_IF_ERROR(
      prepared.PrepareFor(needs, TimeOfPass(prepared.scene().motion, settings.seed, photons.pass)));
  const PreparedScene::AtPass at_pass(prepared, settings.seed, photons.pass);
  const PhotonPathTracer tracer(prepared.scene(), prepared.intersector(), prepared.lights(),
                                settings, needs, nullptr, Bounds(), photons_per_pass, Bounds(),
                                guide);
  v1::PhotonPaths paths;
  for (std::uint64_t index = photons.first; index < photons.first + photons.count; ++index) {
    v1::PhotonPath& path = *paths.add_paths();
    path = PathToProto(tracer.Replay(photons.pass, index), prepared);
    path.mutable_key()->set_pass(photons.pass);
    path.mutable_key()->set_index(index);
  }
  return paths;
}

StatusOr<v1::PhotonPaths> Replay(const ReplayOptions& options) {
  Connection connection(Connection::Channels(options.server));
  if (!connection.WaitUntilConnected(options.connect_timeout)) {
    return absl::UnavailableError(absl::StrCat("no coordinator answers at ", options.server.address,
                                               "; is lucerna-server running there?"));
  }
  LUCERNA_ASSIGN_OR_RETURN(const v1::JobDescription job, connection.DescribeJob(options.job_id));
  if (job.numeric_profile() != options.numeric_profile) {
    return absl::FailedPreconditionError(
        absl::StrCat("this program has the numeric profile \"", options.numeric_profile,
                     "\" and the coordinator \"", job.numeric_profile(),
                     "\"; the photon would take another way, run the same build on both"));
  }
  LUCERNA_ASSIGN_OR_RETURN(const RenderSettings settings, FromProto(job.settings()));
  LUCERNA_ASSIGN_OR_RETURN(const SceneNeeds needs, FromProto(job.needs()));
  LUCERNA_ASSIGN_OR_RETURN(const SceneManifest manifest, FromProto(job.scene()));
  LUCERNA_ASSIGN_OR_RETURN(Scene scene,
                           FetchScene(manifest, [&](const Digest& digest, std::uint64_t max_bytes) {
                             return connection.Fetch(digest, max_bytes);
                           }));
  auto photons_per_pass = static_cast<std::uint64_t>(settings.photons_per_pass);
  for (const v1::PhotonStep& step : job.photon_steps()) {
    if (step.first_pass() <= options.pass) photons_per_pass = step.photons_per_pass();
  }
  LUCERNA_ASSIGN_OR_RETURN(const GuideSteps guides, FromProto(job.guides()));
  std::shared_ptr<const PhotonGuide> guide;
  for (const GuideStep& step : guides) {
    if (step.first_pass <= options.pass) guide = step.guide;
  }
  return ReplayInScene(std::move(scene), settings, needs,
                       {options.pass, options.index, options.count}, photons_per_pass, guide.get());
}

}  // namespace lucerna
