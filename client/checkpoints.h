// Where does a command keep its jobs until what they make is written?
//
// In a folder beside the output, the state of the command's own coordinator (ClusterOptions). After
// an interruption or a crash the same command with --resume goes on from there.
#pragma once

#include <string>

#include "render/base/status.h"

namespace lucerna {

// Empty when `output` is no file (a device, a pipe), beside which nothing is kept.
[[nodiscard]] std::string CheckpointFolderOf(const std::string& output);

[[nodiscard]] bool HasCheckpoints(const std::string& folder);

// Before the cluster starts: removes what an interruption left, unless it is to be gone on with.
// `what` was interrupted: "render". Errors: FAILED_PRECONDITION when there is nothing to resume,
// and when another command that runs has the folder.
[[nodiscard]] Status OpenCheckpoints(const std::string& folder, bool resumes,
                                     const std::string& what);

// After the cluster has ended. Removes the folder, unless `status` says nothing about the job, or
// what was resumed is to be tried again. Returns `status`, with how to go on where a child died.
[[nodiscard]] Status CloseCheckpoints(const std::string& folder, bool resumes,
                                      const Status& status);

}  // namespace lucerna
