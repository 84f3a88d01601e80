// Which uploads and commits are under way, of whom, and do they still move?
//
// Memory grows with what arrives and a stream that has stopped keeps what has come, so each caller
// has a bounded number of streams and bytes, and a stream that brings nothing for long is ended.
//
// Threads: any.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>

#include "render/base/clock.h"
#include "render/base/mutex.h"
#include "render/base/status.h"

namespace lucerna {

class OpenTransfers {
 public:
  struct Limits {
    // Of one caller. A farm behind one address, or with one token, has a commit for each worker.
    std::size_t streams = 16384;
    std::uint64_t bytes = std::uint64_t{16} << 30;  // announced by streams that are open
    // What 1 MiB takes at 10 kB/s, and a minute.
    Duration longest_silence = std::chrono::seconds(165);
  };
  OpenTransfers(const Clock& clock, Limits limits) : clock_(clock), limits_(limits) {}

  // One stream, as long as this lives.
  class Transfer {
   public:
    ~Transfer();
    Transfer(const Transfer&) = delete;
    Transfer& operator=(const Transfer&) = delete;

    // Something has come.
    void Progress();
    // All has come; what follows is the coordinator's own work and takes what it takes.
    void Complete();
    // How many bytes will come. Errors: RESOURCE_EXHAUSTED when they are too many for this caller.
    [[nodiscard]] Status Announce(std::uint64_t size_bytes);

   private:
    friend class OpenTransfers;
    struct State {
      std::string caller;
      std::uint64_t size_bytes = 0;
      SteadyTime moved_at;
      bool is_complete = false;
      std::function<void()> end;
    };
    Transfer(OpenTransfers& all, std::list<State>::iterator state) : all_(all), state_(state) {}
    OpenTransfers& all_;
    const std::list<State>::iterator state_;
  };
  // `end` breaks the stream off; it must not end the Transfer itself.
  // Errors: RESOURCE_EXHAUSTED when the caller has too many.
  [[nodiscard]] StatusOr<std::unique_ptr<Transfer>> Open(const std::string& caller,
                                                         std::function<void()> end);

  // To be called often: ends the streams that have stopped.
  void Tick();

 private:
  struct Use {
    std::size_t streams = 0;
    std::uint64_t bytes = 0;
  };

  const Clock& clock_;
  const Limits limits_;
  Mutex mutex_;
  std::list<Transfer::State> open_ LUCERNA_GUARDED_BY(mutex_);
  std::map<std::string, Use> used_ LUCERNA_GUARDED_BY(mutex_);  // by caller
};

}  // namespace lucerna
