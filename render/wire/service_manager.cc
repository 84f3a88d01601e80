#include "render/wire/service_manager.h"

#include <chrono>
#include <cstdint>

#include <systemd/sd-daemon.h>

namespace lucerna {
namespace {

// sd_watchdog_enabled(3) advises half of the watchdog's time at most.
constexpr int kTimesSaid = 4;

void Say(const char* state) {
  // There may be no manager, or one that does not listen: neither is a fault.
  (void)sd_notify(0, state);
}

}  // namespace

ServiceManager::ServiceManager(const Clock& clock) : clock_(clock) {
  std::uint64_t watchdog_us = 0;
  if (sd_watchdog_enabled(0, &watchdog_us) > 0) {
    say_every_ = std::chrono::microseconds(watchdog_us / kTimesSaid);
  }
}

void ServiceManager::SayReady() const {
  Say("READY=1");
}

void ServiceManager::SayAlive() {
  const SteadyTime now = clock_.Steady();
  if (say_every_ == Duration() || now - said_at_ < say_every_) return;
  Say("WATCHDOG=1");
  said_at_ = now;
}

void ServiceManager::SayEnding() const {
  Say("STOPPING=1");
}

}  // namespace lucerna
