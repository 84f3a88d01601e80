#include "render/base/parallel.h"

#include <algorithm>
#include <thread>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <xmmintrin.h>
#ifdef __SANITIZE_THREAD__
#include <sanitizer/tsan_interface.h>
#endif

namespace lucerna {
namespace {

// Flush-to-zero and denormals-are-zero for as long as it lives; a thread lent by someone else
// gets its own mode back.
class FlushDenormals {
 public:
  FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | 0x8040U); }
  ~FlushDenormals() { _mm_setcsr(saved_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned int saved_;
};

// What TBB's counters put in order, said again for ThreadSanitizer, with which TBB is not compiled.
class Order {
 public:
#ifdef __SANITIZE_THREAD__
  void Release() {
    __tsan_release(this);
  }
  void Acquire() {
    __tsan_acquire(this);
  }
#else
  void Release() {}
  void Acquire() {}
#endif
};

}  // namespace

int ThreadsOrAll(int threads) {
  if (threads > 0) return threads;
  return static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

struct ThreadTeam::State {
  explicit State(int threads) : arena(threads) {}
  tbb::task_arena arena;
};

ThreadTeam::ThreadTeam(int threads)
    : threads_(ThreadsOrAll(threads)), state_(std::make_unique<State>(threads_)) {}

ThreadTeam::~ThreadTeam() = default;

void ThreadTeam::For(std::size_t count, std::size_t grain,
                     const std::function<void(std::size_t, std::size_t)>& body) {
  if (count == 0) return;
  if (threads_ == 1) {
    const FlushDenormals flush;
    for (std::size_t begin = 0; begin < count; begin += grain) {
      body(begin, std::min(count, begin + grain));
    }
    return;
  }
  Order begin;
  Order end;
  begin.Release();
  state_->arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, count, grain),
        [&](const tbb::blocked_range<std::size_t>& range) {
          const FlushDenormals flush;
          begin.Acquire();
          body(range.begin(), range.end());
          end.Release();
        },
        tbb::simple_partitioner());
  });
  end.Acquire();
}

}  // namespace lucerna
