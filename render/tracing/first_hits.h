// What do eye paths meet first, pass after pass?
//
// Where sets of eye paths take turns (analysis/needs.h, EyeSetOf), the camera's rays of a set are
// the same in every pass that uses it, so what they meet is found once. Only which shape it is is
// kept, 4 bytes for a ray: where the ray meets it is soon computed again. Of large images only the
// first sets are kept (KeptSets), so that memory does not grow with pixels times sets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/analysis/needs.h"
#include "render/geometry/intersector.h"

namespace lucerna {

// Of the camera's ray through each pixel.
struct FirstHitsOfSet {
  bool is_known = false;
  std::vector<std::uint32_t> shapes;  // [pixels of the crop window] see Intersector::ShapeOf
};

static_assert(sizeof(FirstHitsOfSet::shapes[0]) == kFirstHitBytes);

class FirstHits {
 public:
  // `sets` take turns; 0 when every pass has eye paths of its own.
  FirstHits(int sets, std::size_t pixels)
      : pixels_(pixels), sets_(sets), kept_(KeptSets(sets, pixels)) {}

  // Of the set that `pass` uses: known, or to be filled and called known. nullptr when its eye
  // paths are never used again or not kept.
  [[nodiscard]] FirstHitsOfSet* Of(std::uint64_t pass) {
    const std::uint64_t set = EyeSetOf(pass, sets_);
    const std::uint64_t place = sets_ > 0 ? set % static_cast<std::uint64_t>(sets_) : 0;
    if (place >= kept_.size()) return nullptr;
    Kept& kept = kept_[place];
    if (kept.set != set || kept.hits.shapes.empty()) {
      kept.set = set;
      kept.hits.is_known = false;
      kept.hits.shapes.resize(pixels_);
    }
    return &kept.hits;
  }

 private:
  struct Kept {
    std::uint64_t set = 0;
    FirstHitsOfSet hits;
  };
  std::size_t pixels_;
  int sets_;
  std::vector<Kept> kept_;  // by the place of the set among those that take turns
};

}  // namespace lucerna
