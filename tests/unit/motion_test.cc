// What moves in pbrt files is where it must be at each time, and nothing else moves.
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/analysis/needs.h"
#include "render/analysis/pass_time.h"
#include "render/analysis/prepared_scene.h"
#include "render/analysis/reachability.h"
#include "render/analysis/scene_memory.h"
#include "render/formats/read_scene.h"
#include "render/scene/scene_at_time.h"
#include "render/scene/scene_extent.h"
#include "tests/support/memory_files.h"
#include "worker/replay.h"

namespace lucerna {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

ParsedScene Parse(const std::string& before_world, const std::string& world) {
  std::map<std::string, std::string> files;
  files["s.pbrt"] = before_world + " WorldBegin LightSource \"infinite\"\n" + world;
  MemoryFiles all(std::move(files));
  return ReadScene(all, "s.pbrt");
}

const std::string kCamera = "Camera \"perspective\"";

Scene Read(const std::string& before_world, const std::string& world) {
  ParsedScene parsed = Parse(before_world, world);
  EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
  return std::move(parsed.scene);
}
Scene World(const std::string& world) {
  return Read(kCamera, world);
}

std::string Said(const std::string& before_world, const std::string& world) {
  std::string all;
  for (const Diagnostic& diagnostic : Parse(before_world, world).diagnostics)
    all += diagnostic.ToString() + "\n";
  return all;
}

Scene At(const Scene& scene, double time) {
  Scene moved = scene;
  SceneMover(scene).MoveTo(time, moved);
  return moved;
}

void ExpectClose(Vec3 a, Vec3 b) {
  EXPECT_LT(Length(a - b), 2e-6F) << a.x << " " << a.y << " " << a.z << ", not " << b.x << " "
                                  << b.y << " " << b.z;
}

Vec3 CenterAt(const Scene& scene, double time) {
  return At(scene, time).spheres.at(0).center;
}

const std::string kSphere = "Shape \"sphere\" ";
const std::string kToRight = "ActiveTransform EndTime Translate 4 0 0 ActiveTransform All ";

TEST(MotionTest, StartsAndEndsWhereTheTwoTransformsSay) {
  const Scene scene = World(
      "Translate 1 0 0 ActiveTransform StartTime Translate 0 2 0 ActiveTransform EndTime "
      "Translate 4 0 0 ActiveTransform All Translate 0 0 3 " +
      kSphere);
  ASSERT_EQ(scene.motion.of_shapes.size(), 1U);
  EXPECT_EQ(scene.spheres.at(0).center, Vec3(1, 2, 3));
  ExpectClose(CenterAt(scene, 0), {1, 2, 3});
  ExpectClose(CenterAt(scene, 0.25), {2, 1.5, 3});
  ExpectClose(CenterAt(scene, 1), {5, 0, 3});
}

TEST(MotionTest, EndsWithItsScope) {
  const Scene scene =
      World("AttributeBegin " + kToRight + kSphere + "AttributeEnd " + kSphere +
            "AttributeBegin ActiveTransform EndTime AttributeEnd Translate 1 1 1 " + kSphere);
  EXPECT_EQ(scene.spheres.at(0).traits.motion, 0);
  EXPECT_EQ(scene.spheres.at(1).traits.motion, kNoMotion);
  // The choice of what is active ended too.
  EXPECT_EQ(scene.spheres.at(2).traits.motion, kNoMotion);
  EXPECT_EQ(At(scene, 1).spheres.at(1).center, Vec3());
}

TEST(MotionTest, IdentityAndTransformChangeWhatIsActive) {
  const Scene one = World(kToRight +
                          "ActiveTransform StartTime Transform [1 0 0 0 0 1 0 0 0 0 1 0 "
                          "0 6 0 1] " +
                          kSphere);
  ExpectClose(CenterAt(one, 0.5), {2, 3, 0});
  const Scene other = World(kToRight + "ActiveTransform EndTime Identity " + kSphere);
  EXPECT_FALSE(other.motion.Moves());
}

// Both transforms are named, and both come back, whichever is active, as in pbrt-v4.
TEST(MotionTest, CoordinateSystemsMove) {
  const Scene scene = World("AttributeBegin " + kToRight +
                            "CoordinateSystem \"c\" AttributeEnd ActiveTransform StartTime "
                            "CoordSysTransform \"c\" " +
                            kSphere);
  ExpectClose(CenterAt(scene, 0.5), {2, 0, 0});
}

TEST(MotionTest, WorldBeginStandsStill) {
  const Scene scene = Read("ActiveTransform EndTime Translate 0 0 -2 " + kCamera, kSphere);
  EXPECT_EQ(scene.spheres.at(0).traits.motion, kNoMotion);
  ASSERT_TRUE(scene.motion.of_camera.has_value());
  ExpectClose(At(scene, 0.5).camera.camera_to_world.Point({}), {0, 0, 1});
  const Scene after =
      Read("ActiveTransform EndTime Translate 0 0 -2 " + kCamera, "Translate 1 0 0 " + kSphere);
  EXPECT_EQ(after.spheres.at(0).traits.motion, kNoMotion) << "both are active after WorldBegin";
  // The camera's space moves with it.
  const Scene with = Read("ActiveTransform EndTime Translate 0 0 -2 " + kCamera,
                          "CoordSysTransform \"camera\" " + kSphere);
  ExpectClose(CenterAt(with, 0.5), {0, 0, 1});
}

TEST(MotionTest, TakesItsOwnTimes) {
  const std::string shutter =
      "TransformTimes 2 6 Camera \"perspective\" \"float shutteropen\" 3 \"float shutterclose\" 4";
  const Scene scene = Read(shutter, kToRight + kSphere);
  // It stands where it is when the shutter opens.
  ExpectClose(scene.spheres.at(0).center, {1, 0, 0});
  ExpectClose(CenterAt(scene, 3.5), {1.5, 0, 0});
  ExpectClose(CenterAt(scene, 4), {2, 0, 0});
  EXPECT_EQ(scene.film.exposure, 1);
  // What moves before the shutter opens or after it closes stands still.
  for (const std::string times : {"TransformTimes 2 3 ", "TransformTimes 4 5 "}) {
    const Scene still =
        Read(times + "Camera \"perspective\" \"float shutteropen\" 3 \"float shutterclose\" 4",
             kToRight + kSphere);
    EXPECT_FALSE(still.motion.Moves()) << times;
    ExpectClose(still.spheres.at(0).center, {times == "TransformTimes 2 3 " ? 4.0F : 0.0F, 0, 0});
  }
}

TEST(MotionTest, SaysWhatIsWrong) {
  EXPECT_THAT(Said("TransformTimes 1 1 " + kCamera, kSphere),
              HasSubstr("the second must be later"));
  EXPECT_THAT(Said(kCamera, "TransformTimes 0 1 " + kSphere),
              HasSubstr("TransformTimes must come before WorldBegin"));
  EXPECT_THAT(
      Said("Camera \"perspective\" \"float shutteropen\" 1 \"float shutterclose\" 0.5", kSphere),
      HasSubstr("must be after shutteropen"));
  EXPECT_THAT(Said(kCamera, "ActiveTransform Start " + kSphere),
              HasSubstr("ActiveTransform takes StartTime, EndTime or All"));
  EXPECT_THAT(Said(kCamera, "ActiveTransform EndTime Scale 0 1 1 " + kSphere),
              HasSubstr("this motion is not possible: the transformation cannot be inverted"));
  EXPECT_THAT(Said(kCamera, "ActiveTransform EndTime Scale -1 1 1 " + kSphere),
              HasSubstr("one mirrors and the other does not"));
  EXPECT_THAT(Said(kCamera,
                   "ActiveTransform EndTime Translate 3e38 0 0 Scale 2 2 2 Translate 3e38 "
                   "0 0 " +
                       kSphere),
              HasSubstr("leaves single precision while the shutter is open"));
}

TEST(MotionTest, LightsAndTexturesStandStill) {
  const std::string said =
      Said(kCamera, kToRight + "LightSource \"point\" AttributeBegin AreaLightSource \"diffuse\" " +
                        kSphere + "AttributeEnd Texture \"t\" \"spectrum\" \"checkerboard\"");
  EXPECT_THAT(said, HasSubstr("warning: lights do not move"));
  EXPECT_THAT(said, HasSubstr("warning: shapes that emit do not move"));
  EXPECT_THAT(said, HasSubstr("warning: textures do not move"));
  EXPECT_THAT(said, Not(HasSubstr("error")));
  const Scene scene =
      World(kToRight + "LightSource \"point\" AreaLightSource \"diffuse\" " + kSphere);
  EXPECT_FALSE(scene.motion.Moves());
  EXPECT_EQ(scene.point_lights.at(0).position, Vec3());
}

// One that is a ball at one end alone has no kind of its own between the two.
TEST(MotionTest, ASphereThatIsStretchedIsAMesh) {
  const Scene scene = World("ActiveTransform EndTime Scale 1 2 1 " + kSphere);
  ASSERT_TRUE(scene.spheres.empty());
  const Bounds at_half = BoundsOf([&] {
    Scene then = At(scene, 0.5);
    ForgetMotion(then);
    return then;
  }());
  EXPECT_NEAR(at_half.high.y, 1.5, 1e-3);
  EXPECT_NEAR(at_half.high.x, 1, 1e-3);
  const Scene grows = World("ActiveTransform EndTime Scale 2 2 2 " + kSphere);
  EXPECT_NEAR(At(grows, 0.5).spheres.at(0).radius, 1.5, 1e-6);
}

TEST(MotionTest, InstancesMoveAndTheirPartsWithin) {
  const std::string object =
      "ObjectBegin \"o\" AttributeBegin ActiveTransform EndTime Translate 0 2 0 ActiveTransform "
      "All "
      "Translate 1 0 0 " +
      kSphere + "AttributeEnd " + kSphere + "ObjectEnd ";
  const Scene scene = World(object +
                            "Rotate 90 0 0 1 ActiveTransform EndTime Scale 3 3 3 ActiveTransform "
                            "All ObjectInstance \"o\"");
  ASSERT_EQ(scene.spheres.size(), 2U);
  const Scene half = At(scene, 0.5);
  // Scaled by 2, turned: (1, 1, 0) goes to (-2, 2, 0).
  ExpectClose(half.spheres[0].center, {-2, 2, 0});
  EXPECT_NEAR(half.spheres[0].radius, 2, 1e-6);
  ExpectClose(half.spheres[1].center, {});
  EXPECT_NEAR(half.spheres[1].radius, 2, 1e-6);
  // Where no instance stands, nothing moves.
  EXPECT_FALSE(World(object).motion.Moves());
}

TEST(MotionTest, SharedObjectsMoveAsAWhole) {
  const std::string object =
      "ObjectBegin \"o\" Shape \"loopsubdiv\" \"integer levels\" 5 \"point3 P\" [1 0 0 -1 0 0 0 1 "
      "0 "
      "0 -1 0 0 0 1 0 0 -1] \"integer indices\" [0 2 4 2 1 4 1 3 4 3 0 4 2 0 5 1 2 5 3 1 5 0 3 5] "
      "ObjectEnd ";
  std::string copies;
  for (int i = 0; i < 130; ++i)
    copies += "AttributeBegin Translate " + std::to_string(5 * i) + " 0 0 " +
              (i % 2 == 0 ? "ActiveTransform EndTime Translate 0 7 0 " : "") +
              "ObjectInstance \"o\" AttributeEnd\n";
  const Scene scene = World(object + copies);
  ASSERT_EQ(scene.instances.size(), 130U);
  EXPECT_TRUE(scene.meshes.empty());
  const Scene half = At(scene, 0.5);
  for (const Instance& instance : half.instances) {
    const Vec3 place = instance.to_world.Point({});
    EXPECT_NEAR(place.y, std::fmod(place.x, 10) < 1 ? 3.5 : 0, 1e-5) << place.x;
  }
  // Needs count them, and no light is called unreachable because of them.
  const SceneNeeds needs = NeedsOf(scene, RenderSettings());
  EXPECT_EQ(needs.ReasonOf(Part::kMotion), "shapes that move: 65");
}

const std::string kManyMotions =
    "Translate 3 1 -2 AttributeBegin ActiveTransform EndTime Rotate 150 1 2 3 ActiveTransform All "
    "Translate 2 0 0 Shape \"sphere\" \"float radius\" .4 Shape \"disk\" Shape \"trianglemesh\" "
    "\"point3 P\" [0 0 0 1 0 0 0 1 0] \"normal N\" [0 0 1 0 1 1 0 0 1] Shape \"curve\" \"point3 "
    "P\" "
    "[0 0 0 1 0 0 1 1 0 2 1 0] \"float width\" .1 AttributeEnd AttributeBegin ActiveTransform "
    "EndTime Translate -9 2 1 Scale 1 3 .5 Rotate 80 0 1 0 ActiveTransform All Shape \"curve\" "
    "\"point3 P\" [0 0 0 1 0 0 1 1 0 2 1 0] \"float width\" .3 Shape \"trianglemesh\" \"point3 P\" "
    "[0 0 0 1 0 0 0 1 0] AttributeEnd";

// What depends on the size of a scene must not change between passes: photons of the sky are aimed
// at it, and their power is counted in units that follow from it.
TEST(MotionTest, TheExtentIsTheSameAtAllTimes) {
  const Scene scene = World(kManyMotions);
  ASSERT_EQ(scene.motion.of_shapes.size(), 2U);
  const Bounds all = BoundsOf(scene);
  for (int step = 0; step <= 1000; ++step) {
    const Scene then = At(scene, step / 1000.0);
    const Bounds box = BoundsOf(then);
    ASSERT_TRUE(box.low == all.low && box.high == all.high) << step;
    Scene alone = then;
    ForgetMotion(alone);
    const Bounds own = BoundsOf(alone);
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_GT(own.low[axis], scene.motion.swept.low[axis]) << step;
      ASSERT_LT(own.high[axis], scene.motion.swept.high[axis]) << step;
    }
  }
  PreparedScene prepared(scene);
  const SceneNeeds needs = NeedsOf(scene, RenderSettings());
  ASSERT_TRUE(prepared.PrepareFor(needs).ok());
  const float power = prepared.lights().TotalPower().r;
  for (const double time : {0.0, 0.3, 1.0}) {
    ASSERT_TRUE(prepared.PrepareFor(needs, time).ok());
    EXPECT_EQ(prepared.lights().TotalPower().r, power);
  }
}

// The top of the arc lies between two of the times at which the box is known.
TEST(MotionTest, TheExtentHoldsArcs) {
  const Scene scene = World(
      "ActiveTransform EndTime Rotate 150 0 0 1 ActiveTransform All Shape \"trianglemesh\" "
      "\"point3 P\" [2 0 0 1.99 0 0 2 0 .01]");
  float highest = 0;
  for (int step = 0; step <= 1000; ++step) {
    const Scene then = At(scene, step / 1000.0);
    for (const Vec3 position : then.meshes.at(0).positions)
      highest = std::max(highest, position.y);
  }
  EXPECT_NEAR(highest, 2, 1e-4);
  EXPECT_LT(highest, scene.motion.swept.high.y);
  EXPECT_LT(scene.motion.swept.high.y, 2.1) << "no larger than it must be";
}

// A worker sees passes in any order.
TEST(MotionTest, AMomentDoesNotDependOnTheOneBefore) {
  const Scene scene = World(kManyMotions);
  const SceneMover mover(scene);
  Scene moved = scene;
  for (const double time : {0.7, 0.2, 0.0, 0.9, 0.2}) {
    mover.MoveTo(time, moved);
    const Scene fresh = At(scene, time);
    for (std::size_t i = 0; i < moved.meshes.size(); ++i) {
      EXPECT_EQ(moved.meshes[i].positions, fresh.meshes[i].positions);
      EXPECT_EQ(moved.meshes[i].normals, fresh.meshes[i].normals);
    }
    EXPECT_EQ(moved.spheres[0].center, fresh.spheres[0].center);
    EXPECT_EQ(moved.curve_pieces[0].from, fresh.curve_pieces[0].from);
    EXPECT_EQ(moved.disks[0].normal, fresh.disks[0].normal);
  }
  mover.MoveTo(0, moved);
  EXPECT_EQ(moved.meshes[0].positions, scene.meshes[0].positions) << "to the bit as it opens";
}

TEST(MotionTest, MovesAsFarInAnotherUnit) {
  const std::string big = "Scale 1e30 1e30 1e30 ";
  const Scene scene = Read(big + kCamera, big + kToRight + kSphere);
  ASSERT_NE(scene.unit, 1);
  const float unit = static_cast<float>(1e30 / scene.unit);
  EXPECT_NEAR(CenterAt(scene, 0.5).x / unit, 2, 1e-5);
  EXPECT_GE(scene.motion.swept.high.x / unit, 5);
  EXPECT_LT(scene.motion.swept.high.x / unit, 5.5);
}

// Sets of eye paths that take turns would find what is no longer there.
TEST(MotionTest, NeedsNewEyePathsInEachPass) {
  const std::string floor =
      "Shape \"trianglemesh\" \"point3 P\" [-9 -9 5 9 -9 5 0 9 5] LightSource \"point\" ";
  const SceneNeeds still = NeedsOf(World(floor), RenderSettings());
  EXPECT_FALSE(still.Uses(Part::kMotion));
  EXPECT_GT(still.eye_sample_sets(), 0);
  const SceneNeeds moving = NeedsOf(World(floor + kToRight + floor), RenderSettings());
  EXPECT_TRUE(moving.Uses(Part::kMotion));
  EXPECT_TRUE(moving.Uses(Part::kFreshEyePaths));
  EXPECT_EQ(moving.eye_sample_sets(), 0);
  EXPECT_TRUE(moving.Uses(Part::kPhotonNormals)) << "what moves may leave the floor";
}

// A shell around the camera proves that the light outside is not seen, unless one of them moves.
TEST(MotionTest, WhatMovesProvesNothing) {
  const std::string ball = "Material \"diffuse\" Shape \"sphere\" \"float radius\" 3 ";
  const std::string box =
      "Material \"diffuse\" Shape \"trianglemesh\" \"point3 P\" [-3 -3 -3 3 -3 -3 3 3 -3 -3 3 -3 "
      "-3 "
      "-3 3 3 -3 3 3 3 3 -3 3 3] \"integer indices\" [0 2 1 0 3 2 4 5 6 4 6 7 0 1 5 0 5 4 1 2 6 1 "
      "6 "
      "5 2 3 7 2 7 6 3 0 4 3 4 7] ";
  const std::string light = "AttributeBegin Translate 9 0 0 LightSource \"point\" AttributeEnd ";
  const auto unreachable = [](const Scene& scene) {
    return FindUnreachableLights(scene).of_photons.size();
  };
  for (const std::string& shell : {ball, box}) {
    EXPECT_EQ(unreachable(World(light + shell)), 2U);  // with the sky
    EXPECT_EQ(unreachable(World(light + kToRight + shell)), 0U);
    EXPECT_EQ(
        unreachable(Read("ActiveTransform EndTime Translate 0 0 -9 " + kCamera, light + shell)),
        0U);
    // Something else that moves takes nothing from the proof.
    EXPECT_EQ(unreachable(World(light + shell + kToRight + kSphere)), 2U);
  }
}

TEST(MotionTest, SmoothShellsEncloseNothingThatMovesOutOfThem) {
  const std::string lit_in_glass =
      "LightSource \"point\" Material \"dielectric\" Shape \"sphere\" \"float radius\" 2 "
      "AttributeBegin Translate 0 0 9 Material \"diffuse\" ";
  const std::string wall =
      "Shape \"trianglemesh\" \"point3 P\" [-9 -9 0 9 -9 0 0 9 0] AttributeEnd ";
  const auto never_sampled = [](const Scene& scene) {
    return FindUnreachableLights(scene).of_sampling.size();
  };
  EXPECT_EQ(never_sampled(World(lit_in_glass + wall)), 1U);
  EXPECT_EQ(never_sampled(World(lit_in_glass + "ActiveTransform EndTime Translate 0 0 -9 " + wall)),
            0U);
}

TEST(MotionTest, TimesOfPassesAreSpreadEvenly) {
  SceneMotion motion;
  motion.shutter_open = 10;
  motion.shutter_close = 14;
  EXPECT_EQ(TimeOfPass(motion, 1, 5), 10) << "nothing moves";
  motion.of_camera = AnimatedTransform();
  for (const std::uint64_t seed : {1U, 2U, 77U}) {
    for (const std::uint64_t parity : {0U, 1U}) {
      for (const std::uint64_t run : {4U, 16U, 64U}) {
        for (const std::uint64_t first : {std::uint64_t{0}, 3 * run, 1000 * run}) {
          std::set<int> strata;
          for (std::uint64_t i = 0; i < run; ++i) {
            const double time = TimeOfPass(motion, seed, 2 * (first + i) + parity);
            ASSERT_GE(time, 10);
            ASSERT_LT(time, 14);
            strata.insert(static_cast<int>((time - 10) / 4 * static_cast<double>(run)));
          }
          EXPECT_EQ(strata.size(), run) << "a share of the time without a pass";
        }
      }
    }
  }
}

// Two halves that cover the same times in the same order would hide the noise of both; halves that
// cover different times would see noise where there is none.
TEST(MotionTest, EvenAndOddPassesAreIndependent) {
  SceneMotion motion;
  motion.of_camera = AnimatedTransform();
  double product = 0;
  constexpr int kRuns = 4096;
  for (std::uint64_t seed = 0; seed < kRuns; ++seed)
    product += (TimeOfPass(motion, seed, 0) - 0.5) * (TimeOfPass(motion, seed, 1) - 0.5);
  // Of variance 1/144 each: five standard deviations.
  EXPECT_LT(std::abs(product / kRuns), 5.0 / 12 / std::sqrt(kRuns));
}

// A photon of a job that is over is traced again as of the time of its pass.
TEST(MotionTest, PhotonsAreReplayedAtTheTimeOfTheirPass) {
  const Scene scene = World(
      "LightSource \"distant\" \"point3 from\" [0 0 1] \"point3 to\" [0 0 0] ActiveTransform "
      "EndTime "
      "Translate 0 0 4 ActiveTransform All Material \"diffuse\" \"rgb reflectance\" [0 0 0] Shape "
      "\"trianglemesh\" \"point3 P\" [-99 -99 0 99 -99 0 0 99 0]");
  const RenderSettings settings = ResolveSettings(RenderOverrides(), scene).value();
  const SceneNeeds needs = NeedsOf(scene, settings);
  int landed = 0;
  for (std::uint64_t pass = 0; pass < 20; ++pass) {
    const v1::PhotonPaths paths =
        ReplayInScene(scene, settings, needs, PhotonRange{.pass = pass}, 1000).value();
    const v1::PhotonPath& path = paths.paths(0);
    if (path.landings().empty()) continue;
    ++landed;
    EXPECT_NEAR(static_cast<double>(path.landings(0).position().z()),
                4 * TimeOfPass(scene.motion, settings.seed, pass), 1e-5);
  }
  EXPECT_GT(landed, 3);
}

TEST(MotionTest, TheMemoryOfMotionIsPredicted) {
  const std::string mesh = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] ";
  const SceneMemory still = SceneMemoryOf(World(mesh), RayNeeds());
  EXPECT_EQ(still.moving, 0);
  EXPECT_EQ(still.at_another_time, 0);
  const SceneMemory moving = SceneMemoryOf(World(kToRight + mesh), RayNeeds());
  EXPECT_GT(moving.moving, sizeof(TriangleMesh));
  EXPECT_GE(moving.at_another_time, moving.shapes + moving.acceleration);
  EXPECT_GT(moving.PeakOfCoordinator(), still.PeakOfCoordinator() + moving.at_another_time);
}

TEST(MotionTest, SensorsMeasureAsTheShutterOpens) {
  std::map<std::string, std::string> files;
  files["s.pbrt"] =
      "TransformTimes 0 2 Camera \"perspective\" \"float shutteropen\" 1 \"float "
      "shutterclose\" 2 WorldBegin LightSource \"infinite\"\n" +
      kToRight + kSphere;
  files["p.ply"] =
      "ply\nformat ascii 1.0\ncomment lucerna scene s.pbrt\ncomment lucerna spacing 0.1\n"
      "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\nend_header\n2 0 1 0 0 1\n";
  MemoryFiles all(std::move(files));
  const ParsedScene parsed = ReadScene(all, "p.ply");
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  EXPECT_FALSE(parsed.scene.motion.Moves());
  ExpectClose(parsed.scene.spheres.at(0).center, {2, 0, 0});
  EXPECT_EQ(parsed.scene.spheres.at(0).traits.motion, kNoMotion);
}

}  // namespace
}  // namespace lucerna
