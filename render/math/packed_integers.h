// 64-bit integers in half of that, where they fit.
//
// A number takes four bytes; in a tile of numbers of which one has ever been larger, each takes
// eight more. So sums that may become large, but mostly are not, stay exact.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace lucerna {

class PackedIntegers {
 public:
  // So many consecutive numbers, from a multiple of that on, are a tile.
  static constexpr std::size_t kTileSize = 2048;

  PackedIntegers() = default;
  // All zero.
  explicit PackedIntegers(std::size_t size)
      : narrow_(size), wide_((size + kTileSize - 1) / kTileSize) {}

  [[nodiscard]] std::size_t size() const { return narrow_.size(); }
  [[nodiscard]] bool empty() const { return narrow_.empty(); }
  [[nodiscard]] std::int64_t operator[](std::size_t i) const {
    const std::vector<std::int64_t>& wide = wide_[i / kTileSize];
    return wide.empty() ? narrow_[i] : wide[i % kTileSize];
  }
  // May run beside itself, and beside reading, for numbers of different tiles.
  void Set(std::size_t i, std::int64_t value) {
    std::vector<std::int64_t>& wide = wide_[i / kTileSize];
    if (wide.empty()) {
      if (std::in_range<std::int32_t>(value)) {
        narrow_[i] = static_cast<std::int32_t>(value);
        return;
      }
      const std::size_t first = i / kTileSize * kTileSize;
      const std::size_t last = std::min(size(), first + kTileSize);
      wide.assign(narrow_.data() + first, narrow_.data() + last);
    }
    wide[i % kTileSize] = value;
  }
  // Set of the sum, which fits in 64 bits. Most are small before and after.
  void Add(std::size_t i, std::int64_t value) {
    const std::int64_t sum = (*this)[i] + value;
    if (wide_[i / kTileSize].empty() && std::in_range<std::int32_t>(sum)) {
      narrow_[i] = static_cast<std::int32_t>(sum);
    } else {
      Set(i, sum);
    }
  }
  // Whether the numbers are equal, in whatever tiles.
  bool operator==(const PackedIntegers& other) const { return ToVector() == other.ToVector(); }
  [[nodiscard]] std::vector<std::int64_t> ToVector() const {
    std::vector<std::int64_t> values(size());
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = (*this)[i];
    return values;
  }

 private:
  std::vector<std::int32_t> narrow_;             // of no meaning in wide tiles
  std::vector<std::vector<std::int64_t>> wide_;  // [tiles] the tile's numbers, or empty
};

}  // namespace lucerna
