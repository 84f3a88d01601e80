#include "server/job_queue.h"

#include "render/base/status.h"

namespace lucerna {

std::uint64_t JobQueue::Begin() {
  LUCERNA_CHECK(has_waiting() && !current_);
  current_ = waiting_.front();
  waiting_.pop_front();
  return *current_;
}

void JobQueue::End() {
  LUCERNA_CHECK(current_.has_value());
  current_.reset();
}

}  // namespace lucerna
