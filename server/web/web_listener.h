// The coordinator's page for browsers: jobs, their images and errors, workers, log lines.
//
// Reads only: nothing that it answers changes anything. Where the coordinator has tokens, the page
// asks for that of an admin, because it shows the jobs of all owners. On a loopback address it
// answers only requests that name one, or a page from elsewhere could read through the browser.
//
//   GET /                                    the page, with /page.js and /page.css
//   GET /api/farm?job=ID                     jobs, that one (or the newest) in full, workers and
//   the
//                                            newest log lines, as JSON
//   GET /jobs/ID/image.png?stops=S&curve=C   the image so far; S: a number or "auto", C: as
//                                            --tonemap
//   GET /jobs/ID/report                      the report of this moment, one page that stands alone
//
// Threads: of its own.
#pragma once

#include <cstddef>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "render/base/mutex.h"
#include "render/base/status.h"
#include "render/image/image.h"
#include "server/access.h"
#include "server/coordinator.h"
#include "server/memory_budget.h"

namespace httplib {
class Server;
struct Request;
struct Response;
}  // namespace httplib

namespace lucerna {

class WebListener {
 public:
  struct Options {
    std::string address;             // "host:port"; port 0: a free one
    const Access* access = nullptr;  // outlives the listener
    // The newest lines of the log, oldest first.
    std::function<std::vector<std::string>()> log;
  };
  // The coordinator outlives the listener. Errors: UNAVAILABLE when it cannot listen there.
  [[nodiscard]] static StatusOr<std::unique_ptr<WebListener>> Start(Coordinator& coordinator,
                                                                    Options options);
  ~WebListener();
  WebListener(const WebListener&) = delete;
  WebListener& operator=(const WebListener&) = delete;

  // "host:port", with the port that it has.
  [[nodiscard]] const std::string& address() const { return address_; }

 private:
  // The image of a job, with memory claimed for it and what is made of it.
  struct ClaimedImage {
    MemoryClaim claim;
    Image pixels;
  };
  [[nodiscard]] StatusOr<ClaimedImage> ImageOf(const std::string& job_id);

  // A picture that may be asked for again.
  struct Picture {
    std::string key;
    std::string png;
  };
  static constexpr std::size_t kPictures = 8;

  WebListener(Coordinator& coordinator, Options options);
  void AddPages();
  [[nodiscard]] bool MayRead(const httplib::Request& request, httplib::Response& response) const;
  [[nodiscard]] std::string Farm(const std::string& chosen) const;
  [[nodiscard]] StatusOr<std::string> PictureOf(const std::string& job_id, const std::string& stops,
                                                const std::string& curve);
  [[nodiscard]] StatusOr<std::string> ReportOf(const std::string& job_id);

  Coordinator& coordinator_;
  const Options options_;
  std::string address_;
  bool is_loopback_ = false;
  Mutex making_;  // one picture or report at a time
  Mutex mutex_;
  std::list<Picture> pictures_ LUCERNA_GUARDED_BY(mutex_);  // newest first
  const std::unique_ptr<httplib::Server> server_;
  std::thread thread_;
};

}  // namespace lucerna
