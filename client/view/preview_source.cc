#include "client/view/preview_source.h"

#include <algorithm>
#include <utility>

#include "render/base/clock.h"
#include "render/image/exr_file.h"

namespace lucerna {
namespace {

constexpr Duration kFetchEvery = std::chrono::seconds(2);
constexpr int kPausePerCost = 19;  // a twentieth of the time is spent

}  // namespace

PreviewSource::PreviewSource(Fetch fetch)
    : fetch_(std::move(fetch)), thread_([this] { FetchAll(); }) {}

PreviewSource::~PreviewSource() {
  {
    const MutexLock lock(mutex_);
    is_over_ = true;
    changed_.NotifyAll();
  }
  thread_.join();
}

std::shared_ptr<const Image> PreviewSource::Newest() {
  const MutexLock lock(mutex_);
  if (!is_wanted_) {
    is_wanted_ = true;
    changed_.NotifyAll();
  }
  return newest_;
}

bool PreviewSource::IsOver() {
  const MutexLock lock(mutex_);
  return is_over_;
}

void PreviewSource::FetchAll() {
  SteadyTime due = SystemClock().Steady();
  for (;;) {
    {
      const MutexLock lock(mutex_);
      for (;;) {
        if (is_over_) return;
        const Duration pause = due - SystemClock().Steady();
        if (is_wanted_ && pause <= Duration::zero()) break;
        changed_.WaitFor(mutex_, is_wanted_ ? pause : kFetchEvery);
      }
    }
    const SteadyTime began = SystemClock().Steady();
    const StatusOr<std::string> bytes = fetch_([this] { return IsOver(); });
    StatusOr<Image> image = bytes.ok() ? DecodeExr(*bytes) : StatusOr<Image>(bytes.status());
    const SteadyTime ended = SystemClock().Steady();
    due = std::max(began + kFetchEvery, ended + kPausePerCost * (ended - began));
    if (!image.ok()) continue;
    auto newest = std::make_shared<const Image>(*std::move(image));
    const MutexLock lock(mutex_);
    newest_ = std::move(newest);
  }
}

}  // namespace lucerna
