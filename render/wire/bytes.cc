#include "render/wire/bytes.h"

#include <algorithm>
#include <memory>
#include <utility>

#include <zstd.h>

#include "render/base/status.h"

namespace lucerna {
namespace {

constexpr int kCompressionLevel = 1;

template <typename Value>
void WritePlanes(ByteWriter& writer, std::span<const Value> column) {
  Value all = 0;
  for (const Value value : column)
    all |= value;
  std::uint8_t planes = 0;
  for (; all != 0; all = static_cast<Value>(all >> 8U))
    ++planes;
  writer.Byte(planes);
  std::string plane(column.size(), '\0');
  for (unsigned int p = 0; p < planes; ++p) {
    std::ranges::transform(column, plane.begin(), [p](Value value) {
      return static_cast<char>(static_cast<std::uint8_t>(value >> (8 * p)));
    });
    writer.Compressed(plane);
  }
}

// The numbers whose byte planes follow one another in `bytes`. A fixed number of planes, so that
// the loop is one over vectors.
template <typename Value, unsigned int kPlanes>
void JoinPlanes(const std::uint8_t* bytes, std::span<Value> column) {
  const std::size_t rows = column.size();
  for (std::size_t i = 0; i < rows; ++i) {
    Value value = 0;
    for (unsigned int p = 0; p < kPlanes; ++p)
      value = static_cast<Value>(value | static_cast<Value>(Value{bytes[p * rows + i]} << (8 * p)));
    column[i] = value;
  }
}

template <typename Value, unsigned int... kPlanes>
void JoinPlanes(unsigned int planes, const std::uint8_t* bytes, std::span<Value> column,
                std::integer_sequence<unsigned int, kPlanes...> /*counts*/) {
  ((planes == kPlanes + 1 ? JoinPlanes<Value, kPlanes + 1>(bytes, column) : void()), ...);
}

}  // namespace

template <typename Value>
std::vector<Value> ByteReader::Planes(std::size_t rows) {
  const std::uint8_t planes = Byte();
  if (planes > sizeof(Value)) Fail();
  if (!ok_) return {};
  // Memory for as many planes as have been found to be there, and not for what the first byte says.
  std::vector<std::string_view> packed;
  for (unsigned int p = 0; p < planes; ++p)
    packed.push_back(Packed(rows));
  if (!ok_) return {};
  const auto bytes = std::make_unique_for_overwrite<std::uint8_t[]>(planes * rows);
  for (unsigned int p = 0; p < planes; ++p)
    Unpack(packed[p], bytes.get() + p * rows, rows);
  if (!ok_) return {};
  std::vector<Value> column(rows);
  JoinPlanes(planes, bytes.get(), std::span(column),
             std::make_integer_sequence<unsigned int, sizeof(Value)>());
  return column;
}

void ByteWriter::Varint(std::uint64_t value) {
  while (value >= 0x80) {
    Byte(static_cast<std::uint8_t>(value | 0x80));
    value >>= 7;
  }
  Byte(static_cast<std::uint8_t>(value));
}

void ByteWriter::Compressed(std::string_view bytes) {
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), kCompressionLevel);
  LUCERNA_CHECK(ZSTD_isError(size) == 0);
  Varint(size);
  Bytes(std::string_view(packed).substr(0, size));
}

void ByteWriter::Planes(std::span<const std::uint32_t> column) {
  WritePlanes(*this, column);
}
void ByteWriter::Planes(std::span<const std::uint64_t> column) {
  WritePlanes(*this, column);
}

void ByteReader::Fail() {
  ok_ = false;
  rest_ = {};
}

std::uint8_t ByteReader::Byte() {
  if (rest_.empty()) {
    Fail();
    return 0;
  }
  const auto value = static_cast<std::uint8_t>(rest_.front());
  rest_.remove_prefix(1);
  return value;
}

std::uint64_t ByteReader::Varint() {
  std::uint64_t value = 0;
  for (unsigned int shift = 0; shift < 64; shift += 7) {
    const std::uint8_t byte = Byte();
    const std::uint64_t bits = byte & 0x7FU;
    // The tenth byte has room for one bit only.
    if (shift == 63 && bits > 1) break;
    value |= bits << shift;
    if ((byte & 0x80U) == 0) return ok_ ? value : 0;
  }
  Fail();
  return 0;
}

std::string_view ByteReader::Bytes(std::size_t size) {
  if (size > rest_.size()) {
    Fail();
    return {};
  }
  const std::string_view bytes = rest_.substr(0, size);
  rest_.remove_prefix(size);
  return bytes;
}

std::string_view ByteReader::Packed(std::size_t size) {
  const std::string_view packed = Bytes(Varint());
  // One frame and nothing behind it, whose header promises the size we expect.
  if (!ok_ || ZSTD_getFrameContentSize(packed.data(), packed.size()) != size ||
      ZSTD_findFrameCompressedSize(packed.data(), packed.size()) != packed.size()) {
    Fail();
  }
  return packed;
}

void ByteReader::Unpack(std::string_view packed, void* bytes, std::size_t size) {
  if (ok_ && ZSTD_decompress(bytes, size, packed.data(), packed.size()) != size) Fail();
}

std::string ByteReader::Compressed(std::size_t size) {
  const std::string_view packed = Packed(size);
  if (!ok_) return {};
  std::string bytes(size, '\0');
  Unpack(packed, bytes.data(), size);
  return ok_ ? bytes : std::string();
}

std::vector<std::uint32_t> ByteReader::Planes32(std::size_t rows) {
  return Planes<std::uint32_t>(rows);
}

std::vector<std::uint64_t> ByteReader::Planes64(std::size_t rows) {
  return Planes<std::uint64_t>(rows);
}

}  // namespace lucerna
