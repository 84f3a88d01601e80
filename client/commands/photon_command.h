// What did that photon of that job do?
//
// The worker program replays it, as the worker did that traced it for the job; the client only
// finds the program and shows the way.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/output_options.h"
#include "render/base/status.h"
#include "render/wire/channel.h"

namespace lucerna {

struct PhotonRequest {
  std::string job_id;
  std::string photon;                 // "PASS:INDEX", or "INDEX"
  std::optional<std::uint64_t> pass;  // when `photon` names none; else 0
  std::string program_folder;         // holds lucerna-worker
  std::string token_file = {};        // for lucerna-worker; empty: none
};

// Prints what the photon did, step by step.
// Errors: Failure(kUsage) for a text that names no photon, or one that the job does not have.
[[nodiscard]] Status TracePhoton(const PhotonRequest& request, const Endpoint& server,
                                 const OutputOptions& output_options);

}  // namespace lucerna
