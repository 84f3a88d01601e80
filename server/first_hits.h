// What do eye paths meet first, pass after pass?
//
// Where sets of eye paths take turns (scene/needs.h, EyeSetOf), the camera's rays of a set are the
// same in every pass that uses it, so what they meet is found once. Hits are kept and not surfaces:
// a fifth of the memory, and the rest is soon computed again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "render/geometry/intersector.h"
#include "render/scene/needs.h"

namespace lucerna {

// Of the camera's ray through each pixel; t is infinite where nothing is met.
struct FirstHitsOfSet {
  bool is_known = false;
  std::vector<Hit> hits;  // [pixels of the crop window]
};

class FirstHits {
 public:
  // `sets` take turns; 0 when every pass has eye paths of its own.
  FirstHits(int sets, std::size_t pixels) : sets_(sets), pixels_(pixels) {}

  // Of the set that `pass` uses: known, or to be filled and called known. nullptr when it is not
  // kept. Valid until the next call.
  [[nodiscard]] FirstHitsOfSet* Of(std::uint64_t pass) {
    if (sets_ == 0) return nullptr;
    const auto sets = static_cast<std::uint64_t>(sets_);
    const std::uint64_t turn = pass % sets;
    if (turn >= SetsOfFirstHits(sets_, pixels_)) return nullptr;
    Kept& kept = kept_[turn];
    const std::uint64_t set = EyeSetOf(pass, sets_);
    if (kept.set != set || kept.hits.hits.empty()) {
      kept.set = set;
      kept.hits.is_known = false;
      kept.hits.hits.resize(pixels_);
    }
    return &kept.hits;
  }

 private:
  struct Kept {
    std::uint64_t set = 0;
    FirstHitsOfSet hits;
  };
  int sets_;
  std::size_t pixels_;
  std::map<std::uint64_t, Kept> kept_;  // by turn
};

}  // namespace lucerna
