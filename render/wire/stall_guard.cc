#include "render/wire/stall_guard.h"

#include <utility>

namespace lucerna {
namespace {

constexpr std::chrono::milliseconds kTick{100};

}  // namespace

StallGuard::StallGuard(grpc::ClientContext& context, Duration longest_silence,
                       std::function<bool()> gives_up)
    : context_(context),
      longest_silence_(longest_silence),
      gives_up_(std::move(gives_up)),
      moved_at_(SystemClock().Steady()),
      thread_([this] { Watch(); }) {}

StallGuard::~StallGuard() {
  {
    const MutexLock lock(mutex_);
    is_over_ = true;
    changed_.NotifyAll();
  }
  thread_.join();
}

void StallGuard::Progress() {
  const MutexLock lock(mutex_);
  moved_at_ = SystemClock().Steady();
}

void StallGuard::Watch() {
  while (true) {
    {
      const MutexLock lock(mutex_);
      if (!is_over_) changed_.WaitFor(mutex_, kTick);
      if (is_over_) return;
      if (SystemClock().Steady() - moved_at_ > longest_silence_) break;
    }
    if (gives_up_ && gives_up_()) break;
  }
  context_.TryCancel();
}

}  // namespace lucerna
