#include "render/wire/slice_codec.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "render/wire/bytes.h"
#include "render/wire/photon_guide_codec.h"
#include "render/wire/tally_codec.h"

namespace lucerna {
namespace {

constexpr std::string_view kMagic = "LSL3";

// The low bits of a float of that column that are zero.
unsigned int EmptyBits(std::size_t column, std::size_t evidence) {
  return DroppedBits(SignificantBits(column, evidence));
}

Status Malformed(std::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("malformed slice: ", std::string(what)));
}

// A photon that a message names must be replayable.
Status CheckDropped(const SliceSums& slice, std::uint64_t photons_per_pass) {
  const std::vector<PhotonKey>& named = slice.dropped_photons;
  for (std::size_t i = 0; i < named.size(); ++i) {
    if (named[i].pass < slice.passes.first || named[i].pass >= slice.passes.last ||
        named[i].index >= photons_per_pass || (i > 0 && !(named[i - 1] < named[i]))) {
      return Malformed("it names a dropped photon out of order or out of range");
    }
  }
  if (named.size() != std::min<std::uint64_t>(slice.tally.dropped, kDroppedNamed)) {
    return Malformed("it names more or fewer dropped photons than it has");
  }
  return absl::OkStatus();
}

}  // namespace

std::string EncodeSlice(const SliceSums& slice, ThreadTeam* team) {
  ByteWriter writer;
  writer.Bytes(kMagic);
  writer.Varint(slice.passes.first);
  writer.Varint(slice.passes.size());
  writer.Varint(slice.pixels());
  writer.Varint(slice.columns.size());
  writer.Varint(slice.eye_rays);
  WriteTally(writer, slice.tally);
  writer.Varint(slice.dropped_photons.size());
  for (const PhotonKey& photon : slice.dropped_photons) {
    writer.Varint(photon.pass - slice.passes.first);
    writer.Varint(photon.index);
  }
  writer.Varint(slice.reports.size());
  for (const EmissionReport& report : slice.reports) {
    WriteEmission(writer, report.numbers);
    writer.Varint(report.pixel);
  }
  std::vector<std::string> columns(slice.columns.size());
  const auto encode = [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> codes(slice.pixels());
    for (std::size_t column = begin; column < end; ++column) {
      if (FollowsFromRadiance(slice.passes, column)) continue;
      const unsigned int empty = EmptyBits(column, slice.evidence);
      std::ranges::transform(slice.columns[column], codes.begin(), [&](float value) {
        return std::bit_cast<std::uint32_t>(value) >> empty;
      });
      ByteWriter of_column;
      of_column.Planes(codes);
      columns[column] = of_column.Take();
    }
  };
  if (team != nullptr) {
    team->For(columns.size(), 1, encode);
  } else {
    encode(0, columns.size());
  }
  for (const std::string& column : columns)
    writer.Bytes(column);
  return writer.Take();
}

StatusOr<SliceSums> DecodeSlice(std::string_view bytes, const SliceShape& shape) {
  ByteReader reader(bytes);
  if (reader.Bytes(kMagic.size()) != kMagic) return Malformed("wrong magic or version");
  if (reader.Varint() != shape.passes.first || reader.Varint() != shape.passes.size()) {
    return Malformed("it is of other passes");
  }
  const std::size_t columns = ColumnsOf(shape.passes, shape.evidence);
  if (reader.Varint() != shape.pixels || reader.Varint() != columns) {
    return Malformed("it has another shape");
  }
  SliceSums slice;
  slice.passes = shape.passes;
  slice.evidence = shape.evidence;
  slice.eye_rays = reader.Varint();
  StatusOr<BatchTally> tally = ReadTally(reader);
  if (!reader.ok()) return Malformed("truncated");
  if (!tally.ok()) return Malformed(std::string(tally.status().message()));
  slice.tally = *std::move(tally);
  // Passes that see nothing, and all of a job without light, have no photons.
  if (shape.photons_per_pass == 0 || slice.tally.photons % shape.photons_per_pass != 0 ||
      slice.tally.photons / shape.photons_per_pass > shape.passes.size()) {
    return Malformed("its counters are of another number of photons");
  }
  const std::uint64_t named = reader.Varint();
  if (named > kDroppedNamed) return Malformed("it names too many dropped photons");
  for (std::uint64_t i = 0; i < named; ++i) {
    const std::uint64_t pass = reader.Varint();
    slice.dropped_photons.push_back({shape.passes.first + pass, reader.Varint()});
  }
  if (!reader.ok()) return Malformed("truncated");
  LUCERNA_RETURN_IF_ERROR(CheckDropped(slice, shape.photons_per_pass));
  const std::uint64_t reports = reader.Varint();
  if (reports > kMostReports || reports > slice.tally.photons) {
    return Malformed("it reports too many photons");
  }
  for (std::uint64_t i = 0; i < reports && reader.ok(); ++i) {
    EmissionReport report;
    report.numbers = ReadEmission(reader);
    const std::uint64_t pixel = reader.Varint();
    if (pixel >= shape.pixels) return Malformed("it reports a photon of no pixel");
    report.pixel = static_cast<std::uint32_t>(pixel);
    slice.reports.push_back(report);
  }
  if (!reader.ok()) return Malformed("truncated");
  slice.columns.reserve(columns);
  for (std::size_t column = 0; column < columns; ++column) {
    std::vector<float>& values = slice.columns.emplace_back(shape.pixels);
    if (FollowsFromRadiance(shape.passes, column)) continue;
    reader.Floats(EmptyBits(column, shape.evidence), values);
    if (!reader.ok()) {
      return Malformed(
          "its columns are truncated or damaged, or a value is not finite or too long");
    }
  }
  if (!reader.finished()) return Malformed("bytes are left over");
  if (shape.passes.size() == 1) SetWhatFollowsFromRadiance(slice);
  return slice;
}

}  // namespace lucerna
