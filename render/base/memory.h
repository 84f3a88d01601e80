// How much memory may this process still take, and how does it take it?
#pragma once

#include <cstdint>
#include <vector>

namespace lucerna {

// What is available on this machine, or within the limit of the process's control group where that
// is less [bytes]; UINT64_MAX when the system does not say.
[[nodiscard]] std::uint64_t AvailableMemory();

// Gives back to the system what was freed and lies between what is held. Takes some milliseconds
// for each 100 MB, in which other threads may wait for memory.
void ReleaseFreedMemory();

// Empties a vector and frees what it held. An empty list that is assigned leaves it its memory.
template <typename Value>
void FreeMemoryOf(std::vector<Value>& values) {
  std::vector<Value>().swap(values);
}

// Keeps freed blocks of up to 32 MiB for the next ones instead of giving each back to the system:
// columns of an image come and go with every pass, and a page that the system gives is cleared and
// mapped anew. All threads share one heap: with several, what one thread freed would lie idle while
// another asks for as much. (Small blocks do not come to it: each thread keeps some.) At the
// beginning of a program.
void KeepFreedMemory();

}  // namespace lucerna
