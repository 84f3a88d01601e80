// How do results read to a program?
//
// One JSON value each, indented, with a line end; or a table of comma-separated values. Names carry
// their units; absent values are left out. docs/schemas describes each value: a change here is a
// change there, which tests/tools/check_schemas.py holds us to.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/compare/comparison.h"
#include "client/output_options.h"
#include "client/selfcheck/selfcheck.h"
#include "proto/lucerna/v1/jobs.pb.h"
#include "proto/lucerna/v1/photons.pb.h"
#include "render/analysis/expected_cost.h"
#include "render/analysis/needs.h"
#include "render/analysis/scene_memory.h"
#include "render/bake/surface_figures.h"
#include "render/base/digest.h"
#include "render/film/image_metrics.h"
#include "render/formats/diagnostic.h"

namespace lucerna {

// What became of a job's image on this machine.
struct SavedImage {
  std::vector<std::string> paths;
  Digest digest;
};

[[nodiscard]] std::string JobReport(const v1::Job& job, JsonDetail detail);
[[nodiscard]] std::string JobReport(const v1::Job& job, const SavedImage& saved, JsonDetail detail);
// The full job with its convergence record and the shares of its workers.
[[nodiscard]] std::string ConvergenceReport(const v1::Job& job);
// The same record and shares as one table after RFC 4180: `row` is "sample" or "worker", and what a
// row does not have is empty.
[[nodiscard]] std::string ConvergenceCsv(const v1::Job& job);
[[nodiscard]] std::string JobsReport(const std::vector<v1::Job>& jobs, JsonDetail detail);
[[nodiscard]] std::string SavedReport(const std::string& job_id, const SavedImage& saved);
// Of an image without photons: MeshRender::share_unknown.
[[nodiscard]] std::string MeshRenderReport(std::int64_t passes, double share_unknown,
                                           const SavedImage& saved);
[[nodiscard]] std::string SubmittedReport(const v1::SubmitResponse& submitted);
[[nodiscard]] std::string SceneReport(const std::vector<Diagnostic>& diagnostics, bool is_ok);
[[nodiscard]] std::string MetricsReport(const ImageMetrics& metrics);
// What was compared and its table; full, all that was measured too.
[[nodiscard]] std::string ComparisonReport(const Comparison& comparison,
                                           const ComparisonSubject& subject,
                                           const std::vector<ComparedRun>& runs, JsonDetail detail);
// The points of all runs after RFC 4180, a row each: scene, reference, setting, its flags, seed,
// times, photons and errors. The head is a line of its own, for the rows of several scenes.
[[nodiscard]] std::string ComparisonCsvHead();
[[nodiscard]] std::string ComparisonCsvRows(const Comparison& comparison,
                                            const ComparisonSubject& subject,
                                            const std::vector<ComparedRun>& runs);
// Of an image that MakeReference made.
[[nodiscard]] std::string ReferenceReport(const Image& reference, const std::string& path);
// One job of a bake.
// What a bake measured in its rounds, the figures of its surfaces, and the error that the first
// round after the survey estimated at its points, which are spread evenly. `path` is where it was
// written.
[[nodiscard]] std::string BakeReport(const v1::Job& job, const std::string& path);
[[nodiscard]] std::string PhotonReport(const v1::PhotonPath& path);
[[nodiscard]] std::string DigestReport(const Image& image);
[[nodiscard]] std::string PlanReport(const SceneNeeds& needs, const ExpectedCost& cost,
                                     const SceneMemory& memory);
[[nodiscard]] std::string SelfcheckReport(const std::vector<SelfcheckResult>& results);

}  // namespace lucerna
