#include "render/wire/tally_codec.h"

#include <string>

#include "absl/strings/str_cat.h"

namespace lucerna {
namespace {

// Far above what honest workers count. Without it one forged counter could make the sums with the
// results of others overflow, which are then refused in its place.
constexpr std::uint64_t kMostCounted = std::uint64_t{1} << 57;

}  // namespace

void WriteTally(ByteWriter& writer, const BatchTally& tally) {
  writer.Varint(kBatchCounters.size());
  for (const auto& counter : kBatchCounters)
    writer.Varint(tally.*counter.value);
  writer.Varint(kEnergyCounters.size());
  for (const auto& counter : kEnergyCounters)
    writer.Varint(ZigZag(tally.energy.*counter.value));
  writer.Varint(tally.lights.size());
  for (const LightTally& light : tally.lights) {
    writer.Varint(light.sent);
    for (const std::uint64_t in_view : light.in_view)
      writer.Varint(in_view);
  }
}

StatusOr<BatchTally> ReadTally(ByteReader& reader) {
  BatchTally tally;
  if (reader.Varint() != kBatchCounters.size()) {
    return absl::InvalidArgumentError("it has other counters");
  }
  for (const auto& counter : kBatchCounters) {
    tally.*counter.value = reader.Varint();
    if (tally.*counter.value > kMostCounted) {
      return absl::InvalidArgumentError(
          absl::StrCat("it counts too many ", std::string(counter.name)));
    }
  }
  if (reader.Varint() != kEnergyCounters.size()) {
    return absl::InvalidArgumentError("it has other counters");
  }
  for (const auto& counter : kEnergyCounters)
    tally.energy.*counter.value = UnZigZag(reader.Varint());
  if (!tally.energy.Balance()) return absl::InvalidArgumentError("its energy does not balance");
  const std::uint64_t lights = reader.Varint();
  if (lights > kMaxLightTallies) {
    return absl::InvalidArgumentError("it counts the photons of too many lights");
  }
  tally.lights.resize(lights);
  for (LightTally& light : tally.lights) {
    light.sent = reader.Varint();
    for (std::uint64_t& in_view : light.in_view)
      in_view = reader.Varint();
  }
  if (!tally.LightsFit()) {
    return absl::InvalidArgumentError("its photons by light contradict its photons");
  }
  return tally;
}

}  // namespace lucerna
