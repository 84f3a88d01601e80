#include "server/blob_store.h"

#include <utility>

namespace lucerna {

BlobPin& BlobPin::operator=(BlobPin&& other) noexcept {
  if (this == &other) return *this;
  Release();
  store_ = std::exchange(other.store_, nullptr);
  digest_ = other.digest_;
  after_ = other.after_;
  return *this;
}

void BlobPin::Release() {
  if (store_ != nullptr) std::exchange(store_, nullptr)->Unpin(digest_, after_);
}

StatusOr<MemoryClaim> BlobStore::Claim(std::uint64_t bytes) {
  return budget_ == nullptr ? MemoryClaim() : budget_->Claim(MemoryUse::kBlobs, bytes);
}

Status BlobStore::Put(const Digest& digest, std::string bytes) {
  LUCERNA_ASSIGN_OR_RETURN(MemoryClaim claim, Claim(bytes.size()));
  const MutexLock lock(mutex_);
  return PutLocked(digest, std::make_shared<const std::string>(std::move(bytes)), 0,
                   std::move(claim));
}

StatusOr<BlobPin> BlobStore::PutPinned(const Digest& digest, std::string bytes,
                                       AfterLastPin after) {
  MemoryClaim claim;
  if (after == AfterLastPin::kKeep) {
    LUCERNA_ASSIGN_OR_RETURN(claim, Claim(bytes.size()));
  }
  const MutexLock lock(mutex_);
  LUCERNA_RETURN_IF_ERROR(PutLocked(digest, std::make_shared<const std::string>(std::move(bytes)),
                                    1, std::move(claim)));
  return BlobPin(*this, digest, after);
}

Status BlobStore::PutLocked(const Digest& digest, Blob bytes, int pins, MemoryClaim claim) {
  if (const auto found = entries_.find(digest); found != entries_.end()) {
    if (pins > 0) PinLocked(found->second);
    return absl::OkStatus();
  }
  const std::uint64_t size = bytes->size();
  if (!MakeRoom(size)) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "the coordinator's store of ", max_bytes_, " bytes is full: ", pinned_bytes_,
        " are in use and ", size, " more do not fit; start it with a larger --max-store-bytes"));
  }
  Entry entry;
  entry.bytes = std::move(bytes);
  entry.claim = std::move(claim);
  entry.pins = pins;
  if (pins == 0) {
    entry.place = unpinned_.insert(unpinned_.end(), digest);
  } else {
    pinned_bytes_ += size;
  }
  size_bytes_ += size;
  entries_.emplace(digest, std::move(entry));
  return absl::OkStatus();
}

bool BlobStore::MakeRoom(std::uint64_t bytes) {
  if (bytes > max_bytes_ || pinned_bytes_ > max_bytes_ - bytes) return false;
  while (size_bytes_ > max_bytes_ - bytes)
    DropOldestLocked();
  return true;
}

void BlobStore::DropOldestLocked() {
  const auto oldest = entries_.find(unpinned_.front());
  size_bytes_ -= oldest->second.bytes->size();
  entries_.erase(oldest);
  unpinned_.pop_front();
}

bool BlobStore::DropOldest() {
  const MutexLock lock(mutex_);
  if (unpinned_.empty()) return false;
  DropOldestLocked();
  return true;
}

namespace {

Status Missing(const Digest& digest) {
  return absl::NotFoundError(absl::StrCat("there are no bytes named ", digest.Hex()));
}

}  // namespace

StatusOr<Blob> BlobStore::Get(const Digest& digest) {
  {
    const MutexLock lock(mutex_);
    if (const auto found = entries_.find(digest); found != entries_.end()) {
      Entry& entry = found->second;
      if (entry.pins == 0) unpinned_.splice(unpinned_.end(), unpinned_, entry.place);
      return entry.bytes;
    }
  }
  if (files_ == nullptr || !files_->Has(digest)) return Missing(digest);
  LUCERNA_ASSIGN_OR_RETURN(std::string bytes, files_->Get(digest));
  const Blob blob = std::make_shared<const std::string>(std::move(bytes));
  // Without room it is read again the next time.
  StatusOr<MemoryClaim> claim = Claim(blob->size());
  if (!claim.ok()) return blob;
  const MutexLock lock(mutex_);
  PutLocked(digest, blob, 0, *std::move(claim)).IgnoreError();
  return blob;
}

bool BlobStore::Has(const Digest& digest) const {
  {
    const MutexLock lock(mutex_);
    if (entries_.contains(digest)) return true;
  }
  return files_ != nullptr && files_->Has(digest);
}

StatusOr<BlobPin> BlobStore::Pin(const Digest& digest, AfterLastPin after) {
  {
    const MutexLock lock(mutex_);
    if (const auto found = entries_.find(digest); found != entries_.end()) {
      PinLocked(found->second);
      return BlobPin(*this, digest, after);
    }
  }
  if (files_ == nullptr || !files_->Has(digest)) return Missing(digest);
  LUCERNA_ASSIGN_OR_RETURN(std::string bytes, files_->Get(digest));
  return PutPinned(digest, std::move(bytes), after);
}

void BlobStore::PinLocked(Entry& entry) {
  if (entry.pins++ > 0) return;
  unpinned_.erase(entry.place);
  pinned_bytes_ += entry.bytes->size();
}

void BlobStore::Unpin(const Digest& digest, AfterLastPin after) {
  const MutexLock lock(mutex_);
  const auto found = entries_.find(digest);
  LUCERNA_CHECK(found != entries_.end() && found->second.pins > 0);
  if (--found->second.pins > 0) return;
  pinned_bytes_ -= found->second.bytes->size();
  if (after == AfterLastPin::kKeep) {
    found->second.place = unpinned_.insert(unpinned_.end(), digest);
  } else {
    size_bytes_ -= found->second.bytes->size();
    entries_.erase(found);
  }
}

std::uint64_t BlobStore::size_bytes() const {
  const MutexLock lock(mutex_);
  return size_bytes_;
}

}  // namespace lucerna
