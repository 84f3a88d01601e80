// What photons carry away must be counted to the last unit, whatever becomes of them; a photon that
// is not finite must be counted and named; and a replay must take the way that the photon took.
#include "worker/photon_path.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/formats/read_scene.h"
#include "tests/support/memory_files.h"
#include "tests/support/test_scenes.h"
#include "worker/replay.h"

namespace lucerna {
namespace {

constexpr Bounds kEverywhere{{-HUGE_VALF, -HUGE_VALF, -HUGE_VALF},
                             {HUGE_VALF, HUGE_VALF, HUGE_VALF}};

// A tracer of a scene, with all that it refers to.
struct Traced {
  explicit Traced(Scene s, int max_depth = 6, const Bounds& region = kEverywhere,
                  const PhotonGuide* guide = nullptr)
      : scene(std::move(s)),
        settings(TestSettings(scene, 20000, 0.1, max_depth)),
        intersector(Intersector::Create(scene).value()),
        lights(scene, *intersector),
        tracer(scene, *intersector, lights, settings, NeedsOf(scene, settings), nullptr, region, 0,
               Bounds(), guide) {}

  [[nodiscard]] PhotonPathTracer::Landed Trace(std::uint64_t photons,
                                               std::uint64_t pass = 0) const {
    PhotonPathTracer::Landed landed;
    for (std::uint64_t index = 0; index < photons; ++index)
      tracer.Trace(pass, index, landed);
    return landed;
  }

  Scene scene;
  RenderSettings settings;
  std::unique_ptr<Intersector> intersector;
  LightSet lights;
  PhotonPathTracer tracer;
};

// An open box with a light, glass, rough metal, and a floor whose shading normals are bent.
Scene OpenBox(float reflectance = 0.7F) {
  Scene scene;
  const std::int32_t white = AddMaterial(scene, DiffuseMaterial(reflectance));
  const std::int32_t glass = AddMaterial(scene, DielectricMaterial(1.5F));
  const std::int32_t metal =
      AddMaterial(scene, ConductorMaterial(Gray(0.2F), {3, 2, 1}, 0.4F, 0.3F));
  AddQuad(scene, {-1, -1, -1}, {2, 0, 0}, {0, 2, 0}, white);
  for (int i = 0; i < 4; ++i) {
    scene.meshes.back().normals.push_back(
        Normalize({i % 2 == 0 ? -0.9F : 0.9F, i < 2 ? -0.9F : 0.9F, 1}));
  }
  AddQuad(scene, {-1, -1, -1}, {0, 2, 0}, {0, 0, 2}, white);
  AddSphere(scene, {0.4F, 0.4F, -0.5F}, 0.3F, glass);
  AddSphere(scene, {-0.4F, -0.4F, -0.5F}, 0.3F, metal);
  AddDisk(scene, {0, 0, 1}, {0, 0, -1}, 0.5F, white, AddAreaLight(scene, 10));
  return scene;
}

TEST(PhotonEnergyTest, BalancesToTheUnitWithEveryAccountInUse) {
  const Traced traced(OpenBox());
  const PhotonPathTracer::Landed landed = traced.Trace(20000);
  const EnergyCounters& energy = landed.energy;
  EXPECT_TRUE(energy.Balance());
  EXPECT_NE(energy.absorbed, 0);
  EXPECT_NE(energy.escaped, 0);
  EXPECT_NE(energy.roulette_loss, 0);
  EXPECT_NE(energy.roulette_gain, 0);
  EXPECT_NE(energy.smoothing, 0);
  EXPECT_NE(energy.cut_off, 0);
  EXPECT_EQ(energy.dropped, 0);
  EXPECT_EQ(landed.dropped, 0U);
}

// All photons of the one light carry its whole power, so each is counted as 2^kEnergyBits: that is
// the unit, and half of it is the rounding of one photon.
TEST(PhotonEnergyTest, CountsInShareOfTheScenesPower) {
  const Traced traced(OpenBox());
  EXPECT_EQ(traced.Trace(1000).energy.emitted, std::int64_t{1000} << kEnergyBits);
}

// In a closed box of reflectance rho every landing takes 1 - rho of what comes, and roulette only
// moves power from photon to photon.
TEST(PhotonEnergyTest, TellsHowMuchWallsAbsorb) {
  constexpr float kRho = 0.6F;
  constexpr int kDepth = 5;
  Scene scene;
  const std::int32_t white = AddMaterial(scene, DiffuseMaterial(kRho));
  AddBox(scene, {-1, -1, -1}, {1, 1, 1}, white);
  scene.point_lights.push_back({{0.1F, 0.2F, 0.3F}, Gray(1)});
  const Traced traced(scene, kDepth);
  constexpr std::uint64_t kPhotons = 20000;
  const EnergyCounters energy = traced.Trace(kPhotons).energy;
  EXPECT_TRUE(energy.Balance());
  const double emitted = static_cast<double>(energy.emitted);
  // Alive at the last landing: rho^4 of the photons, each with its first flux; five standard
  // deviations of that binomial.
  const double alive = std::pow(kRho, kDepth - 1);
  const double bound = 5 * std::sqrt(alive * (1 - alive) / kPhotons);
  EXPECT_NEAR(static_cast<double>(energy.cut_off) / emitted, alive, bound);
  EXPECT_EQ(energy.escaped, 0);
  // Absorbed at each landing but the last, by what arrives there: (1 - rho) (1 + rho + rho² + rho³)
  // = 1 - rho^4 of it on average. The number of arrivals has a variance below that of a geometric
  // distribution, 1 / (1 - rho)², so what they take of one photon has one below 1.
  EXPECT_NEAR(static_cast<double>(energy.absorbed) / emitted, 1 - alive,
              5 / std::sqrt(static_cast<double>(kPhotons)));
}

// A guide that sends most first scatterings of one half of space up and to one side.
PhotonGuide ScatteringGuide() {
  using Kind = ScatterGuide::Node::Kind;
  return PhotonGuide::Create({}, 0,
                             std::make_shared<const ScatterGuide>(
                                 ScatterGuide::Create({{.kind = Kind::kX, .place = 0},
                                                       {.kind = Kind::kU, .low_share = 230},
                                                       {.kind = Kind::kV, .low_share = 20},
                                                       {},
                                                       {},
                                                       {},
                                                       {}})
                                     .value()))
      .value();
}

// Light is where it was, energy balances, and the photons that stand for all of a job without a
// guide are distributed as those would be.
TEST(GuidedScatteringTest, ChangesNoMeanAndMarksWhatStandsForAll) {
  Scene scene;
  const std::int32_t gray = AddMaterial(scene, DiffuseMaterial(0.9F));
  AddBox(scene, {-1, -1, -1}, {1, 1, 1}, gray);
  scene.point_lights.push_back({{-0.4F, 0.2F, 0.3F}, Gray(1)});
  const PhotonGuide guide = ScatteringGuide();
  const Traced even(scene, 3);
  const Traced guided(scene, 3, kEverywhere, &guide);
  constexpr std::uint64_t kPhotons = 40000;
  const PhotonPathTracer::Landed of_even = even.Trace(kPhotons);
  const PhotonPathTracer::Landed of_guided = guided.Trace(kPhotons);
  EXPECT_TRUE(of_guided.energy.Balance());
  EXPECT_EQ(of_guided.energy.emitted, of_even.energy.emitted);
  // The first two landings absorb 1 - 0.9² of what is emitted, of a photon at most twice its flux:
  // what the guide gives and takes is booked as a roulette's.
  EXPECT_NEAR(static_cast<double>(of_guided.energy.absorbed) /
                  static_cast<double>(of_guided.energy.emitted),
              0.19, 5 * 2 / std::sqrt(kPhotons));
  // By octant of the landing: the sum of fluxes, and of their squares; marked photons and those
  // that may be reported.
  struct Octant {
    double flux = 0, squares = 0, unguided = 0, reportable = 0, expected = 0;
  };
  const auto of_each = static_cast<double>(of_even.deposits.rows[0].flux.g);  // without a guide
  const auto by_octant = [&guide, of_each](const PhotonPathTracer::Landed& landed) {
    std::array<Octant, 8> octants;
    for (const Deposit& deposit : landed.deposits.rows) {
      const Vec3 p = deposit.position;
      Octant& octant = octants[(p.x > 0 ? 1 : 0) + (p.y > 0 ? 2 : 0) + (p.z > 0 ? 4 : 0)];
      const auto flux = static_cast<double>(deposit.flux.g);
      octant.flux += flux;
      octant.squares += flux * flux;
      octant.expected += guide.ReportableShare(flux / of_each);
      const DepositSource source = DepositSource::Unpacked(deposit.source);
      octant.unguided += source.is_unguided ? 1 : 0;
      octant.reportable += source.is_reportable ? 1 : 0;
    }
    return octants;
  };
  const std::array<Octant, 8> a = by_octant(of_even);
  const std::array<Octant, 8> b = by_octant(of_guided);
  double changed = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    // A photon leaves at most two deposits.
    const double error = 5 * std::sqrt(2 * (a[i].squares + b[i].squares));
    EXPECT_NEAR(a[i].flux, b[i].flux, error) << i;
    EXPECT_NEAR(b[i].unguided, (1 - kGuidedScatterings) * a[i].unguided,
                5 * std::sqrt(2 * a[i].unguided))
        << i;
    EXPECT_NEAR(b[i].reportable, b[i].expected, 5 * std::sqrt(2 * b[i].expected)) << i;
    changed = std::max(changed, b[i].squares / a[i].squares);
  }
  EXPECT_GT(changed, 1.2) << "the guide changes fluxes";
  EXPECT_NEAR(static_cast<double>(of_guided.sent[0]), (1 - kGuidedScatterings) * kPhotons,
              5 * std::sqrt(kPhotons) / 2);
}

TEST(GuidedScatteringTest, IsReplayed) {
  const PhotonGuide guide = ScatteringGuide();
  const Traced guided(OpenBox(), 6, kEverywhere, &guide);
  const Traced even(OpenBox());
  int others = 0;
  for (std::uint64_t index = 0; index < 2000; ++index) {
    PhotonPathTracer::Landed landed;
    guided.tracer.Trace(7, index, landed);
    const PhotonHistory history = guided.tracer.Replay(7, index);
    std::size_t deposits = 0;
    for (const PhotonLanding& landing : history.landings) {
      if (!landing.leaves_deposit) continue;
      ASSERT_LT(deposits, landed.deposits.size());
      ASSERT_EQ(landing.landed, landed.deposits.rows[deposits].flux);
      ++deposits;
    }
    ASSERT_EQ(deposits, landed.deposits.size());
    others += history.landings.size() != even.tracer.Replay(7, index).landings.size() ? 1 : 0;
  }
  EXPECT_GT(others, 30);
}

TEST(PhotonPathTest, NamesPhotonsThatAreNotFinite) {
  Scene scene = OpenBox();
  // A ball that reflects what is not a number.
  scene.materials[1] = DiffuseMaterial(NAN);
  const Traced traced(scene);
  const PhotonPathTracer::Landed landed = traced.Trace(5000, 3);
  ASSERT_GT(landed.dropped, kDroppedNamed);
  ASSERT_EQ(landed.dropped_photons.size(), kDroppedNamed);
  EXPECT_TRUE(landed.energy.Balance());
  EXPECT_NE(landed.energy.dropped, 0);
  std::uint64_t found = 0;
  for (std::uint64_t index = 0; found < kDroppedNamed; ++index) {
    if (traced.tracer.Replay(3, index).end != PhotonEnd::kNotFinite) continue;
    EXPECT_EQ(landed.dropped_photons[found], index);
    ++found;
  }
}

// A landing with more than 2^15 times the scene's power has no room in the sums.
TEST(PhotonPathTest, CountsLandingsThatAreTooBright) {
  Scene scene = OpenBox();
  // A mirror that gives back a million times what comes.
  scene.materials[1] = DiffuseMaterial(1e6F);
  scene.materials[2] = DiffuseMaterial(1e6F);
  const Traced traced(scene);
  const PhotonPathTracer::Landed landed = traced.Trace(5000);
  EXPECT_GT(landed.excess, 0U);
  EXPECT_EQ(landed.dropped, 0U);
  EXPECT_TRUE(landed.energy.Balance());
  const FluxScale scale = FluxScale::ForPower(traced.lights.TotalPower());
  for (const Deposit& deposit : landed.deposits.rows)
    ASSERT_TRUE(scale.HasRoomFor(deposit.flux));
}

TEST(PhotonPathTest, DropsAPhotonThatIsBornInfinite) {
  Scene scene = OpenBox();
  const Traced traced(scene);
  scene.area_lights[0].radiance = Gray(HUGE_VALF);
  const Traced infinite(scene);
  const PhotonPathTracer::Landed landed = infinite.Trace(10);
  EXPECT_EQ(landed.dropped, 10U);
  EXPECT_TRUE(landed.deposits.rows.empty());
  EXPECT_EQ(traced.Trace(10).dropped, 0U);
}

// Straight down on a plane: what the surface reflects and, of the rest, the reflectance leave it,
// however far from where they entered.
TEST(PhotonPathTest, LeavesASubsurfacePlaneByItsReflectance) {
  constexpr float kReflectance = 0.8F;
  Scene scene;
  AddQuad(scene, {-9, -9, 0}, {18, 0, 0}, {0, 18, 0},
          AddMaterial(scene, SubsurfaceMaterial(kReflectance, 0.01F)));
  scene.spot_lights.push_back({{0, 0, 2}, {0, 0, -1}, Gray(1), 0.9999F, 0.999F});
  const Traced traced(scene);
  const EnergyCounters energy = traced.Trace(40000).energy;
  EXPECT_TRUE(energy.Balance());
  float cos_t = 0;
  const float reflected = FresnelDielectric(1, 1.5F, cos_t);
  // A standard deviation of a photon of about 0.9; six of them of the mean.
  EXPECT_NEAR(static_cast<double>(energy.escaped) / static_cast<double>(energy.emitted),
              static_cast<double>(reflected + (1 - reflected) * kReflectance), 6 * 0.9 / 200);
}

TEST(PhotonReplayTest, LeavesTheDepositsThatTheTraceLeft) {
  const Traced traced(OpenBox());
  for (std::uint64_t index = 0; index < 2000; ++index) {
    PhotonPathTracer::Landed landed;
    traced.tracer.Trace(7, index, landed);
    const PhotonHistory history = traced.tracer.Replay(7, index);
    std::size_t deposits = 0;
    for (const PhotonLanding& landing : history.landings) {
      if (!landing.leaves_deposit) continue;
      ASSERT_LT(deposits, landed.deposits.size());
      ASSERT_EQ(landing.surface.position, landed.deposits.rows[deposits].position);
      ASSERT_EQ(landing.landed, landed.deposits.rows[deposits].flux);
      ++deposits;
    }
    ASSERT_EQ(deposits, landed.deposits.size());
  }
}

// A replay knows no hitpoints: where they are must not turn a photon.
// A deposit has the columns that the job needs, row for row.
TEST(PhotonPathTest, KeepsWhatIsAskedForOfADeposit) {
  const auto columns = [](const Scene& scene) {
    const PhotonPathTracer::Landed landed = Traced(scene).Trace(1000);
    const Deposits& deposits = landed.deposits;
    EXPECT_GT(deposits.size(), 20U);
    EXPECT_TRUE(deposits.normals.empty() || deposits.normals.size() == deposits.size());
    EXPECT_TRUE(deposits.arrivals_oct.empty() || deposits.arrivals_oct.size() == deposits.size());
    EXPECT_TRUE(deposits.traces.empty());
    return std::pair(!deposits.normals.empty(), !deposits.arrivals_oct.empty());
  };
  Scene floor;
  AddQuad(floor, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, AddMaterial(floor, DiffuseMaterial(0.7F)));
  AddSphere(floor, {0, 0, 0.5F}, 0.4F, AddMaterial(floor, DielectricMaterial(1.5F)));
  AddDisk(floor, {0, 0, 2}, {0, 0, -1}, 1, AddMaterial(floor, DiffuseMaterial(0)),
          AddAreaLight(floor, 10));
  SetCamera(floor, {0, -2, 1}, {0, 0, 0}, {0, 0, 1}, 60, 8);
  EXPECT_EQ(columns(floor), std::pair(false, false));
  floor.materials[2] = DiffuseMaterial(0.5F);
  EXPECT_EQ(columns(floor), std::pair(true, false)) << "the emitter gathers too";
  EXPECT_EQ(columns(OpenBox()), std::pair(true, true));
}

TEST(PhotonReplayTest, DoesNotDependOnWhereDepositsAreKept) {
  const Traced everywhere(OpenBox());
  const Traced nowhere(OpenBox(), 6, Bounds());
  for (std::uint64_t index = 0; index < 500; ++index) {
    const PhotonHistory a = everywhere.tracer.Replay(0, index);
    const PhotonHistory b = nowhere.tracer.Replay(0, index);
    ASSERT_EQ(a.end, b.end);
    ASSERT_EQ(a.landings.size(), b.landings.size());
    for (std::size_t i = 0; i < a.landings.size(); ++i) {
      ASSERT_EQ(a.landings[i].surface.position, b.landings[i].surface.position);
    }
  }
  EXPECT_EQ(everywhere.Trace(500).rays, nowhere.Trace(500).rays);
  EXPECT_EQ(nowhere.Trace(500).deposits.size(), 0U);
}

// Numbers of photons do not wrap within the largest job that can be asked for.
TEST(PhotonReplayTest, TellsPhotonsApartBeyondTwoToTheFiftyThird) {
  Traced traced(OpenBox());
  traced.settings.photons_per_pass = 1'000'000'000'000;
  const std::uint64_t last = 999'999'999'999;
  const auto place = [&](std::uint64_t pass, std::uint64_t index) {
    return traced.tracer.Replay(pass, index).emission.ray.origin;
  };
  const std::uint64_t far = (std::uint64_t{1} << 24) - 2;  // photon 8.4e18 of its sequence
  EXPECT_NE(place(far, last), place(far, last - 1));
  EXPECT_NE(place(far, last), place(far - 2, last));
  EXPECT_NE(place(far, last), place(0, last));
}

TEST(PhotonReplayTest, TellsEveryStepOfAMirroredPhoton) {
  Scene scene;
  const std::int32_t mirror =
      AddMaterial(scene, ConductorMaterial(Gray(1), Gray(AbsorptionFor(0.5F)), 0, 0));
  AddQuad(scene, {-10, -10, 0}, {20, 0, 0}, {0, 20, 0}, mirror);
  scene.spot_lights.push_back({{0, 0, 2}, {0, 0, -1}, Gray(1), 0.9999F, 0.9998F});
  scene.materials.push_back({});
  const RenderSettings settings = TestSettings(scene, 100, 0.1, 4);
  const auto photons = static_cast<std::uint64_t>(settings.photons_per_pass);
  const auto paths = ReplayInScene(scene, settings, NeedsOf(scene, settings), {0, 5, 1}, photons);
  ASSERT_TRUE(paths.ok()) << paths.status();
  ASSERT_EQ(paths->paths_size(), 1);
  const v1::PhotonPath* const path = &paths->paths(0);
  EXPECT_EQ(path->emission().light(), "spot light 0");
  EXPECT_EQ(path->emission().position().z(), 2);
  ASSERT_EQ(path->landings_size(), 1);
  const v1::PhotonPath::Landing& landing = path->landings(0);
  EXPECT_EQ(landing.material(), "0 (conductor)");
  EXPECT_NEAR(landing.distance(), 2, 1e-3) << "the cone is 1.2 degrees wide";
  EXPECT_EQ(landing.position().z(), 0);
  EXPECT_EQ(landing.deposit(), v1::DEPOSIT_FATE_NOT_GATHERED);
  EXPECT_EQ(landing.scattering().chosen(), "smooth reflection");
  EXPECT_NEAR(landing.scattering().survival(), 0.5, 1e-3);
  EXPECT_EQ(landing.scattering().direction().z(), -path->emission().direction().z());
  EXPECT_EQ(path->end(),
            landing.scattering().survived() ? v1::PHOTON_END_ESCAPED : v1::PHOTON_END_ROULETTE);

  const auto is_out_of_range = [&](std::uint64_t pass, std::uint64_t index) {
    return absl::IsOutOfRange(
        ReplayInScene(scene, settings, NeedsOf(scene, settings), {pass, index, 1}, photons)
            .status());
  };
  EXPECT_TRUE(is_out_of_range(0, 100));
  EXPECT_TRUE(is_out_of_range(std::uint64_t{1} << 60, 0));
  EXPECT_TRUE(absl::IsOutOfRange(
      ReplayInScene(scene, settings, NeedsOf(scene, settings), {0, 98, 3}, photons).status()));

  // Each of several is the one that is traced alone.
  const auto several = ReplayInScene(scene, settings, NeedsOf(scene, settings), {0, 3, 4}, photons);
  ASSERT_TRUE(several.ok()) << several.status();
  ASSERT_EQ(several->paths_size(), 4);
  EXPECT_EQ(several->paths(2).key().index(), 5U);
  EXPECT_EQ(several->paths(2).SerializeAsString(), path->SerializeAsString());
  EXPECT_NE(several->paths(1).emission().SerializeAsString(), path->emission().SerializeAsString());
}

TEST(PhotonReplayTest, NamesShapesByTheirLinesAndPlacesAsTheFileHasThem) {
  // So small that it is rendered in a unit of its own.
  MemoryFiles files({{"s.pbrt",
                      "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\n"
                      "LookAt 0 0 3e-9 0 0 0 0 1 0\n"
                      "Camera \"perspective\"\n"
                      "WorldBegin\n"
                      "Include \"floor.pbrt\"\n"
                      "AttributeBegin\n"
                      "  AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n"
                      "  Translate 0 0 2e-9\n"
                      "  ReverseOrientation\n"
                      "  Shape \"disk\" \"float radius\" 1e-9\n"
                      "AttributeEnd\n"},
                     {"floor.pbrt",
                      "Material \"diffuse\"\n"
                      "Shape \"bilinearmesh\" \"point3 P\" [-9e-8 -9e-8 0 9e-8 -9e-8 0 -9e-8 9e-8 "
                      "0 9e-8 9e-8 0]\n"}});
  ParsedScene parsed = ReadScene(files, "s.pbrt");
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  ASSERT_NE(parsed.scene.unit, 1) << "the scene does not test what it is for";
  const RenderSettings settings = TestSettings(parsed.scene, 100, 0.1, 4);
  const SceneNeeds needs = NeedsOf(parsed.scene, settings);
  const auto paths = ReplayInScene(std::move(parsed.scene), settings, needs, {0, 0, 20}, 100);
  ASSERT_TRUE(paths.ok()) << paths.status();
  int landings = 0;
  for (const v1::PhotonPath& path : paths->paths()) {
    EXPECT_EQ(path.emission().light(), "disk 0 (s.pbrt:10)");
    EXPECT_NEAR(path.emission().position().z(), 2e-9, 1e-15);
    if (path.landings_size() == 0) continue;
    EXPECT_THAT(path.landings(0).shape(),
                testing::MatchesRegex("triangle [0-9]+ of mesh 0 \\(floor.pbrt:2\\)"));
    EXPECT_GE(path.landings(0).distance(), 2e-9 * (1 - 1e-6));
    EXPECT_LT(path.landings(0).distance(), 1e-6);
    ++landings;
  }
  EXPECT_GT(landings, 10);
}

}  // namespace
}  // namespace lucerna
