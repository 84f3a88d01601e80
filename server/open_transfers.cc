#include "server/open_transfers.h"

#include <algorithm>
#include <utility>

namespace lucerna {

StatusOr<std::unique_ptr<OpenTransfers::Transfer>> OpenTransfers::Open(const std::string& caller,
                                                                       std::function<void()> end) {
  const MutexLock lock(mutex_);
  Use& use = used_[caller];
  if (use.streams >= limits_.streams) {
    return absl::ResourceExhaustedError(
        absl::StrCat("you have ", use.streams, " transfers under way already; try again later"));
  }
  ++use.streams;
  open_.push_front({.caller = caller, .moved_at = clock_.Steady(), .end = std::move(end)});
  return std::unique_ptr<Transfer>(new Transfer(*this, open_.begin()));
}

OpenTransfers::Transfer::~Transfer() {
  const MutexLock lock(all_.mutex_);
  const auto use = all_.used_.find(state_->caller);
  use->second.bytes -= state_->size_bytes;
  if (--use->second.streams == 0) all_.used_.erase(use);
  all_.open_.erase(state_);
}

void OpenTransfers::Transfer::Progress() {
  const MutexLock lock(all_.mutex_);
  state_->moved_at = all_.clock_.Steady();
}

void OpenTransfers::Transfer::Complete() {
  const MutexLock lock(all_.mutex_);
  state_->is_complete = true;
}

Status OpenTransfers::Transfer::Announce(std::uint64_t size_bytes) {
  const MutexLock lock(all_.mutex_);
  Use& use = all_.used_[state_->caller];
  // One alone may always come: other limits hold it.
  if (use.bytes > 0 && size_bytes > all_.limits_.bytes - std::min(use.bytes, all_.limits_.bytes)) {
    return absl::ResourceExhaustedError(
        absl::StrCat("your transfers under way have ", use.bytes,
                     " bytes already; send this one when they are over"));
  }
  use.bytes += size_bytes;
  state_->size_bytes += size_bytes;
  return absl::OkStatus();
}

void OpenTransfers::Tick() {
  const SteadyTime now = clock_.Steady();
  // Under the lock, so that no stream is destroyed meanwhile.
  const MutexLock lock(mutex_);
  for (Transfer::State& state : open_) {
    if (state.is_complete || now - state.moved_at <= limits_.longest_silence) continue;
    state.end();
    // Once.
    state.is_complete = true;
  }
}

}  // namespace lucerna
