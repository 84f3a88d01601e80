#include "server/memory_budget.h"

#include <algorithm>
#include <numeric>

#include "absl/strings/str_format.h"

namespace lucerna {
namespace {

constexpr std::array<const char*, kMemoryUses> kNames = {
    "uploads", "files and hitpoints", "scenes being read", "jobs", "images", "results of workers"};

std::string InMegabytes(std::uint64_t bytes) {
  return absl::StrFormat("%.1f MB", static_cast<double>(bytes) / 1e6);
}

}  // namespace

MemoryClaim& MemoryClaim::operator=(MemoryClaim&& other) noexcept {
  if (this == &other) return *this;
  Release();
  budget_ = std::exchange(other.budget_, nullptr);
  use_ = other.use_;
  bytes_ = other.bytes_;
  return *this;
}

void MemoryClaim::Release() {
  if (budget_ != nullptr) std::exchange(budget_, nullptr)->Release(use_, bytes_);
}

std::uint64_t MemoryBudget::HeldLocked() const {
  return std::accumulate(held_.begin(), held_.end(), std::uint64_t{0});
}

StatusOr<MemoryClaim> MemoryBudget::ClaimFree(MemoryUse use, std::uint64_t bytes) {
  const MutexLock lock(mutex_);
  const std::uint64_t held = HeldLocked();
  if (held <= max_bytes_ && bytes <= max_bytes_ - held) {
    held_[static_cast<std::size_t>(use)] += bytes;
    return MemoryClaim(*this, use, bytes);
  }
  std::array<std::size_t, kMemoryUses> largest_first{};
  std::iota(largest_first.begin(), largest_first.end(), std::size_t{0});
  std::ranges::stable_sort(largest_first, std::greater<>(),
                           [held = held_](std::size_t i) { return held[i]; });
  std::string holders;
  for (std::size_t i = 0; i < 2 && held_[largest_first[i]] > 0; ++i) {
    absl::StrAppend(&holders, i == 0 ? ", most of it by " : " and ", kNames[largest_first[i]], " (",
                    InMegabytes(held_[largest_first[i]]), ")");
  }
  return absl::ResourceExhaustedError(
      absl::StrCat("the coordinator has no memory for ", InMegabytes(bytes), " of ",
                   kNames[static_cast<std::size_t>(use)], ": ", InMegabytes(held), " of its ",
                   InMegabytes(max_bytes_), " are held", holders,
                   "; try again later, or start it with a larger --max-memory"));
}

StatusOr<MemoryClaim> MemoryBudget::Claim(MemoryUse use, std::uint64_t bytes) {
  StatusOr<MemoryClaim> claim = ClaimFree(use, bytes);
  if (bytes > max_bytes_) return claim;
  for (const auto& let_go : caches_) {
    while (!claim.ok() && let_go())
      claim = ClaimFree(use, bytes);
  }
  return claim;
}

MemoryClaim MemoryBudget::ClaimOneAnyway(MemoryUse use, std::uint64_t bytes) {
  const MutexLock lock(mutex_);
  std::uint64_t& held = held_[static_cast<std::size_t>(use)];
  if (held > 0) return {};
  held = bytes;
  return MemoryClaim(*this, use, bytes);
}

void MemoryBudget::Release(MemoryUse use, std::uint64_t bytes) {
  const MutexLock lock(mutex_);
  held_[static_cast<std::size_t>(use)] -= bytes;
  released_.NotifyAll();
}

void MemoryBudget::WaitForRelease(Duration at_most) {
  const MutexLock lock(mutex_);
  released_.WaitFor(mutex_, at_most);
}

std::uint64_t MemoryBudget::HeldFor(MemoryUse use) const {
  const MutexLock lock(mutex_);
  return held_[static_cast<std::size_t>(use)];
}

std::uint64_t MemoryBudget::held() const {
  const MutexLock lock(mutex_);
  return HeldLocked();
}

}  // namespace lucerna
