// What does the service manager (systemd) hear of a program that it has started?
//
// By sd_notify: that the program is ready, that it lives, that it ends. Started by anyone else, a
// program says nothing.
#pragma once

#include "render/base/clock.h"

namespace lucerna {

class ServiceManager {
 public:
  explicit ServiceManager(const Clock& clock);

  // What was started is open for work.
  void SayReady() const;
  // To be called often, by the thread whose standstill is a fault: a manager with a watchdog starts
  // the program anew when it has not heard of it for the watchdog's time. Said a few times in that
  // time, not at every call.
  void SayAlive();
  // The program ends by itself.
  void SayEnding() const;

 private:
  const Clock& clock_;
  Duration say_every_{};  // 0: there is no watchdog
  SteadyTime said_at_{};
};

}  // namespace lucerna
