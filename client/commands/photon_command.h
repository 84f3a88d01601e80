// What did those photons of that job do?
//
// The worker program replays them, as the workers did that traced them for the job; the client only
// finds the program and shows the ways.
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
  std::string photon;                 // "PASS:INDEX", "PASS:FIRST-LAST", or without a pass
  std::optional<std::uint64_t> pass;  // when `photon` names none; else 0
  std::string program_folder;         // holds lucerna-worker
  std::string token_file = {};        // for lucerna-worker; empty: none
  std::string output = {};            // .ply or .obj file to write; empty: to stdout, as text
};

// Prints what each photon did, step by step, or writes a file that shows it
// (client/view/photon_file.h).
// Errors: Failure(kUsage) for a text that names no photon, or one that the job does not have.
[[nodiscard]] Status TracePhoton(const PhotonRequest& request, const Endpoint& server,
                                 const OutputOptions& output_options);

}  // namespace lucerna
