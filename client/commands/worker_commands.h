// The commands for the workers of a coordinator: list them, and say which may work.
#pragma once

#include <string>

#include "client/output_options.h"
#include "render/base/status.h"

namespace lucerna {

// `lucerna workers`. Errors: as ClientConnection.
[[nodiscard]] Status ListWorkers(const std::string& server, const OutputOptions& output_options);

enum class WorkerOrder : std::uint8_t { kDrain, kQuarantine, kRelease };
// `lucerna workers drain ID`, and so on. Errors: as ClientConnection, NOT_FOUND.
[[nodiscard]] Status OrderWorker(WorkerOrder order, const std::string& worker_id,
                                 const std::string& server, const OutputOptions& output_options);

}  // namespace lucerna
