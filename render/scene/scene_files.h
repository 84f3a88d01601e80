// Where does a scene's text come from?
//
// A scene is the closure of its main file over Include, Import, meshes and pictures. A reader
// reads all of them through SceneFiles, by logical path, so the same parse runs on the user's disk
// and on bytes that came over the wire; and what it read is the scene's manifest.
//
// A logical path is relative, uses '/' only, and has no "..", ".", empty or control-character
// component. It is relative to the folder of the main file.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/digest.h"
#include "render/base/status.h"

namespace lucerna {

// The files of one scene: logical path -> digest and size.
struct SceneManifest {
  struct Entry {
    Digest digest;
    std::uint64_t size_bytes = 0;
    bool operator==(const Entry&) const = default;
  };

  std::string main_path;
  std::map<std::string, Entry> entries;

  // The name of the whole scene: changes with any path or byte, and with nothing else.
  [[nodiscard]] Digest SceneDigest() const;
  bool operator==(const SceneManifest&) const = default;
};

// Limits on what a scene may bring. All are reported when exceeded.
struct SceneLimits {
  std::uint64_t max_files = 20'000;
  std::uint64_t max_total_bytes = std::uint64_t{8} << 30;
  int max_include_depth = 32;
  std::uint64_t max_triangles = 400'000'000;  // after instances are laid out
  // Of the vertices and triangles in memory, after that.
  std::uint64_t max_shape_bytes = std::uint64_t{64} << 30;
  std::uint64_t max_picture_bytes = std::uint64_t{8} << 30;  // of all pixels in memory
};

// Errors: INVALID_ARGUMENT with the reason when `path` is not a logical path.
[[nodiscard]] Status CheckLogicalPath(std::string_view path);

// Files outside the scene's folder, which a local user may allow. In a manifest such a file has a
// logical path that follows from the path in the scene alone, so that the coordinator and workers,
// which parse the same scene, find it there; they open no file by any path.
[[nodiscard]] std::string OutsideName(std::string_view path);
// The path that OutsideName made `name` of; nullopt for other names.
[[nodiscard]] std::optional<std::string> OutsidePath(std::string_view name);

class SceneFiles {
 public:
  virtual ~SceneFiles() = default;
  // The bytes of one file. Errors: NOT_FOUND, INVALID_ARGUMENT (not a logical path), or what the
  // source says.
  [[nodiscard]] virtual StatusOr<std::string> Read(const std::string& logical_path) = 0;
};

// A folder on disk. Remembers what was read: the manifest of the parse that ran on it. Absolute
// paths and such with ".." are read as well where they lead into one of `allowed_folders`, or below
// it, once symbolic links are resolved.
class DirectoryFiles final : public SceneFiles {
 public:
  explicit DirectoryFiles(std::string folder, SceneLimits limits = {},
                          std::vector<std::string> allowed_folders = {});
  // Files that the folder does not have, or has otherwise, by logical paths: bytes, or the path of
  // a file anywhere.
  void Add(std::string logical_path, std::string bytes);
  void AddFromDisk(std::string logical_path, std::string path);
  [[nodiscard]] StatusOr<std::string> Read(const std::string& logical_path) override;
  // What was read so far, named by `main_path`.
  [[nodiscard]] SceneManifest Manifest(std::string main_path) const;

 private:
  // The path on disk of one that is no logical path, for the reason `why`.
  [[nodiscard]] StatusOr<std::string> AllowedPath(const std::string& path, const Status& why) const;

  std::string folder_;
  SceneLimits limits_;
  std::vector<std::string> allowed_folders_;
  std::map<std::string, std::string> added_bytes_;
  std::map<std::string, std::string> added_paths_;
  std::uint64_t total_bytes_ = 0;
  std::map<std::string, SceneManifest::Entry> entries_;
};

// Bytes found by the digest that a manifest gives. `fetch` returns the bytes of a digest; what it
// returns is checked against the digest and size.
class ManifestFiles final : public SceneFiles {
 public:
  using Fetch = std::function<StatusOr<std::string>(const Digest& digest)>;
  ManifestFiles(SceneManifest manifest, Fetch fetch);
  [[nodiscard]] StatusOr<std::string> Read(const std::string& logical_path) override;

 private:
  SceneManifest manifest_;
  Fetch fetch_;
};

}  // namespace lucerna
