// The files that a scene brings, read within its limits: texts, meshes, pictures, measured BSDFs.
//
// Every reader of a format reads through one AssetReader, so that limits hold for the scene as a
// whole. Every reading counts, also of a file that was read before. Pictures and BSDFs are shared.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/status.h"
#include "render/formats/image_file.h"
#include "render/scene/measured_table.h"
#include "render/scene/scene.h"
#include "render/scene/scene_files.h"

namespace lucerna {

struct PlyFaces;

class AssetReader {
 public:
  // `files` outlives the reader.
  AssetReader(SceneFiles& files, const SceneLimits& limits) : files_(files), limits_(limits) {}

  // From now on the encodings of pictures are those of all files, and colours are those below a
  // coat (PixelEncoding).
  void ReadPicturesAsMitsuba(double returned = 0) {
    reads_as_mitsuba_ = true;
    returned_ = returned;
  }

  // From now on files are also looked for in this folder of the scene, before those that were added
  // earlier and before the main file's. Errors: RESOURCE_EXHAUSTED for too many.
  [[nodiscard]] Status AddFolder(std::string folder);
  // The bytes of a file. Errors: what `files` says, RESOURCE_EXHAUSTED beyond the limits.
  [[nodiscard]] StatusOr<std::string> ReadBytes(const std::string& path);
  // The text of a file, unpacked when it is packed by gzip. Errors: those of ReadBytes, and
  // INVALID_ARGUMENT for a damaged stream, with the path.
  [[nodiscard]] StatusOr<std::string> ReadText(const std::string& path);
  // Errors: those of ReadBytes and of the file's format, with the path.
  [[nodiscard]] StatusOr<TriangleMesh> ReadMesh(const std::string& path, PlyFaces* faces = nullptr);
  [[nodiscard]] StatusOr<std::shared_ptr<const Picture>> ReadPicture(
      const std::string& path, const PixelEncoding& encoding, PictureUse use = PictureUse::kColors);
  // A PNG or JPEG, by how its bytes begin, that a file holds within it or names by its own rules.
  // `name` is the same for the same bytes, and no path. `bytes` is called when the picture is not
  // known yet. Errors: those of `bytes`, and of the image without a path.
  [[nodiscard]] StatusOr<std::shared_ptr<const Picture>> ReadNamedPicture(
      const std::string& name, const PixelEncoding& encoding, PictureUse use,
      const std::function<StatusOr<std::string>()>& bytes);

  // Of a measured BSDF, once for a path. Errors: as for meshes.
  [[nodiscard]] StatusOr<std::shared_ptr<const MeasuredTable>> ReadMeasured(
      const std::string& path);

  [[nodiscard]] const SceneLimits& limits() const { return limits_; }
  // True once the files together have more bytes than the limits allow: reading must end.
  [[nodiscard]] bool is_over_limit() const { return bytes_read_ > limits_.max_total_bytes; }

 private:
  struct KnownPicture {
    PixelEncoding encoding;
    PictureUse use;
    std::shared_ptr<const Picture> picture;
  };

  // In the folders that were added, then as the path says.
  [[nodiscard]] StatusOr<std::string> ReadFromFolders(const std::string& path);
  [[nodiscard]] std::shared_ptr<const Picture> FindPicture(const std::string& path,
                                                           const PixelEncoding& encoding,
                                                           PictureUse use) const;
  // By the end of `path`, as the readers of image files are chosen.
  [[nodiscard]] StatusOr<std::shared_ptr<const Picture>> Keep(const std::string& name,
                                                              std::string_view bytes,
                                                              std::string_view path,
                                                              const PixelEncoding& encoding,
                                                              PictureUse use);

  SceneFiles& files_;
  const SceneLimits limits_;
  std::vector<std::string> folders_;
  std::uint64_t bytes_read_ = 0;
  std::uint64_t picture_bytes_ = 0;
  bool reads_as_mitsuba_ = false;
  double returned_ = 0;
  std::multimap<std::string, KnownPicture> pictures_;                     // by path or name
  std::map<std::string, std::shared_ptr<const MeasuredTable>> measured_;  // by path
};

}  // namespace lucerna
