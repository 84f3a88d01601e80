// A submission is taken only when all of its files are there and good, and a refused one leaves
// nothing pinned.
#include "server/job_intake.h"

#include "gtest/gtest.h"

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
    return JobIntake(blobs_, std::uint64_t{1} << 30).Check(submission_, still_needed);
  }

  static constexpr std::size_t kStoreBytes = 4096;
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
