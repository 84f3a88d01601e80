// How are an estimator's sums laid out in a checkpoint?
//
// Numbers as they are in memory, little-endian: what is read is to the bit what was written, and
// columns are borrowed by the writer, not copied (ByteWriter::Borrowed). Sums are of the same
// machine's build (the checkpoint names its numeric profile), so that nothing is converted.
#pragma once

#include "render/base/status.h"
#include "render/estimate/guide_learning.h"
#include "render/estimate/hitpoint_block.h"
#include "render/estimate/image_sums.h"
#include "render/estimate/photon_steps.h"
#include "render/estimate/pixel_radii.h"
#include "render/wire/bytes.h"

namespace lucerna {

void WriteDouble(ByteWriter& writer, double value);
// Zero from a reader that has failed.
[[nodiscard]] double ReadDouble(ByteReader& reader);

void WriteRadii(ByteWriter& writer, const RadiusColumn& radii);
void WriteEyePaths(ByteWriter& writer, const EyePathCounts& counts);
void WriteNumbers(ByteWriter& writer, const PixelRadii::Numbers& numbers);
void WriteVariance(ByteWriter& writer, const PassVariance& variance);
void WriteSums(ByteWriter& writer, const ImageSums::Whole& sums);
void WriteGuide(ByteWriter& writer, const PhotonGuide& guide);
void WriteLearned(ByteWriter& writer, const GuideLearner::Numbers& numbers);

// Errors of all: INVALID_ARGUMENT for bytes that are truncated or of another shape. Nothing is
// allocated before the bytes are there.
[[nodiscard]] StatusOr<RadiusColumn> ReadRadii(ByteReader& reader, std::size_t pixels);
[[nodiscard]] StatusOr<EyePathCounts> ReadEyePaths(ByteReader& reader, std::size_t pixels);
[[nodiscard]] StatusOr<PixelRadii::Numbers> ReadNumbers(ByteReader& reader, std::size_t pixels,
                                                        std::size_t memory_per_pixel);
[[nodiscard]] StatusOr<PassVariance> ReadVariance(ByteReader& reader, std::size_t pixels);
[[nodiscard]] StatusOr<PhotonGuide> ReadGuide(ByteReader& reader);
[[nodiscard]] StatusOr<GuideLearner::Numbers> ReadLearned(ByteReader& reader, std::size_t pixels);
[[nodiscard]] StatusOr<ImageSums::Whole> ReadSums(ByteReader& reader, std::size_t pixels);

}  // namespace lucerna
