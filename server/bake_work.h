// What a bake holds while it is in progress.
#pragma once

#include <utility>

#include "render/bake/bake_rounds.h"
#include "server/blob_store.h"

namespace lucerna {

// Touched by the thread whose turn the job has.
struct BakeWork {
  explicit BakeWork(BakeRounds begun) : rounds(std::move(begun)) {}

  BakeRounds rounds;
  PinnedBlobs pinned;  // of the round that is measured now
};

}  // namespace lucerna
