// Half blocks must show the image's own colours, as the PNG does.
#include <atomic>
#include <cmath>
#include <limits>
#include <thread>

#include "gtest/gtest.h"

#include "client/view/preview.h"
#include "client/view/preview_source.h"
#include "render/image/exr_file.h"

namespace lucerna {
namespace {

Image ImageOf(int width, int height, const std::vector<float>& red) {
  Image image{.width = width, .height = height, .channels = {}, .metadata = {}};
  const std::vector<float> none(red.size(), 0);
  image.channels = {{"R", red}, {"G", none}, {"B", none}};
  return image;
}

TEST(PreviewTest, ColorsAreForTerminalsThatSaySo) {
  EXPECT_TRUE(HasColors("truecolor", "xterm", nullptr));
  EXPECT_TRUE(HasColors("24bit", nullptr, nullptr));
  EXPECT_TRUE(HasColors(nullptr, "xterm-256color", nullptr));
  EXPECT_FALSE(HasColors(nullptr, "xterm", nullptr));
  EXPECT_FALSE(HasColors("yes", "256color-not", nullptr));
  EXPECT_FALSE(HasColors(nullptr, nullptr, nullptr));
  EXPECT_FALSE(HasColors("truecolor", "xterm-256color", "1"));
  EXPECT_TRUE(HasColors("truecolor", "xterm", "")) << "an empty NO_COLOR says nothing";
}

TEST(PreviewTest, ACellIsItsUpperPixelOverItsLower) {
  const auto preview = MakePreview(ImageOf(2, 2, {1, 0, 0.5F, 0.5F}), 10, 10);
  ASSERT_TRUE(preview.ok());
  // 0.5 is 188 as sRGB.
  EXPECT_EQ(preview->Lines(Charset::kUtf8),
            (std::vector<std::string>{"\x1b[38;2;255;0;0;48;2;188;0;0m▀"
                                      "\x1b[38;2;0;0;0;48;2;188;0;0m▀\x1b[0m"}));
}

TEST(PreviewTest, InAsciiACellIsASpaceOnTheMeanOfItsPixels) {
  const auto preview = MakePreview(ImageOf(2, 2, {1, 0, 0.5F, 0.5F}), 10, 10);
  ASSERT_TRUE(preview.ok());
  // 255 and 188, 0 and 188.
  EXPECT_EQ(preview->Lines(Charset::kAscii),
            (std::vector<std::string>{"\x1b[48;2;222;0;0m \x1b[48;2;94;0;0m \x1b[0m"}));
}

TEST(PreviewTest, CellsThatAreAlikeShareTheirColors) {
  const auto preview = MakePreview(ImageOf(3, 2, std::vector<float>(6, 1)), 10, 10);
  EXPECT_EQ(preview->Lines(Charset::kUtf8)[0], "\x1b[38;2;255;0;0;48;2;255;0;0m▀▀▀\x1b[0m");
}

TEST(PreviewTest, PixelsAreAveragedAsLight) {
  // The mean of 1 and 0 is 0.5 as light, 188, and not 128; a speck of 1000 is as bright as white,
  // and what is no number is black.
  const float nan = std::nanf("");
  const auto preview = MakePreview(ImageOf(2, 4, {1, 0, 0, 1000, nan, nan, 1, 1}), 1, 1);
  ASSERT_TRUE(preview.ok());
  EXPECT_EQ(preview->width, 1);
  EXPECT_EQ(preview->height, 2);
  EXPECT_EQ(preview->pixels[0], 188);
  EXPECT_EQ(preview->pixels[3], 188);
}

TEST(PreviewTest, KeepsProportionsAndLimits) {
  const auto size = [](int width, int height, int columns, int rows) {
    const auto preview = MakePreview(
        ImageOf(width, height, std::vector<float>(static_cast<std::size_t>(width * height))),
        columns, rows);
    return std::pair(preview->width, preview->height);
  };
  EXPECT_EQ(size(640, 480, 40, 100), (std::pair(40, 30)));
  EXPECT_EQ(size(640, 480, 100, 12), (std::pair(32, 24)));
  EXPECT_EQ(size(1000, 1, 10, 10), (std::pair(10, 2)));
  EXPECT_EQ(size(1, 1000, 10, 10), (std::pair(1, 20)));
  EXPECT_EQ(size(1, 1, 10, 10), (std::pair(1, 2)));
  EXPECT_FALSE(MakePreview(Image(), 10, 10).ok());
  Image no_red = ImageOf(1, 1, {1});
  no_red.channels.erase(no_red.channels.begin());
  EXPECT_FALSE(MakePreview(no_red, 10, 10).ok());
}

TEST(PreviewSourceTest, FetchesOnlyWhenWantedAndNeverHoldsUpItsOwner) {
  const auto exr = EncodeExr(ImageOf(2, 2, {1, 0, 0, 1}));
  ASSERT_TRUE(exr.ok());
  std::atomic<int> fetched = 0;
  PreviewSource source([&](const std::function<bool()>&) -> StatusOr<std::string> {
    ++fetched;
    return *exr;
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(fetched, 0);
  std::shared_ptr<const Image> image;
  for (int i = 0; i < 1000 && image == nullptr; ++i) {
    image = source.Newest();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  ASSERT_NE(image, nullptr);
  EXPECT_EQ(image->width, 2);
}

TEST(PreviewSourceTest, GivesUpWhatIsUnderWay) {
  std::atomic<bool> began = false;
  bool gave_up = false;
  {
    PreviewSource source([&](const std::function<bool()>& gives_up) -> StatusOr<std::string> {
      began = true;
      for (int i = 0; i < 2000 && !gives_up(); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      gave_up = gives_up();
      return absl::AbortedError("given up");
    });
    while (!began) {
      EXPECT_EQ(source.Newest(), nullptr);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  EXPECT_TRUE(gave_up);
}

}  // namespace
}  // namespace lucerna
