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
constexpr std::size_t kSlicePixels = 1U << 14U;

EyePass WholePass(std::uint64_t pass) {
  EyePass eye;
  eye.pass = pass;
  eye.block.positions.resize(kSlicePixels);
  eye.block.normals_oct.resize(kSlicePixels);
  eye.pixels.resize(kSlicePixels);
  for (std::size_t i = 0; i < kSlicePixels; ++i)
    eye.pixels[i] = static_cast<std::uint32_t>(i);
  eye.weights.resize(kSlicePixels);
  eye.unit_radii.assign(kSlicePixels, 1);
  eye.direct.resize(kSlicePixels);
  eye.features.resize(kSlicePixels);
  return eye;
}

// A pass, its sums and what they become, of a job whose controller has evidence.
struct PassSlice {
  RenderSettings settings;
  std::size_t columns = 0;  // of evidence
  RoundPlan plan = {.photons_per_pass = 1,
                    .radii = std::make_shared<const RadiusColumn>(kSlicePixels, 1.0F)};
  ThreadTeam team = ThreadTeam(1);
  FluxScale scale = {Gray(1), Gray(1)};

  PassSlice() {
    settings.radius_controller = RadiusControllerKind::kAppm;
    columns = kCommonColumns + ControllerColumns(settings.radius_controller);
  }
  // They are small.
  [[nodiscard]] std::size_t OfSums() const { return sizeof(std::int32_t) * (4 + columns); }
};

// A page for each of the vectors, of which there are no more than so many: the allocator rounds.
constexpr std::size_t kSlack = std::size_t{40} * 4096;

std::size_t BytesAPixel(const SliceSums& slice) {
  std::size_t bytes = 0;
  for (const PackedFloats& column : slice.columns) {
    if (!column.empty()) bytes += column.bytes();
  }
  return bytes;
}

// Each column of the sums goes when it has become one of the slice, and where hitpoints are is of
// no use any more: the slice has room in what was freed for it.
TEST(SliceOfPassMemoryTest, HoldsLittleMoreThanThePassAndItsSums) {
  PassSlice of;
  const std::size_t before = LiveBytes();
  EyePass eye = WholePass(0);
  PassSums sums(kSlicePixels, of.columns);
  ASSERT_NEAR(static_cast<double>(LiveBytes() - before),
              static_cast<double>(kSlicePixels * (kWhere + kRow + kSeen + of.OfSums())), kSlack);
  ForgetMostLiveBytes();
  const SliceSums slice = SliceOfPass(std::move(eye), of.plan, std::move(sums), of.settings,
                                      SceneNeeds(), of.scale, of.team);
  EXPECT_NEAR(static_cast<double>(LiveBytes() - before),
              static_cast<double>(kSlicePixels * BytesAPixel(slice)), kSlack);
  // Features become columns of the slice before they go.
  constexpr std::size_t kFeatures = std::size_t{kFeatureColumns} * 3;
  EXPECT_LE(MostLiveBytes() - before,
            kSlicePixels * (kWhere + kRow + kSeen + kFeatures + of.OfSums()) + kSlack);
}

// A worker has packed what eye paths brought when it gathers photons.
TEST(SliceOfPassMemoryTest, HoldsWhatEyePathsBroughtInFewerBytes) {
  PassSlice of;
  const std::size_t before = LiveBytes();
  EyePass eye = WholePass(0);
  SliceSums slice = BeginSlice(eye, of.settings);
  ForgetMostLiveBytes();
  AddEyePaths(slice, eye, of.settings, SceneNeeds(), of.team);
  // Direct light and features, of three bytes each.
  constexpr std::size_t kPacked = std::size_t{3 + kFeatureColumns} * 3;
  EXPECT_EQ(BytesAPixel(slice), kPacked);
  EXPECT_NEAR(static_cast<double>(LiveBytes() - before),
              static_cast<double>(kSlicePixels * (kWhere + kRow + kPacked)), kSlack);
  EXPECT_LE(MostLiveBytes() - before,
            kSlicePixels * (kWhere + kRow + sizeof(EyeFeatures) + kPacked) + kSlack);
  RadiusColumn radii = TakeHitpointRadii(eye, of.plan);
  PassSums sums(kSlicePixels, of.columns);
  ForgetMostLiveBytes();
  AddPhotons(slice, eye, of.plan, std::move(radii), std::move(sums), of.settings, SceneNeeds(),
             of.scale, of.team);
  EXPECT_LE(MostLiveBytes() - before,
            kSlicePixels * (kWhere + kRow + kPacked + of.OfSums()) + kSlack);
  EXPECT_NEAR(static_cast<double>(LiveBytes() - before),
              static_cast<double>(kSlicePixels * BytesAPixel(slice)), kSlack);
}

}  // namespace
}  // namespace lucerna
