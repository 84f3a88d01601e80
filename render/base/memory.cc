#include "render/base/memory.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>

#include <malloc.h>

namespace lucerna {
namespace {

// The first number in `text` after `label`.
std::optional<std::uint64_t> NumberAfter(std::string_view text, std::string_view label) {
  const std::size_t at = text.find(label);
  if (at == std::string_view::npos) return std::nullopt;
  text.remove_prefix(at + label.size());
  text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
  std::uint64_t number = 0;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), number);
  if (parsed.ec != std::errc()) return std::nullopt;
  return number;
}

std::optional<std::uint64_t> NumberInFile(const std::string& path, std::string_view label) {
  // These files have no size to be read by.
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  return NumberAfter(text, label);
}

}  // namespace

std::uint64_t AvailableMemory() {
  std::uint64_t available = UINT64_MAX;
  if (const auto kibibytes = NumberInFile("/proc/meminfo", "MemAvailable:")) {
    available = *kibibytes * 1024;
  }
  const auto limit = NumberInFile("/sys/fs/cgroup/memory.max", "");
  const auto used = NumberInFile("/sys/fs/cgroup/memory.current", "");
  if (limit && used) available = std::min(available, *limit - std::min(*limit, *used));
  return available;
}

void ReleaseFreedMemory() {
  malloc_trim(0);
}

void KeepFreedMemory() {
  constexpr int kLargestBlock = 32 << 20;  // the largest that the C library allows
  constexpr int kLargestRest = 256 << 20;
  constexpr int kArenas = 1;
  mallopt(M_MMAP_THRESHOLD, kLargestBlock);
  mallopt(M_TRIM_THRESHOLD, kLargestRest);
  mallopt(M_ARENA_MAX, kArenas);
}

}  // namespace lucerna
