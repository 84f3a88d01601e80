// A scene's files are found by logical path only, never outside its folder; and a manifest names
// exactly what was read.
#include "render/scene/scene_files.h"

#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
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

TEST(SceneFilesTest, NamesOfOutsideFilesAreLogicalPathsAndLeadBack) {
  for (const char* path : {"../up.ply", "/data/wood.png", "a/../../b", "/", "..", "a//b", "%/../x",
                           "../%outside/./y"}) {
    EXPECT_TRUE(CheckLogicalPath(OutsideName(path)).ok()) << OutsideName(path);
    EXPECT_EQ(OutsidePath(OutsideName(path)), path);
  }
  EXPECT_EQ(OutsideName("../up.ply"), "%outside/%../up.ply");
  EXPECT_EQ(OutsidePath("scene.pbrt"), std::nullopt);
  EXPECT_EQ(OutsidePath("%outsider/x"), std::nullopt);
}

TEST(SceneFilesTest, FilesOutsideAreReadBelowAllowedFoldersOnly) {
  const SceneFolder scene;
  const SceneFolder shared;
  const SceneFolder secret;
  const std::string up = "../" + std::filesystem::path(shared.path()).filename().string();
  const std::string by_parent = up + "/models/a mesh.ply";
  const std::string absolute = shared.path() + "/models/a mesh.ply";
  std::filesystem::create_symlink(secret.path() + "/scene.pbrt", shared.path() + "/models/link");

  DirectoryFiles by_default(scene.path());
  for (const std::string& path : {by_parent, absolute}) {
    const Status refused = by_default.Read(path).status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(refused.message()), HasSubstr("--allow-path"));
  }
  DirectoryFiles files(scene.path(), {}, {secret.path() + "/none", shared.path() + "/models"});
  EXPECT_EQ(files.Read(by_parent).value(), "ply\n");
  EXPECT_EQ(files.Read(absolute).value(), "ply\n");
  EXPECT_EQ(files.Read("scene.pbrt").value(), "WorldBegin\n");
  // Beside the folder, in one whose name begins alike, and where a link leads out of it.
  std::filesystem::create_directories(shared.path() + "/models2");
  EXPECT_TRUE(WriteFile(shared.path() + "/models2/a", "a").ok());
  for (const std::string& path :
       {up + "/scene.pbrt", up + "/models/../scene.pbrt", up + "/models2/a", up + "/models/link",
        secret.path() + "/scene.pbrt", std::string("/etc/passwd"), up + "/models/a\nb"}) {
    EXPECT_EQ(files.Read(path).status().code(), absl::StatusCode::kInvalidArgument) << path;
  }

  // The manifest has them by logical paths, by which the client reads them again to send them, and
  // the coordinator finds them for the paths of the scene.
  const SceneManifest manifest = files.Manifest("scene.pbrt");
  ASSERT_EQ(manifest.entries.size(), 3U);
  DirectoryFiles again(scene.path(), {}, {shared.path() + "/models"});
  std::map<Digest, std::string> sent;
  for (const auto& [path, entry] : manifest.entries) {
    EXPECT_TRUE(CheckLogicalPath(path).ok()) << path;
    sent[entry.digest] = again.Read(path).value();
  }
  EXPECT_EQ(again.Manifest("scene.pbrt"), manifest);
  ManifestFiles of_manifest(
      manifest, [&](const Digest& digest) -> StatusOr<std::string> { return sent.at(digest); });
  EXPECT_EQ(of_manifest.Read(by_parent).value(), "ply\n");
  EXPECT_EQ(of_manifest.Read(absolute).value(), "ply\n");
  // What the manifest does not have is not looked for anywhere.
  EXPECT_EQ(of_manifest.Read("/etc/passwd").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(of_manifest.Read(up + "/scene.pbrt").status().code(),
            absl::StatusCode::kInvalidArgument);
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
