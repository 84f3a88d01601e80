// A job as a message to clients, and as a record that a later process reads.
#pragma once

#include <optional>
#include <string>

#include "proto/lucerna/v1/state.pb.h"
#include "render/base/clock.h"
#include "render/base/status.h"
#include "server/job.h"
#include "server/job_table.h"

namespace lucerna {

// A job's warnings go with every message about it.
inline constexpr std::size_t kMostWarnings = 200;

[[nodiscard]] v1::Job ToProto(const JobReport& report);
// What a list of jobs shows of it (JobService.List).
[[nodiscard]] v1::Job SummaryToProto(const JobReport& report);
// Absent for a value that is no state.
[[nodiscard]] std::optional<JobState> FromProto(v1::JobState state);

// A record, as bytes. `running` is the time that the job has run.
[[nodiscard]] std::string EncodeRecord(const Job& job, const std::optional<Digest>& image,
                                       Duration running);

struct DecodedRecord {
  Job job;  // its life began long ago; one that has not ended waits again
  std::optional<Digest> image;
  Duration running{};
};
// `moment` is now.
// Errors: INVALID_ARGUMENT for bytes that are no record of this version.
[[nodiscard]] StatusOr<DecodedRecord> DecodeRecord(const std::string& bytes, const Moment& moment);

}  // namespace lucerna
