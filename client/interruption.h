// Has the user had enough?
//
// The first SIGINT or SIGTERM only raises a flag, and whoever waits checks it several times a
// second, cleans up and leaves. The second one ends the process at once: the local coordinator
// and workers then die with it.
#pragma once

#include <chrono>

namespace lucerna {

// Begins to catch the two signals. To be called once, by main.
void CatchInterruptions();

[[nodiscard]] bool IsInterrupted();

// The interruption is answered; what follows, to save what there is, goes on undisturbed. Another
// signal ends the process at once.
void ClearInterruption();

// Waits, and stops waiting when interrupted.
void SleepUnlessInterrupted(std::chrono::milliseconds duration);

}  // namespace lucerna
