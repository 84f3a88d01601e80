// Floats of few significant bits, in as many bytes as those bits take.
//
// A float of n significant bits has 8 + n bits that count: sign, exponent and fraction. So 16
// significant bits take three bytes and 8 take two, where a float takes four.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace lucerna {

class PackedFloats {
 public:
  PackedFloats() = default;
  // All zero, with 8 or 16 significant bits.
  PackedFloats(std::size_t size, unsigned int significant_bits)
      : high_(size), low_(significant_bits > 8 ? size : 0) {}

  [[nodiscard]] std::size_t size() const { return high_.size(); }
  [[nodiscard]] bool empty() const { return high_.empty(); }
  // Of the bytes of a float, the two or three highest are kept.
  [[nodiscard]] unsigned int bytes() const { return low_.empty() ? 2 : 3; }

  [[nodiscard]] float operator[](std::size_t i) const {
    return Joined(high_[i], low_.empty() ? std::uint8_t{0} : low_[i]);
  }
  // Bits below the significant ones are cut off.
  void Set(std::size_t i, float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    high_[i] = static_cast<std::uint16_t>(bits >> 16U);
    if (!low_.empty()) low_[i] = static_cast<std::uint8_t>(bits >> 8U);
  }
  // Those from `begin` on, as many as there are in `floats`.
  void Read(std::size_t begin, std::span<float> floats) const {
    const std::uint16_t* const high = high_.data() + begin;
    if (low_.empty()) {
      for (std::size_t i = 0; i < floats.size(); ++i)
        floats[i] = Joined(high[i], 0);
    } else {
      const std::uint8_t* const low = low_.data() + begin;
      for (std::size_t i = 0; i < floats.size(); ++i)
        floats[i] = Joined(high[i], low[i]);
    }
  }
  void Write(std::size_t begin, std::span<const float> floats) {
    for (std::size_t i = 0; i < floats.size(); ++i)
      high_[begin + i] = static_cast<std::uint16_t>(std::bit_cast<std::uint32_t>(floats[i]) >> 16U);
    if (low_.empty()) return;
    for (std::size_t i = 0; i < floats.size(); ++i)
      low_[begin + i] = static_cast<std::uint8_t>(std::bit_cast<std::uint32_t>(floats[i]) >> 8U);
  }

  // [size()] the bytes of the floats apart: the two highest, and the one below them, absent with 8
  // significant bits.
  [[nodiscard]] std::span<const std::uint16_t> high() const { return high_; }
  [[nodiscard]] std::span<const std::uint8_t> low() const { return low_; }
  [[nodiscard]] std::span<std::uint16_t> high() { return high_; }
  [[nodiscard]] std::span<std::uint8_t> low() { return low_; }

  bool operator==(const PackedFloats&) const = default;

 private:
  [[nodiscard]] static float Joined(std::uint16_t high, std::uint8_t low) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(high) << 16U |
                                static_cast<std::uint32_t>(low) << 8U);
  }

  std::vector<std::uint16_t> high_;
  std::vector<std::uint8_t> low_;
};

}  // namespace lucerna
