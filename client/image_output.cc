#include "client/image_output.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include "client/exit_code.h"
#include "render/base/files.h"
#include "render/film/picture_file.h"

namespace lucerna {

bool IsDevice(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_other(path, error);
}

namespace {

StatusOr<PictureFormat> FormatOf(const std::string& path) {
  if (IsDevice(path)) return PictureFormat::kExr;
  StatusOr<PictureFormat> format = PictureFormatOf(path);
  if (format.ok()) return format;
  return Failure(ExitCode::kUsage, absl::StrCat(path, ": ", format.status().message()));
}

// Empty where there is no file.
std::string FirstBytesOf(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return "";
  std::ifstream file(path, std::ios::binary);
  std::string first(kBytesThatTell, '\0');
  file.read(first.data(), static_cast<std::streamsize>(first.size()));
  first.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, file.gcount())));
  return first;
}

// A file that something else has written is not replaced unasked.
Status CheckMayReplace(const std::string& path) {
  const std::string first = FirstBytesOf(path);
  if (first.empty() || IsOwnPicture(first)) return absl::OkStatus();
  return Failure(
      ExitCode::kUsage,
      absl::StrCat(path, " exists, and was not written by lucerna; --force replaces it"));
}

// The image of hours is not thrown away because its place is full. Returns `why`, with the name of
// the file in the folder for temporary files that has it instead.
Status SaveElsewhere(const std::string& path, const std::string& bytes, const Status& why) {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  if (error) return why;
  const std::string other = (folder / std::filesystem::path(path).filename()).string();
  if (IsSameFile(other, path) || std::filesystem::exists(other, error) ||
      !WriteFile(other, bytes).ok()) {
    return why;
  }
  return Status(why.code(), absl::StrCat(why.message(), "; it is in ", other, " instead"));
}

}  // namespace

Status CheckOutputs(const OutputPaths& outputs) {
  if (!outputs.image.empty() && !outputs.png.empty() && IsSameFile(outputs.image, outputs.png)) {
    return Failure(ExitCode::kUsage, absl::StrCat("-o and --png both name ", outputs.image,
                                                  "; give each image a file of its own"));
  }
  if (!outputs.image.empty()) LUCERNA_RETURN_IF_ERROR(FormatOf(outputs.image).status());
  for (const std::string& path : {outputs.image, outputs.png}) {
    if (path.empty()) continue;
    LUCERNA_RETURN_IF_ERROR(CheckWritable(path));
    if (!outputs.replaces) LUCERNA_RETURN_IF_ERROR(CheckMayReplace(path));
  }
  return absl::OkStatus();
}

Status CheckMayWrite(const std::string& path, std::string_view mark) {
  LUCERNA_RETURN_IF_ERROR(CheckWritable(path));
  const std::string first = FirstBytesOf(path);
  if (first.empty() || first.find(mark) != std::string::npos) return absl::OkStatus();
  return Failure(ExitCode::kUsage,
                 absl::StrCat(path, " exists, and was not written by lucerna; name another file"));
}

StatusOr<SavedImage> WriteOutputs(const Image& image, const std::string& exr,
                                  const OutputPaths& outputs, const Display& display) {
  SavedImage saved;
  saved.digest = image.PixelDigest();
  Status status;
  const auto save = [&](const std::string& path, PictureFormat format) -> Status {
    std::string encoded;
    if (format != PictureFormat::kExr) {
      LUCERNA_ASSIGN_OR_RETURN(encoded, EncodePicture(image, format, display));
    }
    const std::string& picture = format == PictureFormat::kExr ? exr : encoded;
    const Status written = WriteFile(path, picture);
    if (written.ok()) saved.paths.push_back(path);
    return written.ok() || IsDevice(path) ? written : SaveElsewhere(path, picture, written);
  };
  if (!outputs.image.empty()) {
    LUCERNA_ASSIGN_OR_RETURN(const PictureFormat format, FormatOf(outputs.image));
    status = save(outputs.image, format);
  }
  if (!outputs.png.empty()) status.Update(save(outputs.png, PictureFormat::kPng));
  if (!status.ok()) return status;
  return saved;
}

}  // namespace lucerna
