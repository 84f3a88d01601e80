// What names a batch? The pass it belongs to and the range of its photons.
#pragma once

#include <compare>
#include <cstdint>
#include <string>

namespace lucerna {

struct PassKey {
  std::string job_id;
  std::uint64_t pass = 0;
  auto operator<=>(const PassKey&) const = default;
};

// Photons [first, last) of a pass.
struct PhotonRange {
  std::uint64_t first = 0, last = 0;
  [[nodiscard]] std::uint64_t size() const { return last - first; }
  auto operator<=>(const PhotonRange&) const = default;
};

}  // namespace lucerna
