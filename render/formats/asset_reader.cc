#include "render/formats/asset_reader.h"

#include <utility>

#include "render/base/text.h"
#include "render/formats/gzip.h"
#include "render/formats/measured_file.h"
#include "render/formats/ply_file.h"

namespace lucerna {

Status AssetReader::AddFolder(std::string folder) {
  // Every one is tried for every file.
  constexpr std::size_t kMaxFolders = 32;
  if (folders_.size() >= kMaxFolders)
    return absl::ResourceExhaustedError(Concat("more than ", kMaxFolders, " folders"));
  while (folder.starts_with("./"))
    folder.erase(0, 2);
  while (folder.ends_with('/'))
    folder.pop_back();
  if (!folder.empty() && folder != ".") folders_.push_back(std::move(folder));
  // A path may name another file from here on.
  pictures_.clear();
  return absl::OkStatus();
}

StatusOr<std::string> AssetReader::ReadFromFolders(const std::string& path) {
  // Why one of the folders must not be read.
  Status refused;
  for (std::size_t i = path.starts_with('/') ? 0 : folders_.size(); i > 0; --i) {
    StatusOr<std::string> bytes = files_.Read(Concat(folders_[i - 1], "/", path));
    if (bytes.ok()) return bytes;
    if (refused.ok() && !absl::IsNotFound(bytes.status())) refused = bytes.status();
  }
  StatusOr<std::string> bytes = files_.Read(path);
  if (refused.ok() || !absl::IsNotFound(bytes.status())) return bytes;
  return refused;
}

StatusOr<std::string> AssetReader::ReadBytes(const std::string& path) {
  std::string normal_path = path;
  while (normal_path.starts_with("./"))
    normal_path.erase(0, 2);
  LUCERNA_ASSIGN_OR_RETURN(std::string bytes, ReadFromFolders(normal_path));
  bytes_read_ += bytes.size();
  if (!is_over_limit()) return bytes;
  return absl::ResourceExhaustedError(
      Concat("the scene reads more than ", limits_.max_total_bytes, " bytes"));
}

StatusOr<std::string> AssetReader::ReadText(const std::string& path) {
  LUCERNA_ASSIGN_OR_RETURN(std::string bytes, ReadBytes(path));
  if (!IsGzip(bytes)) return bytes;
  StatusOr<std::string> text = Gunzip(bytes);
  if (!text.ok()) return absl::InvalidArgumentError(Concat(path, ": ", text.status().message()));
  // Unpacked bytes count as those of a file do.
  bytes_read_ += text->size();
  if (!is_over_limit()) return text;
  return absl::ResourceExhaustedError(
      Concat("the scene reads more than ", limits_.max_total_bytes, " bytes"));
}

StatusOr<TriangleMesh> AssetReader::ReadMesh(const std::string& path, PlyFaces* faces) {
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, ReadBytes(path));
  StatusOr<TriangleMesh> mesh = ParsePly(bytes, faces);
  if (mesh.ok()) return mesh;
  return absl::InvalidArgumentError(Concat(path, ": ", mesh.status().message()));
}

StatusOr<std::shared_ptr<const MeasuredTable>> AssetReader::ReadMeasured(const std::string& path) {
  if (const auto known = measured_.find(path); known != measured_.end()) return known->second;
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, ReadBytes(path));
  StatusOr<MeasuredTable> table = ParseMeasured(bytes);
  if (!table.ok()) return absl::InvalidArgumentError(Concat(path, ": ", table.status().message()));
  auto shared = std::make_shared<const MeasuredTable>(*std::move(table));
  measured_.emplace(path, shared);
  return shared;
}

StatusOr<std::shared_ptr<const Picture>> AssetReader::ReadPicture(const std::string& path,
                                                                  const PixelEncoding& given,
                                                                  PictureUse use) {
  PixelEncoding encoding = given;
  encoding.is_of_all_files = reads_as_mitsuba_;
  encoding.returned = use == PictureUse::kColors ? returned_ : 0;
  if (std::shared_ptr<const Picture> known = FindPicture(path, encoding, use)) return known;
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, ReadBytes(path));
  StatusOr<std::shared_ptr<const Picture>> picture = Keep(path, bytes, path, encoding, use);
  if (picture.ok()) return picture;
  return Status(picture.status().code(), Concat(path, ": ", picture.status().message()));
}

StatusOr<std::shared_ptr<const Picture>> AssetReader::ReadNamedPicture(
    const std::string& name, const PixelEncoding& encoding, PictureUse use,
    const std::function<StatusOr<std::string>()>& bytes) {
  if (std::shared_ptr<const Picture> known = FindPicture(name, encoding, use)) return known;
  const StatusOr<std::string> read = bytes();
  if (!read.ok()) return read.status();
  const std::string_view start = std::string_view(*read).substr(0, 4);
  const bool is_png = start == "\x89PNG";
  if (!is_png && !start.starts_with("\xFF\xD8")) {
    return absl::InvalidArgumentError("it begins neither like a PNG nor like a JPEG");
  }
  return Keep(name, *read, is_png ? ".png" : ".jpg", encoding, use);
}

std::shared_ptr<const Picture> AssetReader::FindPicture(const std::string& path,
                                                        const PixelEncoding& encoding,
                                                        PictureUse use) const {
  const auto [first, last] = pictures_.equal_range(path);
  for (auto known = first; known != last; ++known) {
    if (known->second.encoding == encoding && known->second.use == use)
      return known->second.picture;
  }
  return nullptr;
}

StatusOr<std::shared_ptr<const Picture>> AssetReader::Keep(const std::string& name,
                                                           std::string_view bytes,
                                                           std::string_view path,
                                                           const PixelEncoding& encoding,
                                                           PictureUse use) {
  LUCERNA_ASSIGN_OR_RETURN(
      Picture picture,
      lucerna::ReadPicture(bytes, path, encoding, limits_.max_picture_bytes - picture_bytes_, use));
  picture_bytes_ += SizeBytes(picture);
  auto shared = std::make_shared<const Picture>(std::move(picture));
  pictures_.emplace(name, KnownPicture{encoding, use, shared});
  return shared;
}

}  // namespace lucerna
