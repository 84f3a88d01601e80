// The crest of a rounded border is where the surface has turned by 45 degrees, and prisms, balls
// and grids have none.
#include "render/geometry/rounded_borders.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "render/geometry/feature_edges.h"
#include "render/math/rng.h"
#include "render/math/warp.h"

namespace lucerna {
namespace {

struct Mesh {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> corners;

  // A strip of quads between the places of two rows, in columns one apart along y.
  void AddRows(const std::vector<Vec3>& profile, std::uint32_t columns) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    const auto rows = static_cast<std::uint32_t>(profile.size());
    for (std::uint32_t column = 0; column <= columns; ++column) {
      for (const Vec3 place : profile)
        positions.push_back({place.x, static_cast<float>(column), place.z});
    }
    for (std::uint32_t column = 0; column < columns; ++column) {
      for (std::uint32_t row = 0; row + 1 < rows; ++row) {
        const std::uint32_t a = first + column * rows + row;
        const std::uint32_t b = a + rows;
        corners.insert(corners.end(), {a, b, b + 1, a, b + 1, a + 1});
      }
    }
  }
  [[nodiscard]] std::vector<std::array<std::uint32_t, 2>> Crests() const {
    return CrestsOfRoundedBorders(positions, corners, SidesByEdge(corners, positions.size()));
  }
};

// The flat top of a board from x = -width to 0, a border of so many strips around (0, -radius), and
// a side of that depth.
std::vector<Vec3> BoardProfile(double width, double radius, std::uint32_t strips, double depth) {
  std::vector<Vec3> profile = {{static_cast<float>(-width), 0, 0}};
  for (std::uint32_t i = 0; i <= strips; ++i) {
    const double angle = kPi64 / 2 * i / strips;
    profile.push_back({static_cast<float>(radius * std::sin(angle)), 0,
                       static_cast<float>(radius * (std::cos(angle) - 1))});
  }
  profile.push_back({static_cast<float>(radius), 0, static_cast<float>(-radius - depth)});
  return profile;
}

// The rows [numbers in the profile] along which crests run, each over all columns.
std::vector<std::uint32_t> RowsOf(const std::vector<std::array<std::uint32_t, 2>>& crests,
                                  std::uint32_t rows, std::uint32_t columns) {
  std::vector<std::uint32_t> count(rows, 0);
  for (const auto& [low, high] : crests) {
    EXPECT_EQ(low % rows, high % rows) << "along the border";
    ++count[low % rows];
  }
  std::vector<std::uint32_t> found;
  for (std::uint32_t row = 0; row < rows; ++row) {
    if (count[row] == 0) continue;
    EXPECT_EQ(count[row], columns);
    found.push_back(row);
  }
  return found;
}

// Seen from the top the first edge whose far strip is turned by more than 44.77 degrees
// (kSameSurfaceCosine), and from the side likewise.
TEST(RoundedBordersTest, HaveACrestWhereTheyHaveTurnedByHalfARightAngle) {
  constexpr std::uint32_t kColumns = 3;
  for (const std::uint32_t strips : {3U, 4U, 5U, 8U, 16U}) {
    for (const bool winds_both_ways : {false, true}) {
      SCOPED_TRACE(strips);
      const std::vector<Vec3> profile = BoardProfile(3, 0.05, strips, 2);
      const auto rows = static_cast<std::uint32_t>(profile.size());
      Mesh mesh;
      mesh.AddRows(profile, kColumns);
      if (winds_both_ways) {
        for (std::size_t i = 0; i < mesh.corners.size(); i += 9)
          std::swap(mesh.corners[i + 1], mesh.corners[i + 2]);
      }
      std::vector<std::uint32_t> expected;
      const double limit = std::acos(static_cast<double>(kSameSurfaceCosine));
      for (std::uint32_t strip = 0; strip <= strips; ++strip) {
        // The edge above this strip, or above the side.
        const double above = strip == 0 ? 0 : kPi64 / 2 * (strip - 0.5) / strips;
        const double below = strip == strips ? kPi64 / 2 : kPi64 / 2 * (strip + 0.5) / strips;
        if ((above < limit && below > limit) ||
            (kPi64 / 2 - below < limit && kPi64 / 2 - above > limit))
          expected.push_back(strip + 1);
      }
      EXPECT_EQ(RowsOf(mesh.Crests(), rows, kColumns), expected);
    }
  }
}

// A border as wide as a quarter of the board or more is a part of its shape.
TEST(RoundedBordersTest, AreNarrowBesideTheirFaces) {
  const auto has_crests = [](double width, double depth) {
    Mesh mesh;
    mesh.AddRows(BoardProfile(width, 1, 8, depth), 4);
    return !mesh.Crests().empty();
  };
  // From the top to the crest there are three strips, and a little less than an eighth of a turn.
  EXPECT_TRUE(has_crests(3.2, 0.1));
  EXPECT_FALSE(has_crests(2, 0.1));
  EXPECT_TRUE(has_crests(2, 3.2)) << "beside the side";
}

// How wide a face is does not depend on how it is cut into triangles.
TEST(RoundedBordersTest, AreFoundBesideFacesOfManyStrips) {
  std::vector<Vec3> profile = BoardProfile(3, 0.3, 4, 0.1);
  const std::size_t border = profile.size() - 1;
  for (int i = 1; i < 20; ++i)
    profile.insert(profile.begin() + i, {-3 + 0.15F * static_cast<float>(i), 0, 0});
  Mesh mesh;
  mesh.AddRows(profile, 1);
  EXPECT_FALSE(mesh.Crests().empty());
  Mesh bent = mesh;
  // The same with a top that is no plane: its last strip alone borders.
  for (std::size_t i = 0; i < bent.positions.size(); ++i) {
    const std::size_t row = i % profile.size();
    if (row + border < profile.size()) bent.positions[i].z += row % 2 == 0 ? 0.02F : 0.0F;
  }
  EXPECT_TRUE(bent.Crests().empty());
}

TEST(RoundedBordersTest, AreNotWhereAllIsBentAlike) {
  // Prisms: a side as wide as those beside it.
  for (const std::uint32_t sides : {9U, 12U, 32U, 200U}) {
    std::vector<Vec3> profile;
    for (std::uint32_t i = 0; i <= sides; ++i) {
      const double angle = 2 * kPi64 * i / sides;
      profile.push_back(
          {static_cast<float>(std::cos(angle)), 0, static_cast<float>(std::sin(angle))});
    }
    Mesh prism;
    prism.AddRows(profile, 20);
    EXPECT_TRUE(prism.Crests().empty()) << sides;
  }
  // A bumpy field.
  Mesh field;
  field.AddRows({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}, {5, 0, 0}, {6, 0, 0}}, 60);
  KeyedRng rng(7);
  for (Vec3& place : field.positions)
    place.z = 0.4F * rng.Uniform();
  EXPECT_TRUE(field.Crests().empty());
  EXPECT_TRUE(Mesh().Crests().empty());
}

}  // namespace
}  // namespace lucerna
