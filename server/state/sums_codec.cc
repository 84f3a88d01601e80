#include "server/state/sums_codec.h"

#include <bit>
#include <cstring>

#include "render/wire/tally_codec.h"

namespace lucerna {
namespace {

static_assert(std::endian::native == std::endian::little);

template <typename Number>
void Write(ByteWriter& writer, Number value) {
  writer.Bytes({reinterpret_cast<const char*>(&value), sizeof(value)});
}

template <typename Number>
Number Read(ByteReader& reader) {
  Number value = 0;
  const std::string_view bytes = reader.Bytes(sizeof(value));
  if (bytes.size() == sizeof(value)) std::memcpy(&value, bytes.data(), sizeof(value));
  return value;
}

Status Malformed(const char* what) {
  return absl::InvalidArgumentError(absl::StrCat("malformed checkpoint: ", what));
}

// Calls `number` with each number of a pixel, in the order of the file.
template <typename Pixel, typename Number>
void ForEachNumber(Pixel& pixel, const Number& number) {
  for (auto* sum : {&pixel.photons, &pixel.direct, &pixel.half_difference}) {
    for (auto& value : *sum)
      number(value);
  }
  number(pixel.squared_deviations);
  number(pixel.even_bias);
  number(pixel.odd_bias);
  number(pixel.photon_count);
  number(pixel.largest);
}
constexpr std::size_t kPixelBytes = 13 * sizeof(double) + sizeof(float);
// A number that is not in ForEachNumber would be lost.
static_assert(sizeof(ImageSums::Pixel) == kPixelBytes + sizeof(float));

template <typename Features, typename Number>
void ForEachFeature(Features& features, const Number& number) {
  number(features.albedo.r);
  number(features.albedo.g);
  number(features.albedo.b);
  number(features.normal.x);
  number(features.normal.y);
  number(features.normal.z);
  number(features.distance);
  number(features.unit_radius);
  number(features.hits);
  number(features.hitpoints);
}
constexpr std::size_t kFeatureBytes = 10 * sizeof(float);
static_assert(sizeof(ImageSums::Features) == kFeatureBytes);

// Whether so many rows can be there.
bool HasRows(const ByteReader& reader, std::size_t rows, std::size_t row_bytes) {
  return reader.ok() && rows <= reader.left() / row_bytes;
}

}  // namespace

void WriteDouble(ByteWriter& writer, double value) {
  Write(writer, value);
}

void WriteFloat(ByteWriter& writer, float value) {
  Write(writer, value);
}

double ReadDouble(ByteReader& reader) {
  return Read<double>(reader);
}

float ReadFloat(ByteReader& reader) {
  return Read<float>(reader);
}

void WriteRadii(ByteWriter& writer, const RadiusColumn& radii) {
  for (const float radius : radii)
    Write(writer, radius);
}

StatusOr<RadiusColumn> ReadRadii(ByteReader& reader, std::size_t pixels) {
  if (!HasRows(reader, pixels, sizeof(float))) return Malformed("radii are missing");
  RadiusColumn radii(pixels);
  for (float& radius : radii)
    radius = Read<float>(reader);
  return radii;
}

void WriteNumbers(ByteWriter& writer, const PixelRadii::Numbers& numbers) {
  for (const PixelRadius& radius : numbers.radius) {
    Write(writer, radius.radius);
    Write(writer, radius.photons);
  }
  for (const double number : numbers.memory)
    Write(writer, number);
}

StatusOr<PixelRadii::Numbers> ReadNumbers(ByteReader& reader, const PixelRadii::Numbers& shape) {
  const std::size_t numbers = 2 * shape.radius.size() + shape.memory.size();
  if (!HasRows(reader, numbers, sizeof(double))) return Malformed("radii are missing");
  PixelRadii::Numbers result;
  result.radius.resize(shape.radius.size());
  result.memory.resize(shape.memory.size());
  for (PixelRadius& radius : result.radius) {
    radius.radius = Read<double>(reader);
    radius.photons = Read<double>(reader);
  }
  for (double& number : result.memory)
    number = Read<double>(reader);
  return result;
}

void WriteSums(ByteWriter& writer, const ImageSums::Whole& sums) {
  writer.Varint(sums.passes);
  writer.Varint(sums.eye_rays);
  WriteTally(writer, sums.tally);
  const auto write = [&](const auto& number) { Write(writer, number); };
  for (const ImageSums::Pixel& pixel : sums.pixels)
    ForEachNumber(pixel, write);
  for (const ImageSums::Features& features : sums.features)
    ForEachFeature(features, write);
}

StatusOr<ImageSums::Whole> ReadSums(ByteReader& reader, std::size_t pixels) {
  ImageSums::Whole sums;
  sums.passes = reader.Varint();
  sums.eye_rays = reader.Varint();
  LUCERNA_ASSIGN_OR_RETURN(sums.tally, ReadTally(reader));
  if (!HasRows(reader, pixels, kPixelBytes + kFeatureBytes)) return Malformed("sums are missing");
  sums.pixels.resize(pixels);
  sums.features.resize(pixels);
  const auto read = [&]<typename Number>(Number& number) { number = Read<Number>(reader); };
  for (ImageSums::Pixel& pixel : sums.pixels)
    ForEachNumber(pixel, read);
  for (ImageSums::Features& features : sums.features)
    ForEachFeature(features, read);
  return sums;
}

}  // namespace lucerna
