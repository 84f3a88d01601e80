// Does this build keep its numbers right on this machine?
//
// `lucerna selfcheck` runs cases whose right answer is known without a reference image: a scene
// that is scaled, turned or cut up must give the image it gave before (selfcheck_metamorphic.cc),
// scenes of extreme sizes and brightness must give what a formula says (selfcheck_extreme.cc), and
// so must surfaces (selfcheck_surfaces.cc) and numbers (selfcheck_numbers.cc) at the ends of their
// ranges. What each case does, its bound and its limits: docs/numerics.md.
#pragma once

#include <string>
#include <vector>

#include "client/output_options.h"
#include "client/selfcheck/selfcheck_case.h"
#include "render/base/status.h"

namespace lucerna {

[[nodiscard]] std::vector<SelfcheckCase> MetamorphicCases();
[[nodiscard]] std::vector<SelfcheckCase> ExtremeCases();
[[nodiscard]] std::vector<SelfcheckCase> SurfaceCases();
[[nodiscard]] std::vector<SelfcheckCase> NumberCases();

// A case that was run.
struct SelfcheckResult {
  std::string name;
  std::string claim;
  CaseOutcome outcome = {};
  double wall_s = 0;
};

// Runs the cases whose names begin with `only`, all when it is empty, and prints a line for each.
// Errors: FAILED_PRECONDITION that names the cases that failed, Failure(kUsage) when no name begins
// so, Failure(kInterrupted).
[[nodiscard]] Status Selfcheck(const std::string& only, const std::string& program_folder,
                               const OutputOptions& output_options);

// One line for people.
[[nodiscard]] std::string LineOf(const SelfcheckResult& result);

}  // namespace lucerna
