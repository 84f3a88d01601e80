// How much memory does a pass take while it becomes a slice?
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "gtest/gtest.h"

#include "render/estimate/evidence.h"
#include "render/tracing/pass_slice.h"
#include "tests/memory/failing_allocations.h"

namespace lucerna {
namespace {

// Bytes of a pixel.
constexpr std::size_t kWhere = sizeof(Vec3) + sizeof(std::uint32_t);  // position and normal
constexpr std::size_t kRow = sizeof(std::uint32_t) + sizeof(Rgb) + sizeof(float);
constexpr std::size_t kSeen = sizeof(Rgb) + sizeof(EyeFeatures);
constexpr std::size_t kPixels = 1U << 14U;

EyePass WholePass(std::uint64_t pass) {
  EyePass eye;
  eye.pass = pass;
  eye.block.positions.resize(kPixels);
  eye.block.normals_oct.resize(kPixels);
  eye.pixels.resize(kPixels);
  for (std::size_t i = 0; i < kPixels; ++i)
    eye.pixels[i] = static_cast<std::uint32_t>(i);
  eye.weights.resize(kPixels);
  eye.unit_radii.assign(kPixels, 1);
  eye.direct.resize(kPixels);
  eye.features.resize(kPixels);
  return eye;
}

// Where hitpoints are is of no use any more, and direct light becomes columns when what photons
// brought has become theirs: the most is what the rows have and the columns that follow from them.
TEST(SliceOfPassMemoryTest, NeverHoldsTheWholePassBesideTheWholeSlice) {
  RenderSettings settings;
  settings.radius_controller = RadiusControllerKind::kAppm;
  const std::size_t evidence = ControllerColumns(settings.radius_controller);
  ThreadTeam team(1);
  const RoundPlan plan = {.photons_per_pass = 1,
                          .radii = std::make_shared<const RadiusColumn>(kPixels, 1.0F)};
  const std::size_t before = LiveBytes();
  EyePass eye = WholePass(0);
  PassSums sums(kPixels, kCommonColumns + evidence);
  const std::size_t of_sums = sizeof(std::int64_t) * (4 + kCommonColumns + evidence);
  // A page for each of the vectors, of which there are no more than so many: the allocator rounds.
  constexpr std::size_t kSlack = std::size_t{40} * 4096;
  ASSERT_NEAR(static_cast<double>(LiveBytes() - before),
              static_cast<double>(kPixels * (kWhere + kRow + kSeen + of_sums)), kSlack);
  ForgetMostLiveBytes();
  const SliceSums slice = SliceOfPass(std::move(eye), plan, std::move(sums), settings, SceneNeeds(),
                                      {Gray(1), Gray(1)}, team);
  std::size_t of_slice = 0;
  for (const PackedFloats& column : slice.columns) {
    if (!column.empty()) of_slice += column.bytes();
  }
  EXPECT_NEAR(static_cast<double>(LiveBytes() - before), static_cast<double>(kPixels * of_slice),
              kSlack);
  // By photons: radiance and bias as floats, and packed two columns of bias, the count, the blur,
  // the evidence and three of the features.
  const std::size_t from_rows = sizeof(float) * 4 + 2 * 2 + 3 + 2 + 2 * evidence + 3 * 3;
  EXPECT_LE(MostLiveBytes() - before, kPixels * (kRow + kSeen + of_sums + from_rows) + kSlack);
}

}  // namespace
}  // namespace lucerna
