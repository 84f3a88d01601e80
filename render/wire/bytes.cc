#include "render/wire/bytes.h"

#include <algorithm>
#include <bit>
#include <memory>
#include <utility>

#include <zstd.h>

#include "render/base/status.h"

namespace lucerna {
namespace {

constexpr int kCompressionLevel = 1;

std::string Packed(std::string_view bytes) {
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), kCompressionLevel);
  LUCERNA_CHECK(ZSTD_isError(size) == 0);
  packed.resize(size);
  return packed;
}

// Calls put(row, number) for the numbers whose byte planes follow one another in `bytes`. A fixed
// number of planes, so that the loop is one over vectors.
template <typename Value, unsigned int kPlanes, typename Put>
void JoinPlanes(const std::uint8_t* bytes, std::size_t rows, const Put& put) {
  for (std::size_t i = 0; i < rows; ++i) {
    Value value = 0;
    for (unsigned int p = 0; p < kPlanes; ++p)
      value = static_cast<Value>(value | static_cast<Value>(Value{bytes[p * rows + i]} << (8 * p)));
    put(i, value);
  }
}

template <typename Value, typename Put, unsigned int... kPlanes>
void JoinPlanes(unsigned int planes, const std::uint8_t* bytes, std::size_t rows, const Put& put,
                std::integer_sequence<unsigned int, kPlanes...> /*counts*/) {
  ((planes == kPlanes ? JoinPlanes<Value, kPlanes>(bytes, rows, put) : void()), ...);
}

template <typename Value, typename Put>
void JoinPlanes(unsigned int planes, const std::uint8_t* bytes, std::size_t rows, const Put& put) {
  JoinPlanes<Value>(planes, bytes, rows, put,
                    std::make_integer_sequence<unsigned int, sizeof(Value) + 1>());
}

template <typename Value>
std::vector<Value> Joined(unsigned int planes, const std::uint8_t* bytes, std::size_t rows) {
  std::vector<Value> column(rows);
  JoinPlanes<Value>(planes, bytes, rows,
                    [to = column.data()](std::size_t i, Value value) { to[i] = value; });
  return column;
}

}  // namespace

std::string ByteWriter::Take() {
  if (borrowed_.empty()) return std::move(bytes_);
  std::string all;
  for (const std::string_view piece : Pieces())
    all.append(piece);
  bytes_.clear();
  borrowed_.clear();
  return all;
}

std::vector<std::string_view> ByteWriter::Pieces() const {
  std::vector<std::string_view> pieces;
  pieces.reserve(2 * borrowed_.size() + 1);
  const std::string_view own = bytes_;
  std::size_t done = 0;
  for (const Loan& loan : borrowed_) {
    pieces.push_back(own.substr(done, loan.at - done));
    pieces.push_back(loan.bytes);
    done = loan.at;
  }
  pieces.push_back(own.substr(done));
  return pieces;
}

void ByteWriter::Varint(std::uint64_t value) {
  while (value >= 0x80) {
    Byte(static_cast<std::uint8_t>(value | 0x80));
    value >>= 7;
  }
  Byte(static_cast<std::uint8_t>(value));
}

void ByteWriter::Compressed(std::string_view bytes) {
  const std::string packed = Packed(bytes);
  Varint(packed.size());
  Bytes(packed);
}

template <typename Value>
void ByteWriter::WritePlanes(std::span<const Value> column) {
  Value all = 0;
  for (const Value value : column)
    all |= value;
  std::vector<std::string> planes;
  for (; all != 0; all = static_cast<Value>(all >> 8U))
    planes.emplace_back();
  const auto pack = [&](std::size_t begin, std::size_t end) {
    std::string plane(column.size(), '\0');
    for (std::size_t p = begin; p < end; ++p) {
      std::ranges::transform(column, plane.begin(), [p](Value value) {
        return static_cast<char>(static_cast<std::uint8_t>(value >> (8 * p)));
      });
      planes[p] = Packed(plane);
    }
  };
  if (team_ != nullptr) {
    team_->For(planes.size(), 1, pack);
  } else {
    pack(0, planes.size());
  }
  Byte(static_cast<std::uint8_t>(planes.size()));
  for (const std::string& plane : planes) {
    Varint(plane.size());
    Bytes(plane);
  }
}

void ByteWriter::Planes(std::span<const std::uint32_t> column) {
  WritePlanes(column);
}
void ByteWriter::Planes(std::span<const std::uint64_t> column) {
  WritePlanes(column);
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

ByteReader::ColumnBytes ByteReader::ReadPlanes(unsigned int most_planes, std::size_t rows) {
  const std::uint8_t planes = Byte();
  if (planes > most_planes) Fail();
  // Memory for as many planes as have been found to be there, and not for what the first byte says.
  std::vector<std::string_view> packed;
  for (unsigned int p = 0; p < planes && ok_; ++p)
    packed.push_back(Packed(rows));
  if (!ok_) return {};
  ColumnBytes column = {planes, std::make_unique_for_overwrite<std::uint8_t[]>(planes * rows)};
  for (unsigned int p = 0; p < planes; ++p)
    Unpack(packed[p], column.bytes.get() + p * rows, rows);
  return ok_ ? std::move(column) : ColumnBytes();
}

std::vector<std::uint32_t> ByteReader::Planes32(std::size_t rows) {
  const ColumnBytes column = ReadPlanes(sizeof(std::uint32_t), rows);
  if (!ok_) return {};
  return Joined<std::uint32_t>(column.planes, column.bytes.get(), rows);
}

std::vector<std::uint64_t> ByteReader::Planes64(std::size_t rows) {
  const ColumnBytes column = ReadPlanes(sizeof(std::uint64_t), rows);
  if (!ok_) return {};
  return Joined<std::uint64_t>(column.planes, column.bytes.get(), rows);
}

void ByteReader::Floats(PackedFloats& column) {
  const std::size_t rows = column.size();
  const ColumnBytes bytes = ReadPlanes(column.bytes(), rows);
  if (!ok_) return;
  unsigned int planes = bytes.planes;
  const std::uint8_t* plane = bytes.bytes.get();
  if (column.bytes() == 3) {
    const std::span low = column.low();
    if (planes == 0) {
      std::ranges::fill(low, std::uint8_t{0});
    } else {
      std::copy_n(plane, rows, low.data());
      plane += rows;
      --planes;
    }
  }
  constexpr std::uint16_t kExponent = 0x7F80;  // all ones: infinite or not a number
  std::uint16_t largest_exponent = 0;
  JoinPlanes<std::uint16_t>(
      planes, plane, rows, [&, to = column.high().data()](std::size_t i, std::uint16_t high) {
        largest_exponent = std::max(largest_exponent, static_cast<std::uint16_t>(high & kExponent));
        to[i] = high;
      });
  if (largest_exponent == kExponent) Fail();
}

}  // namespace lucerna
