// How do a photon guide and the numbers of an emission travel?
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "render/base/status.h"
#include "render/transport/photon_guide.h"
#include "render/wire/bytes.h"

namespace lucerna {

// Nodes in preorder: a byte for the dimension, and the share of all but leaves as a varint.
[[nodiscard]] std::string EncodePhotonGuide(const PhotonGuide& guide);
// Errors: INVALID_ARGUMENT for bytes that are no guide.
[[nodiscard]] StatusOr<PhotonGuide> DecodePhotonGuide(std::string_view bytes);

// Two bytes each, the lower first.
void WriteEmission(ByteWriter& writer,
                   const std::array<std::uint16_t, kEmissionDimensions>& numbers);
[[nodiscard]] std::array<std::uint16_t, kEmissionDimensions> ReadEmission(ByteReader& reader);

}  // namespace lucerna
