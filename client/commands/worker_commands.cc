#include "client/commands/worker_commands.h"

#include <vector>

#include "client/connection.h"
#include "client/view/worker_view.h"
#include "render/base/console.h"

namespace lucerna {
namespace {

void Print(const std::vector<v1::Worker>& workers, const OutputOptions& output_options) {
  if (output_options.json) {
    PrintData(WorkersReport(workers));
  } else {
    PrintText(WorkersTable(workers));
  }
}

}  // namespace

Status ListWorkers(const Endpoint& server, const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  LUCERNA_ASSIGN_OR_RETURN(const std::vector<v1::Worker> workers, connection->ListWorkers());
  Print(workers, output_options);
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
  if (!output_options.quiet) Print({worker}, output_options);
  return absl::OkStatus();
}

}  // namespace lucerna
