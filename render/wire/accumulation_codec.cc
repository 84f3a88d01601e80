#include "render/wire/accumulation_codec.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "render/wire/bytes.h"
#include "render/wire/photon_guide_codec.h"
#include "render/wire/tally_codec.h"

namespace lucerna {
namespace {

__extension__ using Wide = __int128;

constexpr std::string_view kAccumulationMagic = "LAC6";
// More columns of evidence than any radius controller uses.
constexpr std::uint64_t kMostEvidence = 32;
constexpr std::uint8_t kIndicesAsVarints = 0;
constexpr std::uint8_t kIndicesAsBitmap = 1;
// Colour ratios are fixed-point numbers with so many bits behind the point.
constexpr int kRatioBits = 16;
constexpr std::int64_t kLargestRatio = std::int64_t{1} << 40;

// What the flux of a row is guessed to be. Any guess decodes; a good one is short.
struct Guess {
  std::int64_t green_per_photon = 0;
  std::int64_t red_over_green = 0, blue_over_green = 0;  // times 2^kRatioBits

  [[nodiscard]] std::uint64_t Green(std::uint32_t count) const {
    return static_cast<std::uint64_t>(green_per_photon) * count;
  }
  [[nodiscard]] static std::uint64_t Scaled(std::int64_t green, std::int64_t ratio) {
    return static_cast<std::uint64_t>((Wide{green} * ratio) >> kRatioBits);
  }
};

std::int64_t Quotient(Wide numerator, Wide denominator, std::int64_t largest) {
  if (denominator == 0) return 0;
  const Wide quotient = numerator / denominator;
  return static_cast<std::int64_t>(std::clamp<Wide>(quotient, -Wide{largest}, Wide{largest}));
}

Guess GuessFor(const Accumulation& accumulation) {
  Wide photons = 0;
  std::array<Wide, 3> flux = {0, 0, 0};
  for (const std::uint32_t count : accumulation.counts)
    photons += count;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (const std::int64_t value : accumulation.flux[channel])
      flux[channel] += value;
  }
  Guess guess;
  guess.green_per_photon = Quotient(flux[1], photons, INT64_MAX);
  guess.red_over_green = Quotient(flux[0] << kRatioBits, flux[1], kLargestRatio);
  guess.blue_over_green = Quotient(flux[2] << kRatioBits, flux[1], kLargestRatio);
  return guess;
}

std::string IndicesAsVarints(const std::vector<std::uint32_t>& rows) {
  ByteWriter writer;
  std::uint32_t least = 0;
  for (const std::uint32_t row : rows) {
    writer.Varint(row - least);
    least = row + 1;
  }
  return writer.Take();
}

std::string IndicesAsBitmap(const std::vector<std::uint32_t>& rows, std::size_t hitpoints) {
  std::string bitmap((hitpoints + 7) / 8, '\0');
  for (const std::uint32_t row : rows) {
    bitmap[row / 8] = static_cast<char>(static_cast<std::uint8_t>(bitmap[row / 8]) |
                                        static_cast<std::uint8_t>(1U << (row % 8)));
  }
  return bitmap;
}

// Remainders of one channel; `guess_at` gives the guess for a row.
template <typename GuessAt>
void WriteRemainders(ByteWriter& writer, const std::vector<std::int64_t>& values,
                     const GuessAt& guess_at) {
  std::vector<std::uint64_t> codes(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    codes[i] =
        ZigZag(static_cast<std::int64_t>(static_cast<std::uint64_t>(values[i]) - guess_at(i)));
  }
  writer.Planes(codes);
}

template <typename GuessAt>
std::vector<std::int64_t> ReadRemainders(ByteReader& reader, std::size_t rows,
                                         const GuessAt& guess_at) {
  const std::vector<std::uint64_t> codes = reader.Planes64(rows);
  std::vector<std::int64_t> values(codes.size());
  for (std::size_t i = 0; i < codes.size(); ++i) {
    values[i] =
        static_cast<std::int64_t>(static_cast<std::uint64_t>(UnZigZag(codes[i])) + guess_at(i));
  }
  return values;
}

Status MalformedAccumulation(std::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("malformed accumulation: ", std::string(what)));
}

}  // namespace

std::string EncodeAccumulation(const Accumulation& accumulation, std::size_t hitpoints) {
  LUCERNA_CHECK(accumulation.hitpoints.empty() || accumulation.hitpoints.back() < hitpoints);
  ByteWriter writer;
  writer.Bytes(kAccumulationMagic);
  writer.Varint(hitpoints);
  writer.Varint(accumulation.size());
  WriteTally(writer, accumulation.tally);
  writer.Varint(accumulation.dropped_photons.size());
  for (const std::uint64_t index : accumulation.dropped_photons)
    writer.Varint(index);
  writer.Varint(accumulation.found.size());
  std::uint64_t next = 0;
  for (const FoundPhoton& found : accumulation.found) {
    writer.Varint(found.index - next);
    next = found.index + 1;
    WriteEmission(writer, found.numbers);
    writer.Varint(found.row);
  }

  // The two forms are compared before compression, which shortens both much alike.
  const std::size_t bitmap_size = (hitpoints + 7) / 8;
  std::string indices;
  if (accumulation.size() < bitmap_size) indices = IndicesAsVarints(accumulation.hitpoints);
  const bool as_varints = accumulation.size() < bitmap_size && indices.size() < bitmap_size;
  if (!as_varints) indices = IndicesAsBitmap(accumulation.hitpoints, hitpoints);
  writer.Byte(as_varints ? kIndicesAsVarints : kIndicesAsBitmap);
  if (as_varints) writer.Varint(indices.size());
  writer.Compressed(indices);

  std::vector<std::uint32_t> beyond_one(accumulation.counts);
  for (std::uint32_t& count : beyond_one)
    --count;
  writer.Planes(beyond_one);

  const Guess guess = GuessFor(accumulation);
  writer.Varint(ZigZag(guess.green_per_photon));
  writer.Varint(ZigZag(guess.red_over_green));
  writer.Varint(ZigZag(guess.blue_over_green));
  // By name one after the other: clang 14 lets no lambda capture a structured binding.
  const std::vector<std::int64_t>& red = accumulation.flux[0];
  const std::vector<std::int64_t>& green = accumulation.flux[1];
  const std::vector<std::int64_t>& blue = accumulation.flux[2];
  WriteRemainders(writer, green,
                  [&](std::size_t i) { return guess.Green(accumulation.counts[i]); });
  WriteRemainders(writer, red,
                  [&](std::size_t i) { return Guess::Scaled(green[i], guess.red_over_green); });
  WriteRemainders(writer, blue,
                  [&](std::size_t i) { return Guess::Scaled(green[i], guess.blue_over_green); });
  writer.Varint(accumulation.evidence.size());
  for (const std::vector<std::int64_t>& column : accumulation.evidence) {
    WriteRemainders(writer, column, [](std::size_t) { return std::uint64_t{0}; });
  }
  return writer.Take();
}

StatusOr<Accumulation> DecodeAccumulation(std::string_view bytes, std::size_t hitpoints) {
  ByteReader reader(bytes);
  if (reader.Bytes(kAccumulationMagic.size()) != kAccumulationMagic)
    return MalformedAccumulation("wrong magic or version");
  if (reader.Varint() != hitpoints) return MalformedAccumulation("made for another block");
  const std::uint64_t rows = reader.Varint();
  if (rows > hitpoints) return MalformedAccumulation("more rows than the block has");

  Accumulation accumulation;
  StatusOr<BatchTally> tally = ReadTally(reader);
  if (!tally.ok()) return MalformedAccumulation(std::string(tally.status().message()));
  accumulation.tally = *std::move(tally);
  const std::uint64_t named = reader.Varint();
  if (named > kDroppedNamed) return MalformedAccumulation("it names too many dropped photons");
  for (std::uint64_t i = 0; i < named; ++i) {
    accumulation.dropped_photons.push_back(reader.Varint());
  }
  const std::uint64_t reports = reader.Varint();
  if (reports > kMostReports || reports > accumulation.tally.photons) {
    return MalformedAccumulation("it reports too many photons");
  }
  std::uint64_t next = 0;
  for (std::uint64_t i = 0; i < reports && reader.ok(); ++i) {
    FoundPhoton found;
    const std::uint64_t step = reader.Varint();
    if (step >= UINT64_MAX - next)
      return MalformedAccumulation("it reports a photon that does not exist");
    found.index = next + step;
    next = found.index + 1;
    found.numbers = ReadEmission(reader);
    const std::uint64_t row = reader.Varint();
    if (row >= hitpoints) return MalformedAccumulation("it reports a photon of no hitpoint");
    found.row = static_cast<std::uint32_t>(row);
    accumulation.found.push_back(found);
  }

  const std::uint8_t form = reader.Byte();
  if (!reader.ok()) return MalformedAccumulation("truncated");
  accumulation.hitpoints.reserve(rows);
  if (form == kIndicesAsVarints) {
    const std::uint64_t size = reader.Varint();
    // The encoder never writes varints that are as long as the bitmap.
    if (size >= (hitpoints + 7) / 8) return MalformedAccumulation("its index is too long");
    const std::string indices = reader.Compressed(size);
    ByteReader index_reader(indices);
    std::uint64_t least = 0;
    for (std::uint64_t i = 0; i < rows && index_reader.ok(); ++i) {
      const std::uint64_t step = index_reader.Varint();
      if (step >= hitpoints - least)
        return MalformedAccumulation("it names a hitpoint that does not exist");
      accumulation.hitpoints.push_back(static_cast<std::uint32_t>(least + step));
      least += step + 1;
    }
    if (!reader.ok() || !index_reader.finished())
      return MalformedAccumulation("its index is damaged");
  } else if (form == kIndicesAsBitmap) {
    const std::string bitmap = reader.Compressed((hitpoints + 7) / 8);
    for (std::size_t byte = 0; byte < bitmap.size(); ++byte) {
      for (unsigned int bits = static_cast<std::uint8_t>(bitmap[byte]); bits != 0;
           bits &= bits - 1) {
        const std::size_t row = 8 * byte + static_cast<std::size_t>(std::countr_zero(bits));
        if (row >= hitpoints || accumulation.size() >= rows) {
          return MalformedAccumulation("its bitmap does not fit its counts");
        }
        accumulation.hitpoints.push_back(static_cast<std::uint32_t>(row));
      }
    }
    if (!reader.ok() || accumulation.size() != rows)
      return MalformedAccumulation("its bitmap is damaged");
  } else {
    return MalformedAccumulation("an unknown form of index");
  }

  accumulation.counts = reader.Planes32(rows);
  for (std::uint32_t& count : accumulation.counts) {
    if (++count == 0) return MalformedAccumulation("a photon count does not fit");
  }

  Guess guess;
  guess.green_per_photon = UnZigZag(reader.Varint());
  guess.red_over_green = UnZigZag(reader.Varint());
  guess.blue_over_green = UnZigZag(reader.Varint());
  if (!reader.ok()) return MalformedAccumulation("truncated");
  std::vector<std::int64_t>& red = accumulation.flux[0];
  std::vector<std::int64_t>& green = accumulation.flux[1];
  std::vector<std::int64_t>& blue = accumulation.flux[2];
  green = ReadRemainders(reader, rows,
                         [&](std::size_t i) { return guess.Green(accumulation.counts[i]); });
  if (!reader.ok()) return MalformedAccumulation("its flux is truncated or damaged");
  red = ReadRemainders(
      reader, rows, [&](std::size_t i) { return Guess::Scaled(green[i], guess.red_over_green); });
  blue = ReadRemainders(
      reader, rows, [&](std::size_t i) { return Guess::Scaled(green[i], guess.blue_over_green); });
  const std::uint64_t columns = reader.Varint();
  if (!reader.ok() || columns > kMostEvidence)
    return MalformedAccumulation("its flux or evidence is damaged");
  for (std::uint64_t column = 0; column < columns && reader.ok(); ++column) {
    accumulation.evidence.push_back(
        ReadRemainders(reader, rows, [](std::size_t) { return std::uint64_t{0}; }));
  }
  if (!reader.finished())
    return MalformedAccumulation("its columns are damaged or bytes are left over");
  return accumulation;
}

}  // namespace lucerna
