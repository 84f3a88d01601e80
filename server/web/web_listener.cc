#include "server/web/web_listener.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <utility>

#include <httplib.h>
#include <nlohmann/json.hpp>

#include "render/base/clock.h"
#include "render/base/text.h"
#include "render/film/display.h"
#include "render/film/png_file.h"
#include "render/image/exr_file.h"
#include "render/report/progress_view.h"
#include "render/report/report_page.h"
#include "render/wire/channel.h"
#include "server/job_message.h"
#include "server/web/web_page.h"
#include "server/work_pool.h"

namespace lucerna {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kJobs = 100;
constexpr std::size_t kThreads = 4;
constexpr std::chrono::seconds kTimeout{10};
// Whatever a name holds, nothing but the page's own script runs, and nothing is loaded from
// elsewhere. Inline styles and pictures are those of the report within it, which has no script.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self'; "
    "img-src blob: "
    "data:; "
    "frame-src 'self' about:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
constexpr const char* kReportPolicy =
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; frame-ancestors 'self'";

// Without the port.
std::string HostIn(const std::string& host) {
  if (host.starts_with('[')) return host.substr(0, host.find(']') + 1);
  return host.substr(0, host.find(':'));
}

int HttpCodeOf(const Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kNotFound:
      return 404;
    case absl::StatusCode::kInvalidArgument:
      return 400;
    case absl::StatusCode::kFailedPrecondition:
      return 409;  // no image yet
    case absl::StatusCode::kUnauthenticated:
      return 401;
    case absl::StatusCode::kPermissionDenied:
      return 403;
    default:
      return 503;
  }
}

void AnswerWith(const Status& status, httplib::Response& response) {
  response.status = HttpCodeOf(status);
  response.set_content(std::string(status.message()) + "\n", "text/plain; charset=utf-8");
}

StatusOr<Display> DisplayOf(const std::string& stops, const std::string& curve) {
  Display display;
  display.exposure_stops.reset();
  if (!stops.empty() && stops != "auto") {
    double value = 0;
    const auto [end, error] = std::from_chars(stops.data(), stops.data() + stops.size(), value);
    if (error != std::errc() || end != stops.data() + stops.size() || !(std::abs(value) <= 100))
      return absl::InvalidArgumentError("stops must be a number from -100 to 100, or auto");
    display.exposure_stops = value;
  }
  if (!curve.empty()) {
    LUCERNA_ASSIGN_OR_RETURN(display.curve, ParseToneCurve(curve));
  }
  return display;
}

Json JobJson(const v1::Job& job) {
  Json json = {{"id", job.job_id()},
               {"name", job.name()},
               {"owner", job.owner()},
               {"state", NameOf(job.state())},
               {"has_ended", HasEnded(job.state())},
               {"passes", job.progress().passes()},
               {"line", HasEnded(job.state()) ? SummaryLine(job) : ProgressLine(job)},
               {"error", ErrorLine(job)},
               {"notes", ErrorNotes(job)},
               {"condition", job.condition()},
               {"failure", job.failure()},
               {"no_workers", job.no_workers()}};
  if (const auto share = ShareDone(job)) json["share_done"] = *share;
  if (const auto left = TimeLeft(job)) json["time_left"] = ShortTime(*left);
  return json;
}

}  // namespace

WebListener::WebListener(Coordinator& coordinator, Options options)
    : coordinator_(coordinator),
      options_(std::move(options)),
      server_(std::make_unique<httplib::Server>()) {}

WebListener::~WebListener() {
  server_->stop();
  if (thread_.joinable()) thread_.join();
}

StatusOr<std::unique_ptr<WebListener>> WebListener::Start(Coordinator& coordinator,
                                                          Options options) {
  std::unique_ptr<WebListener> listener(new WebListener(coordinator, std::move(options)));
  const std::string& address = listener->options_.address;
  const std::size_t colon = address.rfind(':');
  const std::string host = address.substr(0, colon);
  int port = std::atoi(address.c_str() + colon + 1);
  httplib::Server& server = *listener->server_;
  server.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
  // Without the library's SO_REUSEPORT, by which another process could take over the address.
  server.set_socket_options([](socket_t socket) {
    const int on = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  });
  server.set_read_timeout(kTimeout);
  server.set_write_timeout(kTimeout);
  server.set_payload_max_length(0);
  listener->AddPages();
  if (port == 0) {
    port = server.bind_to_any_port(host.c_str());
  } else if (!server.bind_to_port(host.c_str(), port)) {
    port = -1;
  }
  if (port <= 0) return absl::UnavailableError(Concat("cannot listen on ", address));
  listener->address_ = Concat(host, ":", port);
  listener->is_loopback_ = IsLoopback(address);
  listener->thread_ = std::thread([&server] { server.listen_after_bind(); });
  while (!server.is_running())
    std::this_thread::yield();
  return listener;
}

bool WebListener::MayRead(const httplib::Request& request, httplib::Response& response) const {
  const std::string host = HostIn(request.get_header_value("Host"));
  constexpr std::array<std::string_view, 3> kOwn = {"127.0.0.1", "localhost", "[::1]"};
  if (is_loopback_ && std::ranges::find(kOwn, host) == kOwn.end()) {
    AnswerWith(absl::PermissionDeniedError("this page is for browsers on its own machine"),
               response);
    return false;
  }
  const Status allowed = options_.access->Check("/lucerna.v1.AdminService/ListWorkers",
                                                request.get_header_value("Authorization"));
  if (!allowed.ok()) AnswerWith(allowed, response);
  return allowed.ok();
}

void WebListener::AddPages() {
  httplib::Server& server = *server_;
  server.set_default_headers({{"Content-Security-Policy", kPolicy},
                              {"X-Content-Type-Options", "nosniff"},
                              {"Referrer-Policy", "no-referrer"},
                              {"Cache-Control", "no-store"}});
  const auto page = [&](const char* path, std::string_view text, const char* type) {
    server.Get(path, [text, type](const httplib::Request&, httplib::Response& response) {
      response.set_content(std::string(text), type);
    });
  };
  page("/", kWebPage, "text/html; charset=utf-8");
  page("/page.js", kWebScript, "text/javascript; charset=utf-8");
  page("/page.css", kWebStyle, "text/css; charset=utf-8");
  server.Get("/api/farm", [this](const httplib::Request& request, httplib::Response& response) {
    if (MayRead(request, response))
      response.set_content(Farm(request.get_param_value("job")), "application/json");
  });
  const auto of_job = [&](const char* path, const char* type, auto make) {
    server.Get(path,
               [this, type, make](const httplib::Request& request, httplib::Response& response) {
                 if (!MayRead(request, response)) return;
                 StatusOr<std::string> made = WithinMemory([&] { return make(request); });
                 if (!made.ok()) return AnswerWith(made.status(), response);
                 response.set_content(*std::move(made), type);
                 if (std::string_view(type).starts_with("text/html"))
                   response.headers.erase("Content-Security-Policy"),
                       response.set_header("Content-Security-Policy", kReportPolicy);
               });
  };
  of_job("/jobs/([A-Za-z0-9-]+)/image.png", "image/png", [this](const httplib::Request& request) {
    return PictureOf(request.matches[1], request.get_param_value("stops"),
                     request.get_param_value("curve"));
  });
  of_job("/jobs/([A-Za-z0-9-]+)/report", "text/html; charset=utf-8",
         [this](const httplib::Request& request) { return ReportOf(request.matches[1]); });
}

std::string WebListener::Farm(const std::string& chosen) const {
  Json farm = {{"jobs", Json::array()}, {"workers", Json::array()}, {"log", options_.log()}};
  for (const JobReport& summary : coordinator_.List(JobFilter(), kJobs, 0).first) {
    const v1::Job job = SummaryToProto(summary);
    farm["jobs"].push_back(JobJson(job));
    // A list says less of each than there is.
    if (job.job_id() != chosen && farm["jobs"].size() > 1) continue;
    if (const StatusOr<JobReport> report = coordinator_.ReportOf(job.job_id()); report.ok())
      farm["job"] = JobJson(ToProto(*report));
  }
  for (const WorkerRecord& worker : coordinator_.ListWorkers()) {
    farm["workers"].push_back({{"id", worker.id},
                               {"name", worker.name},
                               {"state", NameOf(worker.state)},
                               {"reason", worker.reason},
                               {"is_connected", worker.is_connected},
                               {"held", worker.held},
                               {"committed", worker.leases.committed},
                               {"failed", worker.leases.failed},
                               {"stalled", worker.leases.stalled},
                               {"lost", worker.leases.lost},
                               {"crashed", worker.leases.crashed}});
  }
  return farm.dump(-1, ' ', false, Json::error_handler_t::replace);
}

StatusOr<WebListener::ClaimedImage> WebListener::ImageOf(const std::string& job_id) {
  LUCERNA_ASSIGN_OR_RETURN(const Blob exr, coordinator_.ImageOf(job_id));
  // Pixels are packed to a half or less, and become a picture.
  constexpr std::uint64_t kUnpacked = 4;
  LUCERNA_ASSIGN_OR_RETURN(
      MemoryClaim claim, coordinator_.budget().Claim(MemoryUse::kImages, kUnpacked * exr->size()));
  LUCERNA_ASSIGN_OR_RETURN(Image pixels, DecodeExr(*exr));
  return ClaimedImage{std::move(claim), std::move(pixels)};
}

StatusOr<std::string> WebListener::PictureOf(const std::string& job_id, const std::string& stops,
                                             const std::string& curve) {
  LUCERNA_ASSIGN_OR_RETURN(const Display display, DisplayOf(stops, curve));
  const MutexLock making(making_);
  LUCERNA_ASSIGN_OR_RETURN(const JobReport report, coordinator_.ReportOf(job_id));
  const std::string key =
      Concat(job_id, " ", ToProto(report).progress().passes(), " ", stops, " ", curve);
  {
    const MutexLock lock(mutex_);
    for (const Picture& picture : pictures_) {
      if (picture.key == key) return picture.png;
    }
  }
  LUCERNA_ASSIGN_OR_RETURN(const ClaimedImage image, ImageOf(job_id));
  LUCERNA_ASSIGN_OR_RETURN(std::string png, EncodePng(image.pixels, display));
  const MutexLock lock(mutex_);
  pictures_.push_front({key, png});
  if (pictures_.size() > kPictures) pictures_.pop_back();
  return png;
}

StatusOr<std::string> WebListener::ReportOf(const std::string& job_id) {
  LUCERNA_ASSIGN_OR_RETURN(const JobReport report, coordinator_.ReportOf(job_id));
  std::optional<PageImage> image;
  const MutexLock making(making_);
  if (const StatusOr<ClaimedImage> found = ImageOf(job_id); found.ok()) {
    LUCERNA_ASSIGN_OR_RETURN(std::string png, EncodePng(found->pixels, Display{std::nullopt, {}}));
    image = PageImage{std::move(png), found->pixels.PixelDigest()};
  }
  return ReportPage(ToProto(report), image);
}

}  // namespace lucerna
