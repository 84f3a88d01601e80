// How do results read to a program?
//
// One JSON value each, indented, with a line end. Names carry their units; absent values are left
// out. The only file that knows the JSON library.
#pragma once

#include <string>
#include <vector>

#include "proto/lucerna/v1/jobs.pb.h"
#include "render/base/digest.h"
#include "render/film/image_metrics.h"
#include "render/scene/pbrt_parser.h"

namespace lucerna {

// What became of a job's image on this machine.
struct SavedImage {
  std::vector<std::string> paths;
  Digest digest;
};

[[nodiscard]] std::string JobReport(const v1::Job& job);
[[nodiscard]] std::string JobReport(const v1::Job& job, const SavedImage& saved);
[[nodiscard]] std::string JobsReport(const std::vector<v1::Job>& jobs);
[[nodiscard]] std::string SavedReport(const std::string& job_id, const SavedImage& saved);
[[nodiscard]] std::string SubmittedReport(const v1::SubmitResponse& submitted);
[[nodiscard]] std::string SceneReport(const std::vector<Diagnostic>& diagnostics, bool is_ok);
[[nodiscard]] std::string MetricsReport(const ImageMetrics& metrics);
[[nodiscard]] std::string DigestReport(const Image& image);

}  // namespace lucerna
