// What is the newest image to show beside the progress?
//
// A thread fetches and decodes, so that progress never waits for an image. It fetches at most every
// two seconds and spends at most a twentieth of its time, because the coordinator that makes the
// image is also the one that renders it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "render/base/mutex.h"
#include "render/base/status.h"
#include "render/image/image.h"

namespace lucerna {

class PreviewSource {
 public:
  // Brings EXR bytes; ends soon after the function it is given says true.
  using Fetch = std::function<StatusOr<std::string>(const std::function<bool()>& gives_up)>;

  explicit PreviewSource(Fetch fetch);
  // Gives up a fetch that is under way.
  ~PreviewSource();
  PreviewSource(const PreviewSource&) = delete;
  PreviewSource& operator=(const PreviewSource&) = delete;

  // The newest image that arrived, and that there is something to fetch from now on; null before
  // the first. What cannot be fetched or read is tried again in its turn.
  [[nodiscard]] std::shared_ptr<const Image> Newest();

 private:
  void FetchAll();
  [[nodiscard]] bool IsOver();

  Fetch fetch_;
  Mutex mutex_;
  Condition changed_;
  bool is_wanted_ LUCERNA_GUARDED_BY(mutex_) = false;
  bool is_over_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::shared_ptr<const Image> newest_ LUCERNA_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace lucerna
