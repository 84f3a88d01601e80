#include "render/wire/block_codec.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "render/wire/bytes.h"

namespace lucerna {
namespace {

// The last character is the version.
constexpr std::string_view kBlockMagic = "LHB4";
constexpr std::string_view kRadiiMagic = "LRC1";
constexpr std::string_view kEyePathsMagic = "LEP1";
constexpr std::uint32_t kLargestOctahedralHalf = 65534;

using Column = std::vector<std::uint32_t>;

// Each value as its difference to the one before, wrapping, so that any 32 bits come back.
template <typename ValueAt>
void WriteDeltas(ByteWriter& writer, std::size_t rows, const ValueAt& value_at) {
  Column deltas(rows);
  std::uint32_t before = 0;
  for (std::size_t i = 0; i < rows; ++i) {
    const std::uint32_t value = value_at(i);
    deltas[i] = ZigZag(static_cast<std::int32_t>(value - before));
    before = value;
  }
  writer.Planes(deltas);
}

Column ReadDeltas(ByteReader& reader, std::size_t rows) {
  Column column = reader.Planes32(rows);
  std::uint32_t before = 0;
  for (std::uint32_t& value : column) {
    value = before + static_cast<std::uint32_t>(UnZigZag(value));
    before = value;
  }
  return column;
}

bool IsOctahedral(std::uint32_t code) {
  return (code >> 16) <= kLargestOctahedralHalf && (code & 0xFFFFU) <= kLargestOctahedralHalf;
}

Status MalformedBlock(std::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("malformed hitpoint block: ", std::string(what)));
}

}  // namespace

std::string EncodeHitpointBlock(const HitpointBlock& block, ThreadTeam* team) {
  ByteWriter writer(team);
  writer.Bytes(kBlockMagic);
  writer.Varint(block.size());
  writer.Varint(block.glossy.size());
  writer.Varint(block.caustic_rows);
  writer.Varint(block.places.size());
  writer.Varint(block.segments.size());
  for (int axis = 0; axis < 3; ++axis) {
    WriteDeltas(writer, block.size(), [&](std::size_t i) {
      return std::bit_cast<std::uint32_t>(block.positions[i][axis]);
    });
  }
  WriteDeltas(writer, block.size(), [&](std::size_t i) { return block.normals_oct[i]; });
  const auto& glossy = block.glossy;
  if (!glossy.empty()) {
    WriteDeltas(writer, glossy.size(), [&](std::size_t i) { return glossy[i].hitpoint; });
    WriteDeltas(writer, glossy.size(), [&](std::size_t i) { return glossy[i].material; });
    WriteDeltas(writer, glossy.size(), [&](std::size_t i) { return glossy[i].to_eye_oct; });
    WriteDeltas(writer, glossy.size(), [&](std::size_t i) { return glossy[i].shading_normal_oct; });
  }
  if (const auto& places = block.places; !places.empty()) {
    for (int channel = 0; channel < 3; ++channel) {
      WriteDeltas(writer, places.size(), [&](std::size_t i) {
        return std::bit_cast<std::uint32_t>(places[i].color[channel]);
      });
    }
    for (std::size_t number = 0; number < places[0].numbers.size(); ++number) {
      WriteDeltas(writer, places.size(), [&](std::size_t i) {
        return std::bit_cast<std::uint32_t>(places[i].numbers[number]);
      });
    }
    WriteDeltas(writer, places.size(), [&](std::size_t i) { return places[i].tangent_oct; });
  }
  if (const auto& segments = block.segments; !segments.empty()) {
    for (int axis = 0; axis < 3; ++axis) {
      WriteDeltas(writer, segments.size(), [&](std::size_t i) {
        return std::bit_cast<std::uint32_t>(segments[i].end[axis]);
      });
    }
    WriteDeltas(writer, segments.size(), [&](std::size_t i) { return segments[i].medium; });
    WriteDeltas(writer, segments.size(),
                [&](std::size_t i) { return std::bit_cast<std::uint32_t>(segments[i].narrowing); });
  }
  return writer.Take();
}

StatusOr<HitpointBlock> DecodeHitpointBlock(std::string_view bytes, std::size_t max_hitpoints) {
  ByteReader reader(bytes);
  if (reader.Bytes(kBlockMagic.size()) != kBlockMagic)
    return MalformedBlock("wrong magic or version");
  const std::uint64_t rows = reader.Varint();
  const std::uint64_t glossy_rows = reader.Varint();
  const std::uint64_t caustic_rows = reader.Varint();
  const std::uint64_t textured_rows = reader.Varint();
  const std::uint64_t segment_rows = reader.Varint();
  if (rows > max_hitpoints || segment_rows > rows || glossy_rows > rows - segment_rows ||
      caustic_rows > glossy_rows) {
    return MalformedBlock("more rows than there can be");
  }
  if (textured_rows != 0 && textured_rows != glossy_rows) {
    return MalformedBlock("a column of another length");
  }

  const Column x = ReadDeltas(reader, rows);
  const Column y = ReadDeltas(reader, rows);
  const Column z = ReadDeltas(reader, rows);
  HitpointBlock block;
  block.caustic_rows = caustic_rows;
  block.normals_oct = ReadDeltas(reader, rows);
  if (!reader.ok()) return MalformedBlock("truncated or damaged columns");
  block.positions.resize(rows);
  for (std::size_t i = 0; i < rows; ++i) {
    block.positions[i] = {std::bit_cast<float>(x[i]), std::bit_cast<float>(y[i]),
                          std::bit_cast<float>(z[i])};
    if (!IsFinite(block.positions[i])) return MalformedBlock("a position is not finite");
    if (!IsOctahedral(block.normals_oct[i])) return MalformedBlock("a normal is not a direction");
  }

  if (glossy_rows > 0) {
    const Column hitpoints = ReadDeltas(reader, glossy_rows);
    const Column materials = ReadDeltas(reader, glossy_rows);
    const Column to_eye = ReadDeltas(reader, glossy_rows);
    const Column shading_normals = ReadDeltas(reader, glossy_rows);
    if (!reader.ok()) return MalformedBlock("truncated or damaged glossy columns");
    block.glossy.resize(glossy_rows);
    for (std::size_t i = 0; i < glossy_rows; ++i) {
      block.glossy[i] = {hitpoints[i], materials[i], to_eye[i], shading_normals[i]};
      if (hitpoints[i] >= rows - segment_rows || (i > 0 && hitpoints[i] <= hitpoints[i - 1])) {
        return MalformedBlock("glossy rows are out of order or out of range");
      }
      if (!IsOctahedral(to_eye[i]) || !IsOctahedral(shading_normals[i])) {
        return MalformedBlock("a glossy direction is not a direction");
      }
    }
    if (caustic_rows > 0 &&
        hitpoints[glossy_rows - caustic_rows] != rows - segment_rows - caustic_rows) {
      return MalformedBlock("a caustic hitpoint is not glossy");
    }
  }
  if (textured_rows > 0) {
    const Column r = ReadDeltas(reader, textured_rows);
    const Column g = ReadDeltas(reader, textured_rows);
    const Column b = ReadDeltas(reader, textured_rows);
    if (!reader.ok()) return MalformedBlock("truncated or damaged textures");
    block.places.resize(textured_rows);
    for (std::size_t i = 0; i < textured_rows; ++i) {
      const Rgb color = {std::bit_cast<float>(r[i]), std::bit_cast<float>(g[i]),
                         std::bit_cast<float>(b[i])};
      if (!IsFinite(color) || !(color.r >= 0 && color.g >= 0 && color.b >= 0)) {
        return MalformedBlock("a colour is not a number");
      }
      block.places[i].color = color;
    }
    constexpr float kLargest = 1e4F;
    for (std::size_t number = 0; number < block.places[0].numbers.size(); ++number) {
      const Column values = ReadDeltas(reader, textured_rows);
      if (!reader.ok()) return MalformedBlock("truncated or damaged textures");
      for (std::size_t i = 0; i < textured_rows; ++i) {
        const auto value = std::bit_cast<float>(values[i]);
        if (!(value >= 0 && value <= kLargest))
          return MalformedBlock("a roughness or thickness is out of range");
        block.places[i].numbers[number] = value;
      }
    }
    const Column tangents = ReadDeltas(reader, textured_rows);
    if (!reader.ok()) return MalformedBlock("truncated or damaged textures");
    for (std::size_t i = 0; i < textured_rows; ++i) {
      if (tangents[i] != kNoTangent && !IsOctahedral(tangents[i]))
        return MalformedBlock("a tangent is not a direction");
      block.places[i].tangent_oct = tangents[i];
    }
  }
  if (segment_rows > 0) {
    const Column end_x = ReadDeltas(reader, segment_rows);
    const Column end_y = ReadDeltas(reader, segment_rows);
    const Column end_z = ReadDeltas(reader, segment_rows);
    const Column media = ReadDeltas(reader, segment_rows);
    const Column narrowing = ReadDeltas(reader, segment_rows);
    if (!reader.ok()) return MalformedBlock("truncated or damaged segments");
    block.segments.resize(segment_rows);
    for (std::size_t i = 0; i < segment_rows; ++i) {
      MediumSegment& segment = block.segments[i];
      segment.end = {std::bit_cast<float>(end_x[i]), std::bit_cast<float>(end_y[i]),
                     std::bit_cast<float>(end_z[i])};
      segment.medium = media[i];
      segment.narrowing = std::bit_cast<float>(narrowing[i]);
      if (!IsFinite(segment.end)) return MalformedBlock("the end of a segment is not finite");
      if (!(segment.narrowing > 0 && segment.narrowing <= 1)) {
        return MalformedBlock("a segment's radius does not grow");
      }
    }
  }
  if (!reader.finished()) return MalformedBlock("bytes are left over");
  return block;
}

std::string EncodeRadii(const RadiusColumn& radii, ThreadTeam* team) {
  ByteWriter writer(team);
  writer.Bytes(kRadiiMagic);
  writer.Varint(radii.size());
  WriteDeltas(writer, radii.size(),
              [&](std::size_t i) { return std::bit_cast<std::uint32_t>(radii[i]); });
  return writer.Take();
}

StatusOr<RadiusColumn> DecodeRadii(std::string_view bytes, std::size_t hitpoints) {
  ByteReader reader(bytes);
  if (reader.Bytes(kRadiiMagic.size()) != kRadiiMagic || reader.Varint() != hitpoints) {
    return absl::InvalidArgumentError("malformed radii: wrong magic, version or count");
  }
  const Column bits = ReadDeltas(reader, hitpoints);
  if (!reader.finished()) return absl::InvalidArgumentError("malformed radii: damaged column");
  RadiusColumn radii(hitpoints);
  for (std::size_t i = 0; i < hitpoints; ++i) {
    radii[i] = std::bit_cast<float>(bits[i]);
    if (!(radii[i] > 0) || !std::isfinite(radii[i])) {
      return absl::InvalidArgumentError("malformed radii: a radius is not finite and positive");
    }
  }
  return radii;
}

std::string EncodeEyePathCounts(const EyePathCounts& counts) {
  ByteWriter writer;
  writer.Bytes(kEyePathsMagic);
  writer.Varint(counts.size());
  writer.Planes(Column(counts.begin(), counts.end()));
  return writer.Take();
}

StatusOr<EyePathCounts> DecodeEyePathCounts(std::string_view bytes, std::size_t pixels) {
  ByteReader reader(bytes);
  if (reader.Bytes(kEyePathsMagic.size()) != kEyePathsMagic || reader.Varint() != pixels) {
    return absl::InvalidArgumentError("malformed eye paths: wrong magic, version or count");
  }
  const Column column = reader.Planes32(pixels);
  if (!reader.finished()) return absl::InvalidArgumentError("malformed eye paths: damaged column");
  for (const std::uint32_t count : column) {
    if (count < 1 || count > kMostEyePaths) {
      return absl::InvalidArgumentError("malformed eye paths: a pixel has none or too many");
    }
  }
  return EyePathCounts(column.begin(), column.end());
}

}  // namespace lucerna
