// What does a job's record say of the batches that came back and the bytes that went out?
//
// Pure: changes the job it is given and nothing else.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/clock.h"
#include "render/base/digest.h"
#include "render/estimate/accumulation.h"
#include "server/batch.h"
#include "server/job.h"

namespace lucerna {

// A batch that a worker hands in.
struct Delivery {
  std::string worker;  // the id of its registration
  std::string lease;
  std::string record;  // of the worker (server/worker_records.h)
  Digest digest;       // of the bytes
  WorkKind kind = WorkKind::kPhotons;
  PassKey pass;
  WorkRange range;
  Duration cpu{};                // as the worker says
  std::uint64_t size_bytes = 0;  // as it came over the wire
};

// What its result says of itself.
struct DeliveredCounts {
  BatchTally tally;
  std::vector<PhotonKey> dropped_photons;
  std::uint64_t rows = 0;  // hitpoints or pixels
};

// Counts a batch that was merged. `worker_name` is for people; kept from the first of its batches.
void CountCommit(Job& job, const Delivery& delivery, const DeliveredCounts& counts,
                 std::string_view worker_name, SteadyTime now);

// Counts a block of `hitpoints` rows, or radii (0 rows), that a worker fetched.
void CountFetch(Job& job, std::uint64_t size_bytes, std::uint64_t hitpoints);

}  // namespace lucerna
