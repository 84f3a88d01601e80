#include "worker/session.h"

#include <algorithm>
#include <utility>

#include <spdlog/spdlog.h>

#include "render/base/escape.h"
#include "render/base/parallel.h"
#include "render/wire/channel.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

constexpr Duration kFirstPause = std::chrono::milliseconds(100);
constexpr Duration kLongestPause = std::chrono::seconds(2);
constexpr Duration kWarnEvery = std::chrono::seconds(5);
constexpr Duration kShortestSync = std::chrono::milliseconds(500);

void SayGoodbye(Connection& connection, const std::string& worker_id) {
  if (const Status status = connection.Goodbye(worker_id); !status.ok()) {
    spdlog::warn("no goodbye: {}", Escaped(std::string(status.message())));
  }
}

std::string WhyNoAnswer(const Endpoint& server, const Status& status) {
  const std::string message(status.message());
  const std::string tls = ExplainTls(server, message);
  if (!tls.empty()) return tls;
  return absl::StrCat("no coordinator answers at ", server.address, " (", message,
                      "); is lucerna-server running there?");
}

}  // namespace

Session::Session(Options options, const Clock& clock)
    : options_(std::move(options)),
      clock_(clock),
      channels_(options_.server),
      cache_(options_.threads,
             [this](const Digest& digest, std::uint64_t max_bytes) -> StatusOr<std::string> {
               std::shared_ptr<Connection> connection;
               {
                 const MutexLock lock(mutex_);
                 connection = connection_;
               }
               return connection->Fetch(digest, max_bytes);
             }) {}

Status Session::Run() {
  while (!is_stopped()) {
    const StatusOr<v1::RegisterResponse> joined = Join();
    if (is_stopped()) break;
    LUCERNA_RETURN_IF_ERROR(joined.status());
    std::shared_ptr<Connection> connection;
    std::shared_ptr<LeaseRunner> runner;
    {
      const MutexLock lock(mutex_);
      connection = connection_;
      runner =
          std::make_shared<LeaseRunner>(*connection, cache_, counts_, joined->worker_id(),
                                        std::max(FromProto(joined->sync_every()), kShortestSync));
      runner_ = runner;
      worker_id_ = joined->worker_id();
    }
    if (is_stopped()) {
      SayGoodbye(*connection, joined->worker_id());
      break;
    }
    spdlog::info("joined {} as {}", options_.server.address, Escaped(joined->worker_id()));
    counts_.is_connected = true;
    const Status why = runner->Run();
    counts_.is_connected = false;
    if (!is_stopped()) ++counts_.lost;
    {
      const MutexLock lock(mutex_);
      runner_ = nullptr;
      if (is_stopped_) break;
    }
    spdlog::warn("lost the coordinator at {}: {}; joining again", options_.server.address,
                 Escaped(std::string(why.message())));
  }
  return absl::OkStatus();
}

StatusOr<v1::RegisterResponse> Session::Join() {
  const SteadyTime give_up_at = clock_.Steady() + options_.connect_timeout;
  SteadyTime warn_at = clock_.Steady();
  Duration pause = kFirstPause;
  v1::RegisterRequest request;
  request.set_name(options_.name);
  request.set_threads(ThreadTeam(options_.threads).threads());
  request.set_numeric_profile(options_.numeric_profile);
  request.set_identity(options_.identity);
  while (true) {
    const auto connection = std::make_shared<Connection>(channels_);
    {
      const MutexLock lock(mutex_);
      if (is_stopped_) return absl::CancelledError("the worker was asked to end");
      connection_ = connection;
    }
    StatusOr<v1::RegisterResponse> response = connection->Register(request);
    if (response.ok() || is_stopped()) return response;
    const Status& status = response.status();
    if (absl::IsUnimplemented(status)) {
      return absl::FailedPreconditionError(
          absl::StrCat("the coordinator does not take workers at ", options_.server.address,
                       "; is it of another version, or is that its address for clients?"));
    }
    // Workers that have gone may count for a while yet.
    const bool has_too_many = absl::IsResourceExhausted(status);
    if (!absl::IsUnavailable(status) && !absl::IsDeadlineExceeded(status) && !has_too_many) {
      return status;
    }
    const SteadyTime now = clock_.Steady();
    if (now >= give_up_at && has_too_many) return status;
    if (now >= give_up_at) {
      return absl::UnavailableError(WhyNoAnswer(options_.server, status));
    }
    if (now >= warn_at) {
      spdlog::warn("{}; trying again", Escaped(WhyNoAnswer(options_.server, status)));
      warn_at = now + kWarnEvery;
    }
    Pause(std::min(pause, give_up_at - now));
    pause = std::min(pause * 2, kLongestPause);
  }
}

bool Session::is_stopped() const {
  const MutexLock lock(mutex_);
  return is_stopped_;
}

void Session::Pause(Duration time) {
  const MutexLock lock(mutex_);
  if (!is_stopped_) changed_.WaitFor(mutex_, time);
}

void Session::Stop() {
  std::shared_ptr<Connection> connection;
  std::shared_ptr<LeaseRunner> runner;
  std::string worker_id;
  {
    const MutexLock lock(mutex_);
    is_stopped_ = true;
    connection = connection_;
    runner = runner_;
    worker_id = worker_id_;
    changed_.NotifyAll();
  }
  // The goodbye first: calls that just break off are taken for a crash, and a batch that several
  // workers crashed at is given up.
  if (runner) {
    SayGoodbye(*connection, worker_id);
    runner->Stop(absl::CancelledError("the worker was asked to end"));
  } else if (connection) {
    connection->BreakOff();
  }
}

}  // namespace lucerna
