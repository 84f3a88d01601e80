#include "tests/memory/failing_allocations.h"

#include <atomic>
#include <cstdlib>
#include <new>

#include <malloc.h>

namespace lucerna {

thread_local int allocations_left = kNever;

namespace {
std::atomic<std::size_t> live_bytes = 0;
std::atomic<std::size_t> most_live_bytes = 0;
}  // namespace

std::size_t LiveBytes() {
  return live_bytes;
}
std::size_t MostLiveBytes() {
  return most_live_bytes;
}
void ForgetMostLiveBytes() {
  most_live_bytes = live_bytes.load();
}

}  // namespace lucerna

namespace {

void Count(std::size_t bytes) {
  const std::size_t now = lucerna::live_bytes += bytes;
  std::size_t most = lucerna::most_live_bytes;
  while (now > most && !lucerna::most_live_bytes.compare_exchange_weak(most, now)) {
  }
}

void Free(void* bytes) {
  lucerna::live_bytes -= malloc_usable_size(bytes);
  std::free(bytes);
}

void* Allocate(std::size_t size) {
  int& left = lucerna::allocations_left;
  if (left != lucerna::kNever && left-- == 0) {
    left = lucerna::kNever;
    throw std::bad_alloc();
  }
  if (void* const bytes = std::malloc(size == 0 ? 1 : size)) {
    Count(malloc_usable_size(bytes));
    return bytes;
  }
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t size) {
  return Allocate(size);
}
void* operator new[](std::size_t size) {
  return Allocate(size);
}
void operator delete(void* bytes) noexcept {
  Free(bytes);
}
void operator delete[](void* bytes) noexcept {
  Free(bytes);
}
void operator delete(void* bytes, std::size_t /*size*/) noexcept {
  Free(bytes);
}
void operator delete[](void* bytes, std::size_t /*size*/) noexcept {
  Free(bytes);
}
