// How much memory do all parts of the coordinator hold together?
//
// Who is about to hold many bytes claims them first, and lets go of the claim with the bytes. What
// does not fit beside the other claims is refused with a sentence that names the largest holders;
// before that, caches are asked to let go of what nobody needs at the moment. Claims are of what is
// expected where it cannot be known (a scene, a job), so the budget is a bound on plans and not on
// the process: `bad_alloc` is caught besides (server/coordinator.cc, server/work_pool.h).
//
// Threads: any. Nothing here calls back but the functions given to AddCache, without a lock.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "render/base/clock.h"
#include "render/base/mutex.h"
#include "render/base/status.h"

namespace lucerna {

enum class MemoryUse : std::uint8_t {
  kUploads,  // bytes of files on their way in
  kBlobs,    // files, hitpoints and radii
  kScenes,   // being read for a submission
  kJobs,     // in progress, paused, or ended and able to go on: sums, scene, copies for estimates
  kImages,   // of ended jobs
  kCommits,  // results on their way in or waiting to be merged
};
inline constexpr std::size_t kMemoryUses = 6;

class MemoryBudget;

// Bytes that are held, for as long as it lives. The budget outlives it.
class MemoryClaim {
 public:
  MemoryClaim() = default;  // of nothing
  MemoryClaim(MemoryClaim&& other) noexcept { *this = std::move(other); }
  MemoryClaim& operator=(MemoryClaim&& other) noexcept;
  MemoryClaim(const MemoryClaim&) = delete;
  MemoryClaim& operator=(const MemoryClaim&) = delete;
  ~MemoryClaim() { Release(); }

  [[nodiscard]] bool is_empty() const { return budget_ == nullptr; }

 private:
  friend class MemoryBudget;
  MemoryClaim(MemoryBudget& budget, MemoryUse use, std::uint64_t bytes)
      : budget_(&budget), use_(use), bytes_(bytes) {}
  void Release();

  MemoryBudget* budget_ = nullptr;
  MemoryUse use_ = MemoryUse::kUploads;
  std::uint64_t bytes_ = 0;
};

class MemoryBudget {
 public:
  explicit MemoryBudget(std::uint64_t max_bytes) : max_bytes_(max_bytes) {}

  // `let_go` drops something that nobody needs at the moment, if it has any, and returns whether it
  // did. Caches are asked in the order in which they were added. Before any other thread calls.
  void AddCache(std::function<bool()> let_go) { caches_.push_back(std::move(let_go)); }

  // May ask caches: not under a lock that they take.
  // Errors: RESOURCE_EXHAUSTED.
  [[nodiscard]] StatusOr<MemoryClaim> Claim(MemoryUse use, std::uint64_t bytes);

  // Also beyond the budget, when nothing is held for this use: what others wait for comes one by
  // one where they hold all memory. A claim of nothing (is_empty) when something is.
  [[nodiscard]] MemoryClaim ClaimOneAnyway(MemoryUse use, std::uint64_t bytes);

  // Waits until something is let go, at most so long.
  void WaitForRelease(Duration at_most);

  [[nodiscard]] std::uint64_t max_bytes() const { return max_bytes_; }
  [[nodiscard]] std::uint64_t HeldFor(MemoryUse use) const;
  [[nodiscard]] std::uint64_t held() const;

 private:
  friend class MemoryClaim;
  // Without asking caches.
  StatusOr<MemoryClaim> ClaimFree(MemoryUse use, std::uint64_t bytes);
  void Release(MemoryUse use, std::uint64_t bytes);
  std::uint64_t HeldLocked() const LUCERNA_REQUIRES(mutex_);

  const std::uint64_t max_bytes_;
  std::vector<std::function<bool()>> caches_;
  mutable Mutex mutex_;
  Condition released_;
  std::array<std::uint64_t, kMemoryUses> held_ LUCERNA_GUARDED_BY(mutex_){};
};

}  // namespace lucerna
