// A scene's files are found by logical path only, never outside its folder; and a manifest names
// exactly what was read.
#include "render/scene/scene_files.h"

#include <cstdlib>
#include <filesystem>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/base/files.h"

namespace lucerna {
namespace {

using ::testing::HasSubstr;

class SceneFolder {
 public:
  // A folder of its own: tests of this file run at the same time.
  SceneFolder() : path_(testing::TempDir() + "lucerna_scene_files_XXXXXX") {
    EXPECT_NE(mkdtemp(path_.data()), nullptr);
    std::filesystem::create_directories(path_ + "/models");
    EXPECT_TRUE(WriteFile(path_ + "/scene.pbrt", "WorldBegin\n").ok());
    EXPECT_TRUE(WriteFile(path_ + "/models/a mesh.ply", "ply\n").ok());
  }
  ~SceneFolder() { std::filesystem::remove_all(path_); }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

TEST(SceneFilesTest, LogicalPathsStayInTheFolder) {
  for (const char* good : {"scene.pbrt", "models/a mesh.ply", "a..b/c", "\xC3\xA9.ply"}) {
    EXPECT_TRUE(CheckLogicalPath(good).ok()) << good;
  }
  for (const char* bad : {"", "/etc/passwd", "../up", "a/../b", "./a", "a//b", "a/", "a\nb", "a\\b",
                          "..", ".", "a/."}) {
    EXPECT_EQ(CheckLogicalPath(bad).code(), absl::StatusCode::kInvalidArgument) << bad;
  }
}

TEST(SceneFilesTest, DirectoryFilesRemembersWhatWasRead) {
  const SceneFolder folder;
  DirectoryFiles files(folder.path());
  EXPECT_EQ(files.Read("scene.pbrt").value(), "WorldBegin\n");
  EXPECT_EQ(files.Read("models/a mesh.ply").value(), "ply\n");
  EXPECT_TRUE(files.Read("scene.pbrt").ok());
  EXPECT_EQ(files.Read("missing.ply").status().code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(files.Read("models").ok());  // a folder
  const std::string folder_name = std::filesystem::path(folder.path()).filename();
  EXPECT_FALSE(files.Read("../" + folder_name + "/scene.pbrt").ok());

  const SceneManifest manifest = files.Manifest("scene.pbrt");
  ASSERT_EQ(manifest.entries.size(), 2U);
  EXPECT_EQ(manifest.entries.at("scene.pbrt").digest, Sha256("WorldBegin\n"));
  EXPECT_EQ(manifest.entries.at("models/a mesh.ply").size_bytes, 4U);
}

TEST(SceneFilesTest, DirectoryFilesKeepsToItsLimits) {
  const SceneFolder folder;
  DirectoryFiles few(folder.path(), {.max_files = 1});
  EXPECT_TRUE(few.Read("scene.pbrt").ok());
  EXPECT_TRUE(few.Read("scene.pbrt").ok());
  EXPECT_EQ(few.Read("models/a mesh.ply").status().code(), absl::StatusCode::kResourceExhausted);

  DirectoryFiles small(folder.path(), {.max_total_bytes = 12});
  EXPECT_TRUE(small.Read("scene.pbrt").ok());
  EXPECT_TRUE(small.Read("scene.pbrt").ok());
  EXPECT_EQ(small.Read("models/a mesh.ply").status().code(), absl::StatusCode::kResourceExhausted);
}

TEST(SceneFilesTest, AFileThatChangesDuringTheParseIsNoticed) {
  const SceneFolder folder;
  DirectoryFiles files(folder.path());
  EXPECT_TRUE(files.Read("scene.pbrt").ok());
  EXPECT_TRUE(WriteFile(folder.path() + "/scene.pbrt", "WorldBegin #\n").ok());
  EXPECT_FALSE(files.Read("scene.pbrt").ok());
}

TEST(SceneFilesTest, ManifestFilesChecksWhatItIsGiven) {
  SceneManifest manifest;
  manifest.main_path = "scene.pbrt";
  manifest.entries["scene.pbrt"] = {Sha256("right"), 5};
  std::string given = "right";
  ManifestFiles files(manifest, [&given](const Digest&) -> StatusOr<std::string> { return given; });
  EXPECT_EQ(files.Read("scene.pbrt").value(), "right");
  EXPECT_EQ(files.Read("other.pbrt").status().code(), absl::StatusCode::kNotFound);
  given = "wrong";
  EXPECT_EQ(files.Read("scene.pbrt").status().code(), absl::StatusCode::kDataLoss);
}

TEST(SceneFilesTest, TheDigestChangesWithEveryPathAndByteAndOnlyThen) {
  SceneManifest manifest;
  manifest.main_path = "a";
  manifest.entries["a"] = {Sha256("1"), 1};
  manifest.entries["b"] = {Sha256("2"), 1};
  const Digest original = manifest.SceneDigest();
  EXPECT_EQ(SceneManifest(manifest).SceneDigest(), original);

  SceneManifest changed = manifest;
  changed.main_path = "b";
  EXPECT_NE(changed.SceneDigest(), original);
  changed = manifest;
  changed.entries["b"].digest = Sha256("3");
  EXPECT_NE(changed.SceneDigest(), original);
  changed = manifest;
  changed.entries["b"].size_bytes = 2;
  EXPECT_NE(changed.SceneDigest(), original);
  // The same letters, cut into paths elsewhere.
  changed = {"ab", {{"a", manifest.entries["a"]}}};
  const SceneManifest moved = {"a", {{"ba", manifest.entries["a"]}}};
  EXPECT_NE(changed.SceneDigest(), moved.SceneDigest());
}

}  // namespace
}  // namespace lucerna
