// Which bytes are almost a file? Truncations and random changes of a good one, the same in every
// run.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

namespace lucerna {

// A number for each key, by splitmix64's mixing (Steele et al. 2014).
[[nodiscard]] inline std::uint64_t Mixed(std::uint64_t key) {
  std::uint64_t x = key + 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}

// Mutation number `key` of `bytes`: one to eight bytes changed, removed, doubled or swapped for
// digits, signs and brackets that mean something to a parser.
[[nodiscard]] inline std::string Mutated(std::string bytes, std::uint64_t key) {
  static constexpr char kMeaningful[] = "0123456789-+.eE\"[]# \n";
  std::uint64_t draw = Mixed(key);
  const std::uint64_t changes = 1 + draw % 8;
  for (std::uint64_t i = 0; i < changes && !bytes.empty(); ++i) {
    draw = Mixed(draw + i);
    const std::size_t at = static_cast<std::size_t>(draw >> 16) % bytes.size();
    switch (draw % 5) {
      case 0:
        bytes[at] = static_cast<char>(draw >> 8);
        break;
      case 1:
        bytes[at] = kMeaningful[(draw >> 8) % (sizeof(kMeaningful) - 1)];
        break;
      case 2:
        bytes.erase(at, 1 + (draw >> 8) % 16);
        break;
      case 3:
        bytes.insert(at, bytes.substr(at, 1 + (draw >> 8) % 64));
        break;
      default:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << ((draw >> 8) % 8)));
        break;
    }
  }
  return bytes;
}

}  // namespace lucerna
