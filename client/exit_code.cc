#include "client/exit_code.h"

#include "absl/strings/cord.h"
#include "absl/types/optional.h"

namespace lucerna {
namespace {

// A code of its own, because a gRPC or file system failure can carry any absl code.
constexpr char kPayload[] = "lucerna/exit_code";

}  // namespace

Status Failure(ExitCode code, const std::string& message) {
  Status status = absl::UnknownError(message);
  status.SetPayload(kPayload, absl::Cord(std::to_string(static_cast<int>(code))));
  return status;
}

ExitCode ExitCodeOf(const Status& status) {
  if (status.ok()) return ExitCode::kDone;
  const absl::optional<absl::Cord> code = status.GetPayload(kPayload);
  if (!code.has_value()) return ExitCode::kFailed;
  return static_cast<ExitCode>(std::stoi(std::string(*code)));
}

}  // namespace lucerna
