// How is work over a range spread over threads?
//
// A ThreadTeam is a fixed number of threads (oneTBB's) that all round denormal numbers to zero,
// as Embree asks for, so that no result depends on which thread made it.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace lucerna {

// As many as asked for; 0: as many as the machine has.
[[nodiscard]] int ThreadsOrAll(int threads);

class ThreadTeam {
 public:
  // threads: as ThreadsOrAll has it.
  explicit ThreadTeam(int threads);
  ~ThreadTeam();
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  [[nodiscard]] int threads() const { return threads_; }

  // Calls body(begin, end) for pieces of [0, count) of at most `grain`, in any order, and returns
  // when all are done. A body must not care how the range was cut.
  void For(std::size_t count, std::size_t grain,
           const std::function<void(std::size_t begin, std::size_t end)>& body);

 private:
  struct State;
  int threads_;
  std::unique_ptr<State> state_;
};

}  // namespace lucerna
