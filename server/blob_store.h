// Which bytes does the coordinator hold, by their digest?
//
// Scene files, hitpoint blocks and radii, in memory, within a bound. Bytes that something needs
// are pinned, once for every need. Bytes without a pin stay for the next job until the room is
// wanted, least recently used first. Where there are files of blobs on a disk (state/blob_files.h),
// what is not in memory is read from there.
//
// Files are claimed from the budget of memory, if there is one; what is dropped with its last pin
// belongs to a job, whose own claim covers it.
//
// Threads: any; what Get returned stays valid for as long as it is held.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "render/base/digest.h"
#include "render/base/mutex.h"
#include "render/base/status.h"
#include "server/memory_budget.h"
#include "server/state/blob_files.h"

namespace lucerna {

using Blob = std::shared_ptr<const std::string>;

class BlobStore;

// What becomes of bytes with their last pin.
enum class AfterLastPin : std::uint8_t {
  kKeep,  // while there is room
  kDrop,  // at once: nothing needs them any more
};

// One need for a blob, which stays in its store for as long as the pin lives. The store outlives
// all its pins.
class BlobPin {
 public:
  BlobPin() = default;  // of nothing
  BlobPin(BlobPin&& other) noexcept { *this = std::move(other); }
  BlobPin& operator=(BlobPin&& other) noexcept;
  BlobPin(const BlobPin&) = delete;
  BlobPin& operator=(const BlobPin&) = delete;
  ~BlobPin() { Release(); }

  // Requires a pin that a store gave.
  [[nodiscard]] const Digest& digest() const { return digest_; }

 private:
  friend class BlobStore;
  BlobPin(BlobStore& store, const Digest& digest, AfterLastPin after)
      : store_(&store), digest_(digest), after_(after) {}
  void Release();

  BlobStore* store_ = nullptr;
  Digest digest_;
  AfterLastPin after_ = AfterLastPin::kKeep;
};
using PinnedBlobs = std::vector<BlobPin>;

class BlobStore {
 public:
  // `files` and `budget` outlive the store; nullptr: there are none.
  explicit BlobStore(std::uint64_t max_bytes, const BlobFiles* files = nullptr,
                     MemoryBudget* budget = nullptr)
      : max_bytes_(max_bytes), files_(files), budget_(budget) {}

  // Keeps `bytes`, whose digest the caller has made sure of. Bytes already there are kept once.
  // Errors: RESOURCE_EXHAUSTED when they do not fit beside what is pinned, or into the budget.
  [[nodiscard]] Status Put(const Digest& digest, std::string bytes);
  // As Put, and pinned in the same step.
  [[nodiscard]] StatusOr<BlobPin> PutPinned(const Digest& digest, std::string bytes,
                                            AfterLastPin after = AfterLastPin::kKeep);

  // Errors: NOT_FOUND, or what BlobFiles says.
  [[nodiscard]] StatusOr<Blob> Get(const Digest& digest);
  [[nodiscard]] bool Has(const Digest& digest) const;

  // The pin that is released last decides what becomes of the bytes.
  // Errors: NOT_FOUND, RESOURCE_EXHAUSTED as Put, or what BlobFiles says.
  [[nodiscard]] StatusOr<BlobPin> Pin(const Digest& digest,
                                      AfterLastPin after = AfterLastPin::kKeep);

  // Drops the bytes without a pin that were used least recently; false when there are none.
  bool DropOldest();

  [[nodiscard]] std::uint64_t size_bytes() const;

 private:
  struct Entry {
    Blob bytes;
    MemoryClaim claim;
    int pins = 0;
    // Its place in unpinned_; meaningful only when pins == 0.
    std::list<Digest>::iterator place;
  };
  using Entries = std::unordered_map<Digest, Entry>;

  StatusOr<MemoryClaim> Claim(std::uint64_t bytes);
  Status PutLocked(const Digest& digest, Blob bytes, int pins, MemoryClaim claim)
      LUCERNA_REQUIRES(mutex_);
  void DropOldestLocked() LUCERNA_REQUIRES(mutex_);
  void PinLocked(Entry& entry) LUCERNA_REQUIRES(mutex_);
  friend class BlobPin;
  void Unpin(const Digest& digest, AfterLastPin after);
  bool MakeRoom(std::uint64_t bytes) LUCERNA_REQUIRES(mutex_);

  const std::uint64_t max_bytes_;
  const BlobFiles* const files_;
  MemoryBudget* const budget_;
  mutable Mutex mutex_;
  Entries entries_ LUCERNA_GUARDED_BY(mutex_);
  std::list<Digest> unpinned_ LUCERNA_GUARDED_BY(mutex_);  // least recently used first
  std::uint64_t size_bytes_ LUCERNA_GUARDED_BY(mutex_) = 0;
  std::uint64_t pinned_bytes_ LUCERNA_GUARDED_BY(mutex_) = 0;
};

}  // namespace lucerna
