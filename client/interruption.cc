#include "client/interruption.h"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <thread>

namespace lucerna {
namespace {

std::atomic<bool> interrupted = false;
static_assert(std::atomic<bool>::is_always_lock_free);  // or a signal may not touch it

extern "C" void RaiseFlag(int /*signal*/) {
  interrupted = true;
}

}  // namespace

void CatchInterruptions() {
  struct sigaction action {};
  action.sa_handler = RaiseFlag;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool IsInterrupted() {
  return interrupted;
}

void ClearInterruption() {
  interrupted = false;
}

void SleepUnlessInterrupted(std::chrono::milliseconds duration) {
  constexpr std::chrono::milliseconds kSlice{20};
  while (duration.count() > 0 && !IsInterrupted()) {
    std::this_thread::sleep_for(std::min(duration, kSlice));
    duration -= kSlice;
  }
}

}  // namespace lucerna
