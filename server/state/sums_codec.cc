#include "server/state/sums_codec.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "render/wire/photon_guide_codec.h"
#include "render/wire/tally_codec.h"

namespace lucerna {
namespace {

static_assert(std::endian::native == std::endian::little);

template <typename Number>
void Write(ByteWriter& writer, Number value) {
  writer.Bytes({reinterpret_cast<const char*>(&value), sizeof(value)});
}

// Numbers as they lie, which are not copied.
template <typename Number>
void WriteColumn(ByteWriter& writer, const std::vector<Number>& column) {
  writer.Borrowed({reinterpret_cast<const char*>(column.data()), column.size() * sizeof(Number)});
}

template <typename Number>
Number Read(ByteReader& reader) {
  Number value{};
  const std::string_view bytes = reader.Bytes(sizeof(value));
  if (bytes.size() == sizeof(value)) std::memcpy(&value, bytes.data(), sizeof(value));
  return value;
}

Status Malformed(const char* what) {
  return absl::InvalidArgumentError(absl::StrCat("malformed checkpoint: ", what));
}

// Calls `column` with each column of sums, in the order of the file.
template <typename Columns, typename Visitor>
void ForEachColumn(Columns& columns, const Visitor& column) {
  for (auto& sums : columns.radiance)
    column(sums);
  for (auto& sums : columns.half_difference)
    column(sums);
  column(columns.direct_difference);
  column(columns.squared_deviations);
  column(columns.bias_squares);
  for (auto* sums :
       {&columns.even_bias, &columns.odd_bias, &columns.photon_count, &columns.largest})
    column(*sums);
}
constexpr std::size_t kPixelBytes = 8 * sizeof(double) + 8 * sizeof(float);
// A column that is not in ForEachColumn would be lost.
static_assert(sizeof(ImageSums::Columns) == 16 * sizeof(std::vector<float>));

// Rows are written as they lie in memory, without gaps.
static_assert(sizeof(ImageSums::Features) == 8 * sizeof(float) + 2 * sizeof(std::uint16_t));
static_assert(sizeof(PixelRadius) == 2 * sizeof(double));
static_assert(sizeof(PassVariance::Pixel) == 3 * sizeof(float));

// Whether so many rows can be there.
bool HasRows(const ByteReader& reader, std::size_t rows, std::size_t row_bytes) {
  return reader.ok() && rows <= reader.left() / row_bytes;
}

// What WriteColumn wrote of a column of this size. Requires that it can be there.
template <typename Number>
void ReadColumn(ByteReader& reader, std::vector<Number>& column) {
  const std::string_view bytes = reader.Bytes(column.size() * sizeof(Number));
  if (!bytes.empty()) std::memcpy(column.data(), bytes.data(), bytes.size());
}

}  // namespace

void WriteDouble(ByteWriter& writer, double value) {
  Write(writer, value);
}

double ReadDouble(ByteReader& reader) {
  return Read<double>(reader);
}

void WriteRadii(ByteWriter& writer, const RadiusColumn& radii) {
  WriteColumn(writer, radii);
}

StatusOr<RadiusColumn> ReadRadii(ByteReader& reader, std::size_t pixels) {
  if (!HasRows(reader, pixels, sizeof(float))) return Malformed("radii are missing");
  RadiusColumn radii(pixels);
  ReadColumn(reader, radii);
  return radii;
}

void WriteEyePaths(ByteWriter& writer, const EyePathCounts& counts) {
  WriteColumn(writer, counts);
}

StatusOr<EyePathCounts> ReadEyePaths(ByteReader& reader, std::size_t pixels) {
  if (!HasRows(reader, pixels, 1)) return Malformed("eye paths are missing");
  EyePathCounts counts(pixels);
  ReadColumn(reader, counts);
  const auto is_none = [](std::uint8_t count) { return count < 1 || count > kMostEyePaths; };
  if (std::ranges::any_of(counts, is_none)) {
    return Malformed("a pixel has no eye path or too many");
  }
  return counts;
}

void WriteNumbers(ByteWriter& writer, const PixelRadii::Numbers& numbers) {
  WriteColumn(writer, numbers.radius);
  WriteColumn(writer, numbers.memory);
}

StatusOr<PixelRadii::Numbers> ReadNumbers(ByteReader& reader, std::size_t pixels,
                                          std::size_t memory_per_pixel) {
  if (!HasRows(reader, pixels * (2 + memory_per_pixel), sizeof(double))) {
    return Malformed("radii are missing");
  }
  PixelRadii::Numbers result = {.radius = std::vector<PixelRadius>(pixels),
                                .memory = std::vector<double>(pixels * memory_per_pixel)};
  ReadColumn(reader, result.radius);
  ReadColumn(reader, result.memory);
  return result;
}

void WriteVariance(ByteWriter& writer, const PassVariance& variance) {
  WriteColumn(writer, variance.pixels());
}

StatusOr<PassVariance> ReadVariance(ByteReader& reader, std::size_t pixels) {
  if (!HasRows(reader, pixels, sizeof(PassVariance::Pixel))) return Malformed("sums are missing");
  std::vector<PassVariance::Pixel> read(pixels);
  ReadColumn(reader, read);
  return PassVariance(std::move(read));
}

void WriteGuide(ByteWriter& writer, const PhotonGuide& guide) {
  const std::string bytes = EncodePhotonGuide(guide);
  writer.Varint(bytes.size());
  writer.Bytes(bytes);
}

StatusOr<PhotonGuide> ReadGuide(ByteReader& reader) {
  return DecodePhotonGuide(reader.Bytes(reader.Varint()));
}

void WriteLearned(ByteWriter& writer, const GuideLearner::Numbers& numbers) {
  writer.Varint(numbers.drawn.size());
  for (const GuideLearner::Drawn& drawn : numbers.drawn) {
    WriteGuide(writer, *drawn.guide);
    Write(writer, drawn.trials);
  }
  writer.Varint(numbers.reports.size());
  for (const EmissionReport& report : numbers.reports) {
    WriteEmission(writer, report.numbers);
    Write(writer, report.pixel);
  }
}

StatusOr<GuideLearner::Numbers> ReadLearned(ByteReader& reader, std::size_t pixels) {
  constexpr std::size_t kReportBytes = 2 * kEmissionDimensions + sizeof(std::uint32_t);
  GuideLearner::Numbers numbers;
  for (std::uint64_t left = reader.Varint(); left > 0; --left) {
    LUCERNA_ASSIGN_OR_RETURN(PhotonGuide guide, ReadGuide(reader));
    const auto trials = Read<double>(reader);
    if (!(trials > 0) || !std::isfinite(trials)) return Malformed("photons were drawn by no guide");
    numbers.drawn.push_back({std::make_shared<const PhotonGuide>(std::move(guide)), trials});
  }
  const std::uint64_t reports = reader.Varint();
  if (!HasRows(reader, reports, kReportBytes)) return Malformed("reports are missing");
  numbers.reports.resize(reports);
  for (EmissionReport& report : numbers.reports) {
    report.numbers = ReadEmission(reader);
    report.pixel = Read<std::uint32_t>(reader);
    if (report.pixel >= pixels) return Malformed("a report is of no pixel");
  }
  return numbers;
}

void WriteSums(ByteWriter& writer, const ImageSums::Whole& sums) {
  writer.Varint(sums.passes);
  WriteDouble(writer, sums.weights.even);
  WriteDouble(writer, sums.weights.odd);
  WriteDouble(writer, sums.weights.squares);
  writer.Varint(sums.photons_per_pass);
  writer.Varint(sums.eye_rays);
  WriteTally(writer, sums.tally);
  ForEachColumn(sums.columns, [&](const auto& column) { WriteColumn(writer, column); });
  WriteColumn(writer, sums.features);
}

StatusOr<ImageSums::Whole> ReadSums(ByteReader& reader, std::size_t pixels) {
  ImageSums::Whole sums;
  sums.passes = reader.Varint();
  sums.weights.even = ReadDouble(reader);
  sums.weights.odd = ReadDouble(reader);
  sums.weights.squares = ReadDouble(reader);
  sums.photons_per_pass = reader.Varint();
  sums.eye_rays = reader.Varint();
  if (const double weight = sums.weights.all(); !std::isfinite(weight) ||
                                                (weight > 0) != (sums.passes > 0) ||
                                                (sums.passes > 0 && sums.photons_per_pass == 0)) {
    return Malformed("passes have no weight");
  }
  LUCERNA_ASSIGN_OR_RETURN(sums.tally, ReadTally(reader));
  if (!HasRows(reader, pixels, kPixelBytes + sizeof(ImageSums::Features))) {
    return Malformed("sums are missing");
  }
  sums.columns = ImageSums::Columns(pixels);
  sums.features.resize(pixels);
  ForEachColumn(sums.columns, [&](auto& column) { ReadColumn(reader, column); });
  ReadColumn(reader, sums.features);
  return sums;
}

}  // namespace lucerna
