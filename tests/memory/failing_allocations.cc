#include "tests/memory/failing_allocations.h"

#include <cstdlib>
#include <new>

namespace lucerna {

thread_local int allocations_left = kNever;

}  // namespace lucerna

namespace {

void* Allocate(std::size_t size) {
  int& left = lucerna::allocations_left;
  if (left != lucerna::kNever && left-- == 0) {
    left = lucerna::kNever;
    throw std::bad_alloc();
  }
  if (void* const bytes = std::malloc(size == 0 ? 1 : size)) return bytes;
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
  std::free(bytes);
}
void operator delete[](void* bytes) noexcept {
  std::free(bytes);
}
void operator delete(void* bytes, std::size_t /*size*/) noexcept {
  std::free(bytes);
}
void operator delete[](void* bytes, std::size_t /*size*/) noexcept {
  std::free(bytes);
}
