// What would a coordinator say of a job whose error falls as theory has it?
#pragma once

#include "proto/lucerna/v1/jobs.pb.h"

namespace lucerna {

// A job that has reached its error target, with `samples` samples of 0.5 s and 0.3 M photons,
// growing by a factor of 1.3 each; three workers; a reference; warnings. Squared noise and bias
// fall exactly as photons^(-2/3), and the interval is from 0.8 to 1.3 times the squared error; the
// true error swings about the estimate.
[[nodiscard]] v1::Job ConvergingJob(int samples = 24);

}  // namespace lucerna
