#include "render/wire/slice_codec.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "render/wire/bytes.h"
#include "render/wire/color_columns.h"
#include "render/wire/photon_guide_codec.h"
#include "render/wire/tally_codec.h"

namespace lucerna {
namespace {

constexpr std::string_view kSliceMagic = "LSL6";

// The column that a column is predicted from: green, of radiance. Itself: from none.
std::size_t BaseOf(std::size_t column) {
  constexpr std::size_t kColors = kSquaredDeviations;
  static_assert(kPhotonRadiance == 0 && kDirectRadiance == 3 && kHalfDifference == 6 &&
                kColors == 9);
  return column < kColors ? column / 3 * 3 + 1 : column;
}

ColorColumn Beside(const SliceSums& slice, std::size_t column) {
  return {.base = slice.columns[BaseOf(column)],
          .counts = column < kDirectRadiance ? &slice.columns[kPhotonCount] : nullptr};
}

// The bytes that are kept of each float, as one number.
void CodesOf(const PackedFloats& values, std::span<std::uint32_t> codes) {
  const std::span high = values.high();
  const std::span low = values.low();
  if (low.empty()) {
    std::ranges::copy(high, codes.begin());
    return;
  }
  for (std::size_t i = 0; i < codes.size(); ++i)
    codes[i] = static_cast<std::uint32_t>(high[i]) << 8U | low[i];
}

// All columns that are sent, each behind those that it is predicted from.
std::vector<std::size_t> SentColumns(const PassRange& passes, std::size_t columns) {
  std::vector<std::size_t> sent = {kPhotonCount};
  const auto send = [&](std::size_t column) {
    if (column != kPhotonCount && !FollowsFromRadiance(passes, column)) sent.push_back(column);
  };
  for (std::size_t column = 0; column < columns; ++column) {
    if (BaseOf(column) == column) send(column);
  }
  for (std::size_t column = 0; column < columns; ++column) {
    if (BaseOf(column) != column) send(column);
  }
  return sent;
}

Status MalformedSlice(std::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("malformed slice: ", std::string(what)));
}

// A photon that a message names must be replayable.
Status CheckDropped(const SliceSums& slice, std::uint64_t photons_per_pass) {
  const std::vector<PhotonKey>& named = slice.dropped_photons;
  for (std::size_t i = 0; i < named.size(); ++i) {
    if (named[i].pass < slice.passes.first || named[i].pass >= slice.passes.last ||
        named[i].index >= photons_per_pass || (i > 0 && !(named[i - 1] < named[i]))) {
      return MalformedSlice("it names a dropped photon out of order or out of range");
    }
  }
  if (named.size() != std::min<std::uint64_t>(slice.tally.dropped, kDroppedNamed)) {
    return MalformedSlice("it names more or fewer dropped photons than it has");
  }
  return absl::OkStatus();
}

// All of a slice but its columns.
StatusOr<SliceSums> ReadHead(ByteReader& reader, const SliceShape& shape) {
  if (reader.Bytes(kSliceMagic.size()) != kSliceMagic)
    return MalformedSlice("wrong magic or version");
  if (reader.Varint() != shape.passes.first || reader.Varint() != shape.passes.size()) {
    return MalformedSlice("it is of other passes");
  }
  const std::size_t columns = ColumnsOf(shape.passes, shape.evidence);
  if (reader.Varint() != shape.pixels || reader.Varint() != columns) {
    return MalformedSlice("it has another shape");
  }
  SliceSums slice;
  slice.passes = shape.passes;
  slice.evidence = shape.evidence;
  slice.eye_rays = reader.Varint();
  StatusOr<BatchTally> tally = ReadTally(reader);
  if (!reader.ok()) return MalformedSlice("truncated");
  if (!tally.ok()) return MalformedSlice(std::string(tally.status().message()));
  slice.tally = *std::move(tally);
  // Passes that see nothing, and all of a job without light, have no photons.
  if (shape.photons_per_pass == 0 || slice.tally.photons % shape.photons_per_pass != 0 ||
      slice.tally.photons / shape.photons_per_pass > shape.passes.size()) {
    return MalformedSlice("its counters are of another number of photons");
  }
  const std::uint64_t named = reader.Varint();
  if (named > kDroppedNamed) return MalformedSlice("it names too many dropped photons");
  for (std::uint64_t i = 0; i < named; ++i) {
    const std::uint64_t pass = reader.Varint();
    slice.dropped_photons.push_back({shape.passes.first + pass, reader.Varint()});
  }
  if (!reader.ok()) return MalformedSlice("truncated");
  LUCERNA_RETURN_IF_ERROR(CheckDropped(slice, shape.photons_per_pass));
  const std::uint64_t reports = reader.Varint();
  if (reports > kMostReports || reports > slice.tally.photons) {
    return MalformedSlice("it reports too many photons");
  }
  for (std::uint64_t i = 0; i < reports && reader.ok(); ++i) {
    EmissionReport report;
    report.numbers = ReadEmission(reader);
    const std::uint64_t pixel = reader.Varint();
    if (pixel >= shape.pixels) return MalformedSlice("it reports a photon of no pixel");
    report.pixel = static_cast<std::uint32_t>(pixel);
    slice.reports.push_back(report);
  }
  if (!reader.ok()) return MalformedSlice("truncated");
  return slice;
}

// Calls add(column, values) for every column that a slice keeps. Those that others are predicted
// from are in `slice` when add returns.
template <typename Add>
Status ReadColumns(ByteReader& reader, const SliceShape& shape, const SliceSums& slice,
                   const Add& add) {
  for (const std::size_t column : SentColumns(shape.passes, slice.columns.size())) {
    PackedFloats values(shape.pixels, SignificantBits(shape.passes.size(), column, shape.evidence));
    bool is_of_column = true;
    if (BaseOf(column) == column) {
      reader.Floats(values);
    } else {
      const std::vector<std::uint32_t> codes = reader.Planes32(shape.pixels);
      is_of_column = reader.ok() && ChannelFromCodes(Beside(slice, column), codes, values);
    }
    if (!is_of_column || !reader.ok()) {
      return MalformedSlice(
          "its columns are truncated or damaged, or a value is not finite or too long");
    }
    add(column, std::move(values));
  }
  if (!reader.finished()) return MalformedSlice("bytes are left over");
  return absl::OkStatus();
}

}  // namespace

std::string EncodeSlice(const SliceSums& slice, ThreadTeam* team) {
  ByteWriter writer;
  writer.Bytes(kSliceMagic);
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
  const std::vector<std::size_t> sent = SentColumns(slice.passes, slice.columns.size());
  std::vector<std::string> columns(sent.size());
  const auto encode = [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> codes(slice.pixels());
    for (std::size_t i = begin; i < end; ++i) {
      const PackedFloats& values = slice.columns[sent[i]];
      if (BaseOf(sent[i]) == sent[i]) {
        CodesOf(values, codes);
      } else {
        CodesOfChannel(Beside(slice, sent[i]), values, codes);
      }
      ByteWriter of_column;
      of_column.Planes(codes);
      columns[i] = of_column.Take();
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
  LUCERNA_ASSIGN_OR_RETURN(SliceSums slice, ReadHead(reader, shape));
  slice.columns.resize(ColumnsOf(shape.passes, shape.evidence));
  LUCERNA_RETURN_IF_ERROR(ReadColumns(
      reader, shape, slice,
      [&](std::size_t column, PackedFloats values) { slice.columns[column] = std::move(values); }));
  return slice;
}

SliceSums EncodedSlice::Unpacked() const {
  StatusOr<SliceSums> slice = DecodeSlice(bytes_, shape_);
  LUCERNA_CHECK(slice.ok());
  return *std::move(slice);
}

Status EncodedSlice::AddTo(SliceSums& sum) const {
  ByteReader reader(bytes_);
  LUCERNA_ASSIGN_OR_RETURN(SliceSums head, ReadHead(reader, shape_));
  SiblingMerge merge(sum, std::move(head));
  LUCERNA_RETURN_IF_ERROR(merge.Begin(shape_.pixels, ColumnsOf(shape_.passes, shape_.evidence)));
  LUCERNA_RETURN_IF_ERROR(ReadColumns(
      reader, shape_, merge.sibling(),
      [&](std::size_t column, PackedFloats values) { merge.Add(column, std::move(values)); }));
  merge.Finish();
  return absl::OkStatus();
}

}  // namespace lucerna
