// The commands for the workers of a coordinator: list them, and say which may work.
#pragma once

#include <string>

#include "client/output_options.h"
#include "render/base/status.h"
#include "render/wire/channel.h"

namespace lucerna {

// `lucerna workers`. Errors: as ClientConnection.
[[nodiscard]] Status ListWorkers(const Endpoint& server, const OutputOptions& output_options);

enum class WorkerOrder : std::uint8_t { kDrain, kQuarantine, kRelease };
// `lucerna workers drain ID`, and so on. Errors: as ClientConnection, NOT_FOUND.
[[nodiscard]] Status OrderWorker(WorkerOrder order, const std::string& worker_id,
                                 const Endpoint& server, const OutputOptions& output_options);

}  // namespace lucerna
