#include "client/commands/worker_commands.h"

#include <cstdio>
#include <vector>

#include "client/connection.h"
#include "client/view/worker_view.h"

namespace lucerna {

Status ListWorkers(const Endpoint& server, const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  LUCERNA_ASSIGN_OR_RETURN(const std::vector<v1::Worker> workers, connection->ListWorkers());
  const std::string text = output_options.json ? WorkersReport(workers) : WorkersTable(workers);
  std::fputs(text.c_str(), stdout);
  return absl::OkStatus();
}

Status OrderWorker(WorkerOrder order, const std::string& worker_id, const Endpoint& server,
                   const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  LUCERNA_ASSIGN_OR_RETURN(const v1::Worker worker, [&]() -> StatusOr<v1::Worker> {
    switch (order) {
      case WorkerOrder::kDrain:
        return connection->DrainWorker(worker_id);
      case WorkerOrder::kQuarantine:
        return connection->QuarantineWorker(worker_id);
      case WorkerOrder::kRelease:
        return connection->ReleaseWorker(worker_id);
    }
    return absl::InternalError("no such order");
  }());
  if (!output_options.quiet) {
    const std::string text = output_options.json ? WorkersReport({worker}) : WorkersTable({worker});
    std::fputs(text.c_str(), stdout);
  }
  return absl::OkStatus();
}

}  // namespace lucerna
