// How does the program end, and what does a failure have to do with it?
#pragma once

#include <cstdint>
#include <string>

#include "render/base/status.h"

namespace lucerna {

enum class ExitCode : std::uint8_t {
  kDone = 0,
  kFailed = 1,         // what was asked for could not be done: the scene, the job, the files
  kUsage = 2,          // the command line makes no sense
  kUnreachable = 3,    // the coordinator does not answer
  kInterrupted = 130,  // the user (SIGINT) or the system (SIGTERM) ended it
};

// A failure that ends the program with `code`.
[[nodiscard]] Status Failure(ExitCode code, const std::string& message);

// kDone for OK, the code of a Failure, and kFailed for every other status.
[[nodiscard]] ExitCode ExitCodeOf(const Status& status);

}  // namespace lucerna
