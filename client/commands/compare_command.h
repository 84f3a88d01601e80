// Which settings are ahead on scenes after equal time?
//
// Renders each scene with several settings in turn on a cluster of its own, repetition by
// repetition and setting by setting, so that slow moments of the machine hit all of them, and
// compares with a reference. Errors against time come from the convergence record of one long job a
// run; with a mask or another trimming, which the coordinator does not have, from one job for each
// time.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/commands/job_commands.h"
#include "client/compare/comparison.h"
#include "client/local_cluster.h"
#include "proto/lucerna/v1/jobs.pb.h"
#include "render/base/status.h"
#include "render/estimate/error_estimate.h"
#include "render/scene/render_settings.h"

namespace lucerna {

struct CompareRequest {
  std::vector<std::string> scene_paths;
  RenderOverrides common;                    // of all settings; without stop criteria
  std::vector<std::string> settings;         // "NAME: flags"; empty: one for each radius controller
  std::vector<std::string> reference_paths;  // one for each scene
  std::string mask_path;                     // empty: all pixels
  double trim_share = kTrimmedShare;
  std::string times = "1,2,5,10";  // [s] of processor time over cores
  int repetitions = 3;
  std::string table_path;  // empty: to stdout, unless the result goes there as JSON
  std::string plot_path;   // empty: none; #### is the number of the scene, from 1
  std::string csv_path;    // all points that were measured; empty: none
};

[[nodiscard]] Status CompareSettings(const CompareRequest& request, const ClusterOptions& cluster,
                                     const OutputOptions& output_options);

// A setting as it was typed: "NAME: flags".
struct NamedFlags {
  std::string name;
  std::string words;          // the flags, as typed
  RenderOverrides overrides;  // with the common ones
};
// Errors: Failure(kUsage) for a setting without a name, with another's name, or with flags that
// make no sense.
[[nodiscard]] StatusOr<std::vector<NamedFlags>> ParseSettings(const std::vector<std::string>& typed,
                                                              const RenderOverrides& common);

// "1,2.5,10" as growing seconds. Errors: Failure(kUsage).
[[nodiscard]] StatusOr<std::vector<double>> ParseTimes(const std::string& typed);

// The record of a job with a reference as a curve; samples without a true error are left out.
[[nodiscard]] std::vector<ErrorPoint> CurveOf(const v1::Job& job, int cores, double reference_noise,
                                              double untrimmed_reference_noise);

}  // namespace lucerna
