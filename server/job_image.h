// How does a job's image become a file? EXR, with the job's record as metadata.
#pragma once

#include <string>

#include "render/base/clock.h"
#include "render/base/status.h"
#include "server/blob_store.h"
#include "server/job.h"
#include "server/running_job.h"

namespace lucerna {

// The numeric profile of its build, in an image's metadata.
inline constexpr const char* kProfileName = "lucerna.numeric_profile";

// What is known of the run at the moment of the image.
struct RunRecord {
  Duration running{};
  Duration coordinator_cpu{};
  WallTime finished_at;
  std::string numeric_profile;
};

// Packed by so many threads; 0: all. Errors: those of EncodeExr.
[[nodiscard]] StatusOr<Blob> EncodeJobImage(const Job& job, RenderResult result,
                                            const RunRecord& run, int threads);

}  // namespace lucerna
