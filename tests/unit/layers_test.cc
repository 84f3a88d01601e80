#include "render/film/layers.h"

#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace lucerna {
namespace {

using testing::ElementsAre;

std::vector<std::string> NamesOf(const std::vector<ImageChannel>& channels) {
  std::vector<std::string> names;
  for (const ImageChannel& channel : channels)
    names.push_back(channel.name);
  return names;
}

TEST(LayersTest, OfPassesAreNoiseAndBias) {
  std::vector<ImageChannel> channels;
  ThreadTeam team(2);
  AddLayers(
      LayerSource::kPasses,
      [](std::size_t pixel) {
        PixelValues values;
        values.noise = static_cast<double>(pixel);
        values.bias = 5;
        return values;
      },
      /*pixels=*/2, team, channels);
  EXPECT_THAT(NamesOf(channels), ElementsAre("noise", "bias"));
  EXPECT_THAT(channels[0].pixels, ElementsAre(0, 1));
  EXPECT_THAT(channels[1].pixels, ElementsAre(5, 5));
}

TEST(LayersTest, OfEveryImageLimitTheBeautyImage) {
  Image image;
  ThreadTeam team(1);
  AddLayers(
      LayerSource::kEveryImage,
      [](std::size_t) {
        PixelValues values;
        values.direct = {1, 2, 3};
        values.photons = {1, 1, 1};
        values.limit = 0.5;
        return values;
      },
      /*pixels=*/1, team, image.channels);
  EXPECT_EQ(image.Find("R")->pixels[0], 1);
  EXPECT_EQ(image.Find("direct.B")->pixels[0], 1.5F);
  EXPECT_NE(image.Find("N.X"), nullptr);
  EXPECT_EQ(image.Find("noise"), nullptr);
}

TEST(LayersTest, LengthsTurnToTheUnitOfTheFile) {
  Image image;
  image.width = 1;
  image.height = 1;
  for (const char* name : {"Z", "bandwidth", "R", "photon_count", "of.another.program"})
    image.channels.push_back({name, {2}});
  ToFileUnit(image.channels, 4);
  EXPECT_EQ(image.Find("Z")->pixels[0], 8);
  EXPECT_EQ(image.Find("bandwidth")->pixels[0], 0.5F);
  EXPECT_EQ(image.Find("R")->pixels[0], 2);
  EXPECT_EQ(image.Find("photon_count")->pixels[0], 2);
  EXPECT_EQ(image.Find("of.another.program")->pixels[0], 2);
}

TEST(LayersTest, AreFoundByTheNamesOfTheirChannels) {
  EXPECT_EQ(LayerOfChannel("photons.G")->name, "photons");
  EXPECT_EQ(LayerOfChannel("G")->unit, LayerUnit::kRadiance);
  EXPECT_EQ(LayerOfChannel("min_radius")->unit, LayerUnit::kLength);
  EXPECT_EQ(LayerOfChannel("photons.X"), nullptr);
}

}  // namespace
}  // namespace lucerna
