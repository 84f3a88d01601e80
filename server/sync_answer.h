// What does the coordinator answer to a worker's Sync?
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "render/base/digest.h"
#include "server/scheduler.h"

namespace lucerna {

// What a worker must fetch, and know, of work besides its job.
struct WorkBlobs {
  Digest block;  // of photons
  Digest radii;
  std::size_t rows = 0;  // hitpoints of the block, or pixels
  std::uint64_t photons_per_pass = 0;
  float caustic_radius = 1;  // of passes
  std::size_t guide = 0;     // so many of the job's guides with its own; 0: none
  std::optional<Digest> eye_paths = std::nullopt;  // of passes; absent: one for each pixel
};

// Work with all that a worker must know of it.
struct Loan {
  BatchLease lease;
  WorkBlobs blobs;
};

struct SyncAnswer {
  std::optional<Loan> loan;
  std::vector<std::string> revoked;  // lease ids
};

}  // namespace lucerna
