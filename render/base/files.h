// How do bytes get from a disk and onto it?
//
// The only file that opens a file to write. A file is written whole or not at all: a reader sees
// the old bytes or the new ones, also after a crash or on a full disk.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "render/base/status.h"

namespace lucerna {

// The bytes of the regular file at `path`.
// Errors: NOT_FOUND, PERMISSION_DENIED, INVALID_ARGUMENT for a folder, RESOURCE_EXHAUSTED when it
// has more than `max_size_bytes`; each message begins with the path.
[[nodiscard]] StatusOr<std::string> ReadFile(const std::string& path,
                                             std::uint64_t max_size_bytes = std::uint64_t{8} << 30);
// Its first bytes, at most so many. Errors: as ReadFile.
[[nodiscard]] StatusOr<std::string> ReadFileStart(const std::string& path,
                                                  std::uint64_t most_bytes);

// Writes `bytes` beside `path`, syncs them, and renames them over it. A link stays a link, to the
// new bytes. A `step` that is not empty names the fail points STEP.synced, before the rename, and
// STEP.renamed, after it (base/fail_point.h).
// Errors: what the system said, with the path; then no file of ours is left behind.
[[nodiscard]] Status WriteFile(const std::string& path, std::string_view bytes,
                               std::string_view step = {});
// The same with bytes that lie in several pieces, one after the other.
[[nodiscard]] Status WriteFile(const std::string& path, std::span<const std::string_view> pieces,
                               std::string_view step);

// Whether the name of a file is that of one that WriteFile had not finished when the process ended.
[[nodiscard]] bool IsUnfinished(std::string_view path);

// Whether both paths lead to one place, be there a file or not: writing one would replace the
// other.
[[nodiscard]] bool IsSameFile(const std::string& a, const std::string& b);

// Errors: as WriteFile would fail at `path`, found out before hours of rendering.
[[nodiscard]] Status CheckWritable(const std::string& path);

}  // namespace lucerna
