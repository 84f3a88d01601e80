// Every photon closer than the radius is found, once, and no other.
#include "worker/photon_grid.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"

namespace lucerna {
namespace {

struct Cloud {
  std::vector<Deposits> chunks;
  std::vector<Vec3> all;
  Bounds region;

  void Add(std::size_t chunk, Vec3 p) {
    if (chunks.size() <= chunk) chunks.resize(chunk + 1);
    Deposit deposit{};
    deposit.position = p;
    deposit.key = static_cast<std::uint32_t>(all.size());
    chunks[chunk].rows.push_back(deposit);
    all.push_back(p);
    region.Add(p);
  }
};

Vec3 RandomPoint(KeyedRng& rng, float extent) {
  const float x = rng.Uniform();
  const float y = rng.Uniform();
  const float z = rng.Uniform();
  return Vec3{x, y, z} * extent;
}

// In the same arithmetic as the grid's, since photons on the rim are to be decided alike.
std::vector<std::uint32_t> NearByBruteForce(const Cloud& cloud, Vec3 center, float radius) {
  std::vector<std::uint32_t> near;
  for (std::size_t i = 0; i < cloud.all.size(); ++i) {
    if (LengthSquared(cloud.all[i] - center) < radius * radius) {
      near.push_back(static_cast<std::uint32_t>(i));
    }
  }
  return near;
}

std::vector<std::uint32_t> NearByGrid(const PhotonGrid& grid, Vec3 center, float radius) {
  std::vector<std::uint32_t> near;
  grid.ForEachWithin(center, radius, [&](std::size_t i, float squared) {
    EXPECT_LT(squared, radius * radius);
    near.push_back(grid.record<false>(i).key);
  });
  std::ranges::sort(near);
  return near;
}

// Photons within a radius and those beyond it, within one and a half of it.
void ExpectNearAndFar(const PhotonGrid& grid, const Cloud& cloud, Vec3 center, float radius) {
  const float reach = 1.5F * radius;
  const float inverse_squared = 1 / (radius * radius);
  std::vector<std::uint32_t> near;
  std::vector<std::uint32_t> far;
  const auto list_in = [&](std::vector<std::uint32_t>& list) {
    return [&](std::size_t i, float squared) {
      EXPECT_EQ(squared, LengthSquared(grid.position(i) - center));
      list.push_back(grid.record<false>(i).key);
    };
  };
  grid.ForEachWithin(center, radius, reach, list_in(near), list_in(far));
  std::ranges::sort(near);
  std::ranges::sort(far);
  std::vector<std::uint32_t> expected_near;
  std::vector<std::uint32_t> expected_far;
  for (const std::uint32_t i : NearByBruteForce(cloud, center, reach)) {
    const bool is_near = LengthSquared(cloud.all[i] - center) * inverse_squared < 1;
    (is_near ? expected_near : expected_far).push_back(i);
  }
  ASSERT_EQ(near, expected_near);
  ASSERT_EQ(far, expected_far);
}

void ExpectAgreement(const Cloud& cloud, float cell, float extent, std::uint64_t key) {
  for (const int threads : {1, 3}) {
    ThreadTeam team(threads);
    const PhotonGrid grid(cloud.chunks, cloud.region, cell, team);
    ASSERT_EQ(grid.size(), cloud.all.size());
    KeyedRng rng(key);
    for (int i = 0; i < 300; ++i) {
      // Also around points outside the cloud, with radii over four decades.
      const Vec3 center = RandomPoint(rng, 1.4F * extent) - Vec3{0.2F, 0.2F, 0.2F} * extent;
      const float radius = extent * std::pow(10.0F, -4 + 4 * rng.Uniform());
      ASSERT_EQ(NearByGrid(grid, center, radius), NearByBruteForce(cloud, center, radius));
      ASSERT_NO_FATAL_FAILURE(ExpectNearAndFar(grid, cloud, center, radius));
    }
    // Around photons themselves, and with radii that end exactly on another photon.
    for (std::size_t i = 0; i + 1 < std::min<std::size_t>(cloud.all.size(), 100); ++i) {
      const Vec3 center = cloud.all[i];
      const float radius = Length(cloud.all[i + 1] - center);
      ASSERT_EQ(NearByGrid(grid, center, radius), NearByBruteForce(cloud, center, radius));
      const float wider = std::nextafter(radius, HUGE_VALF);
      ASSERT_EQ(NearByGrid(grid, center, wider), NearByBruteForce(cloud, center, wider));
      ASSERT_NO_FATAL_FAILURE(ExpectNearAndFar(grid, cloud, center, radius));
    }
  }
}

TEST(PhotonGridTest, FindsWhatBruteForceFinds) {
  for (const float cell : {1e-3F, 0.05F, 0.3F, 5.0F}) {
    Cloud cloud;
    KeyedRng rng(1);
    for (int i = 0; i < 3000; ++i)
      cloud.Add(static_cast<std::size_t>(i % 7), RandomPoint(rng, 1));
    ExpectAgreement(cloud, cell, 1, 2);
  }
}

TEST(PhotonGridTest, FindsPhotonsOfOnePlaceAndOnGridLines) {
  Cloud same;
  for (int i = 0; i < 100; ++i)
    same.Add(0, {0.5F, 0.5F, 0.5F});
  same.region.Add({0, 0, 0});
  same.region.Add({1, 1, 1});
  ExpectAgreement(same, 0.1F, 1, 3);
  Cloud lattice;
  for (int x = 0; x <= 10; ++x) {
    for (int y = 0; y <= 10; ++y) {
      lattice.Add(static_cast<std::size_t>(x),
                  Vec3{static_cast<float>(x), static_cast<float>(y), 5} * 0.1F);
    }
  }
  ExpectAgreement(lattice, 0.1F, 1, 4);
}

TEST(PhotonGridTest, HandlesOnePhotonAndNone) {
  Cloud one;
  one.Add(2, {7, 8, 9});
  ExpectAgreement(one, 1, 10, 5);
  ThreadTeam team(2);
  const PhotonGrid empty(std::vector<Deposits>(2), Bounds{}, 1, team);
  EXPECT_EQ(empty.size(), 0U);
  EXPECT_TRUE(NearByGrid(empty, {0, 0, 0}, 1e30F).empty());
}

// A tiny cell in a huge region may cost neither memory nor photons.
TEST(PhotonGridTest, WidensItsCellsInAHugeRegion) {
  Cloud cloud;
  KeyedRng rng(6);
  for (int i = 0; i < 500; ++i)
    cloud.Add(0, RandomPoint(rng, 1));
  cloud.region.Add({-1e6F, -1e6F, -1e6F});
  cloud.region.Add({1e6F, 1e6F, 1e6F});
  ExpectAgreement(cloud, 1e-5F, 1, 7);
}

}  // namespace
}  // namespace lucerna
