#include "render/scene/scene_files.h"

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

DirectoryFiles::DirectoryFiles(std::string folder, SceneLimits limits)
    : folder_(std::move(folder)), limits_(limits) {}

StatusOr<std::string> DirectoryFiles::Read(const std::string& logical_path) {
  LUCERNA_RETURN_IF_ERROR(CheckLogicalPath(logical_path));
  const auto known = entries_.find(logical_path);
  if (known == entries_.end() && entries_.size() >= limits_.max_files) {
    return absl::ResourceExhaustedError(
        Concat("the scene has more than ", limits_.max_files, " files"));
  }
  const std::uint64_t room = limits_.max_total_bytes - total_bytes_ +
                             (known == entries_.end() ? 0 : known->second.size_bytes);
  const std::string path = folder_.empty() ? logical_path : Concat(folder_, "/", logical_path);
  LUCERNA_ASSIGN_OR_RETURN(std::string bytes, ReadFile(path, room));
  SceneManifest::Entry entry = {Sha256(bytes), bytes.size()};
  if (known == entries_.end()) {
    total_bytes_ += bytes.size();
    entries_.emplace(logical_path, entry);
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
  LUCERNA_RETURN_IF_ERROR(CheckLogicalPath(logical_path));
  const auto entry = manifest_.entries.find(logical_path);
  if (entry == manifest_.entries.end()) {
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
