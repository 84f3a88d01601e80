#include "render/wire/photon_guide_codec.h"

#include <utility>
#include <vector>

namespace lucerna {
namespace {

constexpr std::string_view kGuideMagic = "LPG2";

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
  if (!reader.finished()) return malformed();
  return PhotonGuide::Create(std::move(nodes), static_cast<std::uint32_t>(reported));
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
