// Files of photons must be read by other programs as what they are: the bytes are taken apart here
// by the formats' own rules.
#include "client/view/photon_file.h"

#include <cstring>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace lucerna {
namespace {

void Set(v1::Triple& triple, float x, float y, float z) {
  triple.set_x(x);
  triple.set_y(y);
  triple.set_z(z);
}

// Photon 7 lands twice, and leaves a deposit at the second; photon 8 was not emitted.
v1::PhotonPaths TwoPhotons() {
  v1::PhotonPaths paths;
  v1::PhotonPath& path = *paths.add_paths();
  path.mutable_key()->set_pass(2);
  path.mutable_key()->set_index(7);
  Set(*path.mutable_emission()->mutable_position(), 0, 0, 2);
  v1::PhotonPath::Landing& first = *path.add_landings();
  Set(*first.mutable_position(), 1, 0, 0);
  first.set_deposit(v1::DEPOSIT_FATE_NOT_GATHERED);
  v1::PhotonPath::Landing& second = *path.add_landings();
  Set(*second.mutable_position(), 1.5F, -2, 0.25F);
  Set(*second.mutable_flux_landed(), 4, 2, 0);
  second.set_deposit(v1::DEPOSIT_FATE_LEFT);
  paths.add_paths()->mutable_key()->set_index(8);
  return paths;
}

TEST(PhotonFileTest, PlyHasAPointForEachDeposit) {
  const std::string file = PhotonFile(TwoPhotons(), PhotonFileFormat::kPly);
  EXPECT_TRUE(file.starts_with("ply\nformat binary_little_endian 1.0\n"));
  EXPECT_THAT(file, testing::HasSubstr("element vertex 1\n"));
  const std::string end = "end_header\n";
  const std::string point = file.substr(file.find(end) + end.size());
  ASSERT_EQ(point.size(), 3U * 4 + 3 + 3U * 4 + 4 + 2);
  float place[3];
  std::memcpy(place, point.data(), sizeof(place));
  EXPECT_EQ(place[0], 1.5F);
  EXPECT_EQ(place[1], -2);
  EXPECT_EQ(place[2], 0.25F);
  EXPECT_EQ(static_cast<unsigned char>(point[12]), 255);
  EXPECT_EQ(static_cast<unsigned char>(point[13]), 128);
  EXPECT_EQ(static_cast<unsigned char>(point[14]), 0);
  float flux[3];
  std::memcpy(flux, point.data() + 15, sizeof(flux));
  EXPECT_EQ(flux[1], 2);
  std::uint32_t photon = 0;
  std::memcpy(&photon, point.data() + 27, 4);
  EXPECT_EQ(photon, 7U);
  EXPECT_EQ(point[31], 2) << "its second landing";
}

TEST(PhotonFileTest, ObjHasALineForEachPhoton) {
  EXPECT_EQ(PhotonFile(TwoPhotons(), PhotonFileFormat::kObj),
            "# ways of photons, of lucerna trace-photon\n"
            "g photon_2_7\n"
            "v 0 0 2\n"
            "v 1 0 0\n"
            "v 1.5 -2 0.25\n"
            "l 1 2 3\n");
}

TEST(PhotonFileTest, TheEndingOfTheNameIsTheFormat) {
  EXPECT_EQ(*PhotonFileFormatOf("a.ply"), PhotonFileFormat::kPly);
  EXPECT_EQ(*PhotonFileFormatOf("a.obj"), PhotonFileFormat::kObj);
  EXPECT_FALSE(PhotonFileFormatOf("a.exr").ok());
}

}  // namespace
}  // namespace lucerna
