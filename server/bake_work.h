// What a bake holds while it is in progress: its mesh so far, and what that takes.
#pragma once

#include <utility>

#include "render/bake/bake_rounds.h"
#include "server/blob_store.h"
#include "server/memory_budget.h"

namespace lucerna {

// Touched by the thread whose turn the job has.
struct BakeWork {
  explicit BakeWork(BakeRounds begun) : rounds(std::move(begun)) {}

  BakeRounds rounds;
  MemoryClaim memory;
  PinnedBlobs pinned;  // of the round that is measured now
};

}  // namespace lucerna
