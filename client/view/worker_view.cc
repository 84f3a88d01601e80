#include "client/view/worker_view.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include <nlohmann/json.hpp>

#include "render/base/escape.h"
#include "render/report/progress_view.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

using Json = nlohmann::ordered_json;

const char* NameOf(v1::WorkerState state) {
  switch (state) {
    case v1::WORKER_STATE_ACTIVE:
      return "active";
    case v1::WORKER_STATE_DRAINING:
      return "draining";
    case v1::WORKER_STATE_DRAINED:
      return "drained";
    case v1::WORKER_STATE_QUARANTINED:
      return "quarantine";
    default:
      return "unknown";
  }
}

}  // namespace

std::string WorkersTable(const std::vector<v1::Worker>& workers) {
  std::string text =
      absl::StrFormat("%-16s %-10s %-9s %5s %8s %6s %7s %6s %7s  %s\n", "WORKER", "STATE", "HEARD",
                      "HOLDS", "DONE", "FAILED", "STALLED", "LOST", "CRASHED", "NAME");
  for (const v1::Worker& worker : workers) {
    const std::string heard =
        worker.is_connected() ? "connected" : ShortTime(FromProto(worker.silent()));
    absl::StrAppendFormat(
        &text, "%-16s %-10s %-9s %5d %8d %6d %7d %6d %7d  %s", Escaped(worker.worker_id()),
        NameOf(worker.state()), heard, worker.leases_held(), worker.committed(), worker.failed(),
        worker.stalled(), worker.lost(), worker.crashed(), Escaped(worker.name()));
    if (!worker.reason().empty()) absl::StrAppend(&text, ": ", Escaped(worker.reason()));
    text += "\n";
  }
  return text;
}

std::string WorkersReport(const std::vector<v1::Worker>& workers) {
  Json json = Json::array();
  for (const v1::Worker& worker : workers) {
    json.push_back({{"worker_id", worker.worker_id()},
                    {"name", worker.name()},
                    {"state", NameOf(worker.state())},
                    {"reason", worker.reason()},
                    {"is_connected", worker.is_connected()},
                    {"silent_s", Seconds(FromProto(worker.silent()))},
                    {"leases_held", worker.leases_held()},
                    {"committed", worker.committed()},
                    {"failed", worker.failed()},
                    {"stalled", worker.stalled()},
                    {"lost", worker.lost()},
                    {"crashed", worker.crashed()}});
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace lucerna
