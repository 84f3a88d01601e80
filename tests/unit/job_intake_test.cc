// A submission is taken only when all of its files are there and good, and a refused one leaves
// nothing pinned.
#include "server/job_intake.h"

#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "tests/support/gzip_text.h"

namespace lucerna {
namespace {

constexpr const char* kScene = R"(
LookAt 0 -3 1  0 0 0  0 0 1
Camera "perspective" "float fov" [50]
Film "rgb" "integer xresolution" [8] "integer yresolution" [8]
WorldBegin
LightSource "point" "point3 from" [0 0 2]
Include "floor.pbrt"
)";
constexpr const char* kFloor = R"(
Material "diffuse"
Shape "trianglemesh" "point3 P" [-2 -2 0  2 -2 0  2 2 0] "integer indices" [0 1 2]
)";

class JobIntakeTest : public testing::Test {
 protected:
  void Add(const std::string& path, const std::string& bytes, bool is_uploaded = true) {
    submission_.manifest.entries[path] = {Sha256(bytes), bytes.size()};
    if (is_uploaded) {
      EXPECT_TRUE(blobs_.Put(Sha256(bytes), bytes).ok());
    }
  }
  // Whether the store may be filled anew, so that nothing is pinned.
  bool NothingIsPinned() {
    const std::string all(kStoreBytes, 'x');
    return blobs_.Put(Sha256(all), all).ok();
  }
  StatusOr<CheckedJob> Check(const StillNeeded& still_needed = [] { return absl::OkStatus(); }) {
    submission_.manifest.main_path = "scene.pbrt";
    return JobIntake(blobs_, max_job_bytes_).Check(submission_, still_needed);
  }

  static constexpr std::size_t kStoreBytes = 4096;
  std::uint64_t max_job_bytes_ = std::uint64_t{1} << 30;
  BlobStore blobs_{kStoreBytes};
  Submission submission_;
};

TEST_F(JobIntakeTest, KeepsTheFilesOfAGoodSceneForItsJob) {
  Add("scene.pbrt", kScene);
  Add("floor.pbrt", kFloor);
  submission_.overrides.passes = 7;
  {
    const StatusOr<CheckedJob> job = Check();
    ASSERT_TRUE(job.ok()) << job.status();
    EXPECT_EQ(job->settings.passes, 7);
    EXPECT_EQ(job->pinned.size(), 2U);
    EXPECT_FALSE(NothingIsPinned());
  }
  EXPECT_TRUE(NothingIsPinned());
}

// One kilobyte that unpacks to 150 times its size, and is read sixteen times.
TEST_F(JobIntakeTest, RefusesASmallUploadThatUnpacksToMoreThanTheMemory) {
  std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 20000\nproperty float x\nproperty float y\nproperty "
      "float z\nelement face 1\nproperty list uchar int vertex_indices\ncomment ";
  KeyedRng rng(1);
  for (int i = 0; i < 1000; ++i)
    ply += static_cast<char>('!' + rng.Bits() % 90);  // does not pack
  ply += "\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
  for (int i = 3; i < 20'000; ++i)
    ply += "0 0 0\n";
  ply += "3 0 1 2\n";
  std::string scene = kScene;
  for (int i = 0; i < 16; ++i)
    scene += "Shape \"plymesh\" \"string filename\" \"m.ply\"\n";
  Add("scene.pbrt", scene);
  Add("floor.pbrt", kFloor);
  Add("m.ply", Gzip(ply));
  EXPECT_TRUE(Check().ok()) << Check().status();
  max_job_bytes_ = 8 << 20;
  EXPECT_THAT(std::string(Check().status().message()),
              testing::HasSubstr("error: with this, the shapes of the scene take more than the "
                                 "2097152 bytes of memory that there are for them; repeat meshes "
                                 "less often, or give meshes with fewer vertices"));
  EXPECT_TRUE(NothingIsPinned());
}

// Small meshes take many times the memory of their triangles once they are analysed and in a tree.
TEST_F(JobIntakeTest, RefusesASceneThatDoesNotFitOnceItsTreeIsBuilt) {
  std::string more;
  for (int i = 0; i < 100; ++i)
    more += "Include \"floor.pbrt\"\n";
  std::string scene = kScene;
  for (int i = 0; i < 60; ++i)
    scene += "Include \"more.pbrt\"\n";
  Add("scene.pbrt", scene);
  Add("more.pbrt", more);
  // Shapes take the memory here, and their tree; materials are refused as they are read.
  Add("floor.pbrt",
      "Shape \"trianglemesh\" \"point3 P\" [-2 -2 0  2 -2 0  2 2 0] \"integer indices\" [0 1 2]\n");
  const StatusOr<CheckedJob> job = Check();
  ASSERT_TRUE(job.ok()) << job.status();
  const double peak = job->scene_memory.PeakOfCoordinator();
  max_job_bytes_ = static_cast<std::uint64_t>(0.9 * peak);
  EXPECT_THAT(std::string(Check().status().message()),
              testing::StartsWith("the scene takes 0.01 GB of the coordinator's memory"));
}

// A picture of one colour packs well: its pixels count, and their number is in its first bytes.
TEST_F(JobIntakeTest, RefusesASmallPictureOfMorePixelsThanTheMemoryHolds) {
  using namespace std::string_literals;
  Add("scene.pbrt", std::string(kScene) +
                        "Texture \"a\" \"spectrum\" \"imagemap\" \"string filename\" \"a.png\"\n");
  Add("floor.pbrt", kFloor);
  // 2048 x 2048 pixels of three bytes in a file of one kilobyte.
  Add("a.png", "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x08\0\0\0\x08\0\x08\x02\0\0\0CRC."s +
                   "\0\0\x04\0IDAT"s + std::string(1024, 'x') + "CRC.\0\0\0\0IEND"s);
  max_job_bytes_ = 32 << 20;
  EXPECT_THAT(std::string(Check().status().message()),
              testing::HasSubstr("a.png: the image would take 12582912 bytes of memory, and "
                                 "8388608 are left for the scene's images"));
  EXPECT_TRUE(NothingIsPinned());
}

TEST_F(JobIntakeTest, RefusesASceneWithMissingFiles) {
  Add("scene.pbrt", kScene);
  Add("floor.pbrt", kFloor, /*is_uploaded=*/false);
  const Status status = Check().status();
  EXPECT_TRUE(absl::IsFailedPrecondition(status));
  EXPECT_NE(status.message().find("1 of the scene's 2 files"), absl::string_view::npos) << status;
  EXPECT_TRUE(NothingIsPinned());
}

TEST_F(JobIntakeTest, RefusesASceneWithErrorsAndAReferenceThatIsNone) {
  Add("scene.pbrt", kScene);
  Add("floor.pbrt", "Shape \"teapot\"");
  EXPECT_TRUE(absl::IsInvalidArgument(Check().status()));
  Add("floor.pbrt", kFloor);
  submission_.reference = Sha256("not here");
  EXPECT_TRUE(absl::IsFailedPrecondition(Check().status()));
  submission_.reference = Sha256(kFloor);
  EXPECT_TRUE(absl::IsInvalidArgument(Check().status()));
  EXPECT_TRUE(NothingIsPinned());
}

TEST_F(JobIntakeTest, EndsBetweenTwoFilesWhenNobodyNeedsTheJobAnyMore) {
  Add("scene.pbrt", kScene);
  Add("floor.pbrt", kFloor);
  int files = 0;
  const Status status = Check([&]() -> Status {
                          if (++files < 2) return absl::OkStatus();
                          return absl::CancelledError("the caller left");
                        }).status();
  EXPECT_TRUE(absl::IsCancelled(status)) << status;
  EXPECT_TRUE(NothingIsPinned());
}

}  // namespace
}  // namespace lucerna
