#include "client/selfcheck/selfcheck.h"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <utility>

#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"

#include "client/exit_code.h"
#include "client/view/report.h"
#include "render/base/clock.h"
#include "render/base/console.h"

namespace lucerna {
namespace {

StatusOr<std::vector<SelfcheckCase>> CasesNamed(const std::string& only) {
  std::vector<SelfcheckCase> cases = MetamorphicCases();
  for (std::vector<SelfcheckCase> more : {ExtremeCases(), SurfaceCases(), NumberCases()})
    std::ranges::move(more, std::back_inserter(cases));
  std::vector<std::string> names;
  for (const SelfcheckCase& one : cases)
    names.push_back(one.name);
  std::erase_if(cases, [&](const SelfcheckCase& one) { return !one.name.starts_with(only); });
  if (!cases.empty()) return cases;
  return Failure(ExitCode::kUsage, absl::StrCat("--only: no case is called \"", only,
                                                "\"; there are ", absl::StrJoin(names, ", ")));
}

// A case that could not be run to its end has failed; only the user's interruption ends the rest.
StatusOr<SelfcheckResult> RunCase(const SelfcheckCase& one, SelfcheckBench& bench) {
  const SteadyTime start = SystemClock().Steady();
  SelfcheckResult result = {.name = one.name, .claim = one.claim};
  StatusOr<CaseOutcome> outcome = one.run(bench);
  if (outcome.ok()) {
    result.outcome = *std::move(outcome);
  } else if (ExitCodeOf(outcome.status()) == ExitCode::kInterrupted) {
    return outcome.status();
  } else {
    result.outcome.note = std::string(outcome.status().message());
  }
  result.wall_s = Seconds(SystemClock().Steady() - start);
  return result;
}

}  // namespace

std::string LineOf(const SelfcheckResult& result) {
  return absl::StrFormat("%-6s %s: %s; %.4g, bound %.4g (%s)\n",
                         result.outcome.holds ? "ok" : "FAILED", result.name, result.claim,
                         result.outcome.figure, result.outcome.bound, result.outcome.note);
}

Status Selfcheck(const std::string& only, const std::string& program_folder,
                 const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const std::vector<SelfcheckCase> cases, CasesNamed(only));
  LUCERNA_ASSIGN_OR_RETURN(const auto bench, SelfcheckBench::Start(program_folder));
  std::vector<SelfcheckResult> results;
  std::vector<std::string> failed;
  for (const SelfcheckCase& one : cases) {
    LUCERNA_ASSIGN_OR_RETURN(const SelfcheckResult result, RunCase(one, *bench));
    if (!result.outcome.holds) failed.push_back(result.name);
    if (!output_options.json && !(output_options.quiet && result.outcome.holds)) {
      PrintText(LineOf(result));
      std::fflush(stdout);
    }
    results.push_back(result);
  }
  if (output_options.json) PrintData(SelfcheckReport(results));
  if (failed.empty()) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat(
      failed.size(), " of ", cases.size(), " cases failed: ", absl::StrJoin(failed, ", ")));
}

}  // namespace lucerna
