#include "render/wire/photon_guide_codec.h"

#include <bit>
#include <memory>
#include <utility>
#include <vector>

namespace lucerna {
namespace {

constexpr std::string_view kGuideMagic = "LPG3";

}  // namespace

std::string EncodePhotonGuide(const PhotonGuide& guide) {
  ByteWriter writer;
  writer.Bytes(kGuideMagic);
  writer.Varint(guide.reported());
  writer.Varint(guide.nodes().size());
  for (const PhotonGuide::Node& node : guide.nodes()) {
    writer.Byte(node.dimension);
    if (node.dimension < kEmissionDimensions) writer.Varint(node.low_share);
  }
  const ScatterGuide none;
  const ScatterGuide& scatterings = guide.scatterings() != nullptr ? *guide.scatterings() : none;
  writer.Varint(scatterings.nodes().size());
  for (const ScatterGuide::Node& node : scatterings.nodes()) {
    writer.Byte(static_cast<std::uint8_t>(node.kind));
    if (node.HalvesSpace()) writer.Varint(std::bit_cast<std::uint32_t>(node.place));
    if (node.HalvesDirections()) writer.Byte(node.low_share);
  }
  return writer.Take();
}

StatusOr<PhotonGuide> DecodePhotonGuide(std::string_view bytes) {
  const auto malformed = [] { return absl::InvalidArgumentError("malformed photon guide"); };
  ByteReader reader(bytes);
  if (reader.Bytes(kGuideMagic.size()) != kGuideMagic) return malformed();
  const std::uint64_t reported = reader.Varint();
  const std::uint64_t count = reader.Varint();
  if (reported > UINT32_MAX || count > kMostGuideNodes) return malformed();
  std::vector<PhotonGuide::Node> nodes;
  for (std::uint64_t i = 0; i < count && reader.ok(); ++i) {
    PhotonGuide::Node node = {.dimension = reader.Byte()};
    if (node.dimension < kEmissionDimensions) {
      const std::uint64_t share = reader.Varint();
      if (share > UINT32_MAX) return malformed();
      node.low_share = static_cast<std::uint32_t>(share);
    }
    nodes.push_back(node);
  }
  const std::uint64_t scatter_count = reader.Varint();
  if (scatter_count > kMostScatterNodes) return malformed();
  std::vector<ScatterGuide::Node> scatter_nodes;
  for (std::uint64_t i = 0; i < scatter_count && reader.ok(); ++i) {
    ScatterGuide::Node node = {.kind = static_cast<ScatterGuide::Node::Kind>(reader.Byte())};
    if (node.HalvesSpace()) {
      const std::uint64_t place = reader.Varint();
      if (place > UINT32_MAX) return malformed();
      node.place = std::bit_cast<float>(static_cast<std::uint32_t>(place));
    }
    if (node.HalvesDirections()) node.low_share = reader.Byte();
    scatter_nodes.push_back(node);
  }
  if (!reader.finished()) return malformed();
  LUCERNA_ASSIGN_OR_RETURN(ScatterGuide scatterings,
                           ScatterGuide::Create(std::move(scatter_nodes)));
  return PhotonGuide::Create(std::move(nodes), static_cast<std::uint32_t>(reported),
                             std::make_shared<const ScatterGuide>(std::move(scatterings)));
}

void WriteEmission(ByteWriter& writer,
                   const std::array<std::uint16_t, kEmissionDimensions>& numbers) {
  for (const std::uint16_t number : numbers) {
    writer.Byte(static_cast<std::uint8_t>(number & 0xFFU));
    writer.Byte(static_cast<std::uint8_t>(number >> 8U));
  }
}

std::array<std::uint16_t, kEmissionDimensions> ReadEmission(ByteReader& reader) {
  std::array<std::uint16_t, kEmissionDimensions> numbers{};
  for (std::uint16_t& number : numbers) {
    const unsigned int low = reader.Byte();
    const unsigned int high = reader.Byte();
    number = static_cast<std::uint16_t>(low | high << 8U);
  }
  return numbers;
}

}  // namespace lucerna
