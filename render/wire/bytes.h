// How are numbers laid out in bytes?
//
// Little-endian, and varints of seven bits a byte, lowest first. Columns of integers are cut into
// byte planes (all lowest bytes, then all second bytes, ...), each compressed on its own by zstd
// level 1: the high planes of small numbers are nearly empty and cost nearly nothing.
//
// A reader is sticky: after the first thing that does not fit, every read gives zero and ok() is
// false, so a codec reads on and checks once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/parallel.h"
#include "render/math/packed_floats.h"

namespace lucerna {

// Small magnitudes of either sign become small numbers.
constexpr std::uint32_t ZigZag(std::int32_t value) {
  return (static_cast<std::uint32_t>(value) << 1) ^ static_cast<std::uint32_t>(value >> 31);
}
constexpr std::int32_t UnZigZag(std::uint32_t code) {
  return static_cast<std::int32_t>((code >> 1) ^ (~(code & 1) + 1));
}
constexpr std::uint64_t ZigZag(std::int64_t value) {
  return (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
}
constexpr std::int64_t UnZigZag(std::uint64_t code) {
  return static_cast<std::int64_t>((code >> 1) ^ (~(code & 1) + 1));
}

class ByteWriter {
 public:
  // The threads of `team` compress the planes of a column, or the caller's does.
  explicit ByteWriter(ThreadTeam* team = nullptr) : team_(team) {}

  void Byte(std::uint8_t value) { bytes_.push_back(static_cast<char>(value)); }
  void Varint(std::uint64_t value);
  void Bytes(std::string_view bytes) { bytes_.append(bytes); }
  // Bytes that are not copied: they must stay where they are until the last call here.
  void Borrowed(std::string_view bytes) { borrowed_.push_back({bytes_.size(), bytes}); }
  // `bytes` compressed, with its compressed size before it.
  void Compressed(std::string_view bytes);
  // A column as byte planes, as many as its largest value needs.
  void Planes(std::span<const std::uint32_t> column);
  void Planes(std::span<const std::uint64_t> column);

  // All that was written, as one; nothing is left here.
  [[nodiscard]] std::string Take();
  // The same, without a copy; until the next call here.
  [[nodiscard]] std::vector<std::string_view> Pieces() const;

 private:
  // Behind so many bytes of bytes_.
  struct Loan {
    std::size_t at = 0;
    std::string_view bytes;
  };
  template <typename Value>
  void WritePlanes(std::span<const Value> column);

  ThreadTeam* team_;
  std::string bytes_;
  std::vector<Loan> borrowed_;
};

class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}

  std::uint8_t Byte();
  std::uint64_t Varint();
  std::string_view Bytes(std::size_t size);
  // What Compressed wrote. Fails unless it unpacks to exactly `size` bytes; nothing is allocated
  // before the compressed bytes themselves have promised that size.
  std::string Compressed(std::size_t size);
  // What Planes wrote of the bytes that `column` keeps, into it. Fails for numbers that have more
  // or are not finite.
  void Floats(PackedFloats& column);
  // What Planes wrote, `rows` of them.
  std::vector<std::uint32_t> Planes32(std::size_t rows);
  std::vector<std::uint64_t> Planes64(std::size_t rows);

  // Whether everything fitted so far.
  [[nodiscard]] bool ok() const { return ok_; }
  // Whether everything fitted and nothing is left over.
  [[nodiscard]] bool finished() const { return ok_ && rest_.empty(); }
  [[nodiscard]] std::size_t left() const { return rest_.size(); }

 private:
  void Fail();
  // The compressed bytes of what Compressed wrote; fails unless they promise to be `size` bytes.
  std::string_view Packed(std::size_t size);
  // Fails unless `packed` gives exactly `size` bytes.
  void Unpack(std::string_view packed, void* bytes, std::size_t size);
  // The byte planes of a column, one after the other, and how many they are; none after a failure.
  struct ColumnBytes {
    unsigned int planes = 0;
    std::unique_ptr<std::uint8_t[]> bytes;
  };
  ColumnBytes ReadPlanes(unsigned int most_planes, std::size_t rows);

  std::string_view rest_;
  bool ok_ = true;
};

}  // namespace lucerna
