#include "render/wire/bytes.h"

#include <algorithm>

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
    for (std::size_t i = 0; i < column.size(); ++i) {
      plane[i] = static_cast<char>(static_cast<std::uint8_t>(column[i] >> (8 * p)));
    }
    writer.Compressed(plane);
  }
}

template <typename Value>
std::vector<Value> ReadPlanes(ByteReader& reader, std::size_t rows, bool& too_wide) {
  const std::uint8_t planes = reader.Byte();
  too_wide = planes > sizeof(Value);
  if (too_wide || !reader.ok()) return {};
  std::vector<Value> column;
  for (unsigned int p = 0; p < planes; ++p) {
    const std::string plane = reader.Compressed(rows);
    if (!reader.ok()) return {};
    column.resize(rows, 0);
    for (std::size_t i = 0; i < rows; ++i) {
      column[i] = static_cast<Value>(
          column[i] | static_cast<Value>(Value{static_cast<std::uint8_t>(plane[i])} << (8 * p)));
    }
  }
  column.resize(rows, 0);
  return column;
}

}  // namespace

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

std::string ByteReader::Compressed(std::size_t size) {
  const std::string_view packed = Bytes(Varint());
  // One frame and nothing behind it, whose header promises the size we expect.
  if (!ok_ || ZSTD_getFrameContentSize(packed.data(), packed.size()) != size ||
      ZSTD_findFrameCompressedSize(packed.data(), packed.size()) != packed.size()) {
    Fail();
    return {};
  }
  std::string bytes(size, '\0');
  if (ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size()) != size) {
    Fail();
    return {};
  }
  return bytes;
}

std::vector<std::uint32_t> ByteReader::Planes32(std::size_t rows) {
  bool too_wide = false;
  auto column = ReadPlanes<std::uint32_t>(*this, rows, too_wide);
  if (too_wide) Fail();
  return column;
}

std::vector<std::uint64_t> ByteReader::Planes64(std::size_t rows) {
  bool too_wide = false;
  auto column = ReadPlanes<std::uint64_t>(*this, rows, too_wide);
  if (too_wide) Fail();
  return column;
}

}  // namespace lucerna
