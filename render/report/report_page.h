// The report of a job as one HTML page.
//
// One HTML page that stands alone: the image, the facts, how the error fell, who did the work.
// Pure: a Job and the image in, text out. The page has no script, loads nothing from outside and
// forbids itself to, and follows the reader's light or dark setting.
#pragma once

#include <optional>
#include <string>

#include "proto/lucerna/v1/jobs.pb.h"
#include "render/base/digest.h"

namespace lucerna {

// The job's image as the page shows it.
struct PageImage {
  std::string png;
  Digest digest;  // of the pixels, as `lucerna digest` prints it
};

// Everything that may be missing is: an image, samples, workers, settings.
[[nodiscard]] std::string ReportPage(const v1::Job& job, const std::optional<PageImage>& image);

}  // namespace lucerna
