#include "render/scene/scene_files.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "render/base/files.h"
#include "render/base/text.h"

namespace lucerna {
namespace {

// A length before every string, so that no two manifests spell the same bytes.
void AddSized(Sha256Stream& stream, std::uint64_t size_bytes, std::string_view bytes) {
  std::string prefix;
  for (int shift = 0; shift < 64; shift += 8) {
    prefix += static_cast<char>((size_bytes >> shift) & 0xFFU);
  }
  stream.Add(prefix);
  stream.Add(bytes);
}

// The first component of the names of files outside the scene's folder. Those that follow are the
// path's own, with a '%' before what a logical path may not have: "..", "." and nothing.
constexpr std::string_view kOutside = "%outside";

bool IsWithin(const std::filesystem::path& path, const std::filesystem::path& folder) {
  const auto [end, ignored] = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
  return end == folder.end();
}

}  // namespace

Digest SceneManifest::SceneDigest() const {
  Sha256Stream stream;
  stream.Add("lucerna scene manifest 1\n");
  AddSized(stream, main_path.size(), main_path);
  for (const auto& [path, entry] : entries) {  // in the order of the paths
    AddSized(stream, path.size(), path);
    AddSized(stream, entry.size_bytes, entry.digest.Bytes());
  }
  return stream.Finish();
}

std::string OutsideName(std::string_view path) {
  std::string name(kOutside);
  for (std::size_t start = 0; start <= path.size();) {
    const std::string_view component = path.substr(start, path.find('/', start) - start);
    start += component.size() + 1;
    name += '/';
    if (component.empty() || component == "." || component == ".." || component[0] == '%')
      name += '%';
    name += component;
  }
  return name;
}

std::optional<std::string> OutsidePath(std::string_view name) {
  if (!name.starts_with(kOutside) || !name.substr(kOutside.size()).starts_with('/'))
    return std::nullopt;
  name.remove_prefix(kOutside.size() + 1);
  std::string path;
  for (std::size_t start = 0; start <= name.size();) {
    std::string_view component = name.substr(start, name.find('/', start) - start);
    if (start > 0) path += '/';
    start += component.size() + 1;
    if (component.starts_with('%')) component.remove_prefix(1);
    path += component;
  }
  return path;
}

Status CheckLogicalPath(std::string_view path) {
  constexpr std::size_t kMaxPathBytes = 4096;
  const auto bad = [&path](std::string_view reason) {
    std::string shown;
    for (const char c : path.substr(0, 80)) {
      const auto byte = static_cast<unsigned char>(c);
      shown += byte < 0x20 || byte == 0x7F ? '?' : c;
    }
    return absl::InvalidArgumentError(
        Concat("\"", shown, "\" is not a path inside the scene's folder: ", reason));
  };
  if (path.empty()) return bad("it is empty");
  if (path.size() > kMaxPathBytes) {
    return bad(Concat("it is longer than ", kMaxPathBytes, " bytes"));
  }
  if (path.front() == '/') return bad("it is absolute");
  for (const char c : path) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) return bad("it has a control character");
    if (c == '\\') return bad("it has a backslash; folders are separated by '/'");
  }
  for (std::size_t start = 0; start <= path.size();) {
    const std::string_view component = path.substr(start, path.find('/', start) - start);
    start += component.size() + 1;
    if (component.empty()) return bad("it has an empty component");
    if (component == "." || component == "..") {
      return bad(Concat("it has a component \"", component, "\""));
    }
  }
  return absl::OkStatus();
}

DirectoryFiles::DirectoryFiles(std::string folder, SceneLimits limits,
                               std::vector<std::string> allowed_folders)
    : folder_(std::move(folder)), limits_(limits), allowed_folders_(std::move(allowed_folders)) {}

void DirectoryFiles::Add(std::string logical_path, std::string bytes) {
  added_bytes_[std::move(logical_path)] = std::move(bytes);
}

void DirectoryFiles::AddFromDisk(std::string logical_path, std::string path) {
  added_paths_[std::move(logical_path)] = std::move(path);
}

StatusOr<std::string> DirectoryFiles::AllowedPath(const std::string& path,
                                                  const Status& why) const {
  const auto refused = [&why](std::string_view and_why) {
    return Status(why.code(), Concat(why.message(), and_why));
  };
  const bool is_text = std::ranges::all_of(path, [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte >= 0x20 && byte != 0x7F && byte != '\\';
  });
  if (path.empty() || !is_text) return why;
  if (allowed_folders_.empty()) return refused("; --allow-path DIR allows files below DIR");
  // An absolute path replaces the folder.
  std::error_code error;
  const std::filesystem::path file =
      std::filesystem::canonical(std::filesystem::path(folder_) / path, error);
  if (error) return absl::NotFoundError(Concat(path, ": no such file"));
  for (const std::string& allowed : allowed_folders_) {
    const std::filesystem::path folder = std::filesystem::canonical(allowed, error);
    if (!error && IsWithin(file, folder)) return file.string();
  }
  return refused(", nor below a folder of --allow-path");
}

StatusOr<std::string> DirectoryFiles::Read(const std::string& logical_path) {
  // As the scene has it, or as the manifest names it.
  std::string in_scene = logical_path;
  if (const auto outside = OutsidePath(logical_path);
      outside.has_value() && !CheckLogicalPath(*outside).ok()) {
    in_scene = *outside;
  }
  const Status is_logical = CheckLogicalPath(in_scene);
  std::string name = in_scene;
  std::string path = folder_.empty() ? in_scene : Concat(folder_, "/", in_scene);
  if (!is_logical.ok()) {
    LUCERNA_ASSIGN_OR_RETURN(path, AllowedPath(in_scene, is_logical));
    name = OutsideName(in_scene);
    LUCERNA_RETURN_IF_ERROR(CheckLogicalPath(name));
  }
  if (const auto added = added_paths_.find(name); added != added_paths_.end()) path = added->second;
  const auto known = entries_.find(name);
  if (known == entries_.end() && entries_.size() >= limits_.max_files) {
    return absl::ResourceExhaustedError(
        Concat("the scene has more than ", limits_.max_files, " files"));
  }
  const std::uint64_t room = limits_.max_total_bytes - total_bytes_ +
                             (known == entries_.end() ? 0 : known->second.size_bytes);
  const auto made = added_bytes_.find(name);
  std::string bytes;
  if (made != added_bytes_.end()) {
    bytes = made->second;
  } else {
    LUCERNA_ASSIGN_OR_RETURN(bytes, ReadFile(path, room));
  }
  SceneManifest::Entry entry = {Sha256(bytes), bytes.size()};
  if (known == entries_.end()) {
    total_bytes_ += bytes.size();
    entries_.emplace(name, entry);
  } else if (known->second != entry) {
    return absl::UnavailableError(
        Concat(path, ": the file changed while the scene was being read; try again"));
  }
  return bytes;
}

SceneManifest DirectoryFiles::Manifest(std::string main_path) const {
  return {std::move(main_path), entries_};
}

ManifestFiles::ManifestFiles(SceneManifest manifest, Fetch fetch)
    : manifest_(std::move(manifest)), fetch_(std::move(fetch)) {}

StatusOr<std::string> ManifestFiles::Read(const std::string& logical_path) {
  const Status is_logical = CheckLogicalPath(logical_path);
  const auto entry =
      manifest_.entries.find(is_logical.ok() ? logical_path : OutsideName(logical_path));
  if (entry == manifest_.entries.end()) {
    LUCERNA_RETURN_IF_ERROR(is_logical);
    return absl::NotFoundError(Concat(logical_path, ": the scene's manifest has no such file"));
  }
  LUCERNA_ASSIGN_OR_RETURN(std::string bytes, fetch_(entry->second.digest));
  if (bytes.size() != entry->second.size_bytes || Sha256(bytes) != entry->second.digest) {
    return absl::DataLossError(
        Concat(logical_path, ": its bytes are not those that the manifest names"));
  }
  return bytes;
}

}  // namespace lucerna
