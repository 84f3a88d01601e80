// What is sent to tev must be what its documentation describes: the packets are taken apart here by
// these rules alone, and not by the code that made them.
#include "client/view/tev_view.h"

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "gtest/gtest.h"
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/support/small_tev.h"

namespace lucerna {
namespace {

// "[uint32_t total_length_in_bytes][byte operation_type][byte[] payload]", little-endian.
class Reader {
 public:
  explicit Reader(const std::string& bytes) : bytes_(bytes) {}
  std::uint32_t Length() { return static_cast<std::uint32_t>(Int()); }
  std::int32_t Int() {
    std::uint32_t value = 0;
    for (int i = 0; i < 4; ++i)
      value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes_.at(at_++))) << (8 * i);
    return static_cast<std::int32_t>(value);
  }
  float Float() {
    const std::int32_t bits = Int();
    float value = 0;
    std::memcpy(&value, &bits, 4);
    return value;
  }
  int Byte() { return static_cast<unsigned char>(bytes_.at(at_++)); }
  std::string Text() {
    std::string text;
    while (const int letter = Byte())
      text += static_cast<char>(letter);
    return text;
  }
  [[nodiscard]] std::size_t rest() const { return bytes_.size() - at_; }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
};

// R counts the pixels, G is 0.5, B is 2.
Image Example(int width, int height) {
  Image image;
  image.width = width;
  image.height = height;
  const auto pixels = static_cast<std::size_t>(width * height);
  image.channels = {{"R", std::vector<float>(pixels)},
                    {"G", std::vector<float>(pixels, 0.5F)},
                    {"B", std::vector<float>(pixels, 2)},
                    {"Z", std::vector<float>(pixels, 9)}};
  for (std::size_t i = 0; i < pixels; ++i)
    image.channels[0].pixels[i] = static_cast<float>(i);
  return image;
}

TEST(TevPacketTest, CreatesAnImage) {
  const std::string packet = TevCreatePacket("room", 640, 480, {"R", "G"});
  Reader reader(packet);
  EXPECT_EQ(reader.Length(), packet.size());
  EXPECT_EQ(reader.Byte(), 4);
  EXPECT_EQ(reader.Byte(), 1) << "comes to the front";
  EXPECT_EQ(reader.Text(), "room");
  EXPECT_EQ(reader.Int(), 640);
  EXPECT_EQ(reader.Int(), 480);
  EXPECT_EQ(reader.Int(), 2);
  EXPECT_EQ(reader.Text(), "R");
  EXPECT_EQ(reader.Text(), "G");
  EXPECT_EQ(reader.rest(), 0U);
}

TEST(TevPacketTest, UpdatesATileChannelAfterChannel) {
  const std::string packet = TevUpdatePacket(
      "room", {"R", "G"}, {.x = 3, .y = 5, .width = 2, .height = 1, .pixels = {1, 2, 3, 4}});
  Reader reader(packet);
  EXPECT_EQ(reader.Length(), packet.size());
  EXPECT_EQ(reader.Byte(), 5);
  EXPECT_EQ(reader.Byte(), 0) << "stays where it is";
  EXPECT_EQ(reader.Text(), "room");
  EXPECT_EQ(reader.Int(), 2);
  EXPECT_EQ(reader.Text(), "R");
  EXPECT_EQ(reader.Text(), "G");
  EXPECT_EQ(reader.Int(), 3);
  EXPECT_EQ(reader.Int(), 5);
  EXPECT_EQ(reader.Int(), 2);
  EXPECT_EQ(reader.Int(), 1);
  for (const float value : {1.0F, 2.0F, 3.0F, 4.0F})
    EXPECT_EQ(reader.Float(), value);
  EXPECT_EQ(reader.rest(), 0U);
}

TEST(TevViewTest, AnImageArrivesWholeInTilesAtItsPlace) {
  SmallTev tev;
  Image image = Example(600, 300);
  image.x0 = 10;
  image.y0 = 20;
  image.whole_width = 1000;
  image.whole_height = 500;
  {
    const auto view = TevView::Open(tev.address());
    ASSERT_TRUE(view.ok()) << view.status();
    (*view)->Show("room", image);
    (*view)->Show("room", image);
  }
  Reader reader(tev.Received());
  reader.Length();
  EXPECT_EQ(reader.Byte(), 4);
  reader.Byte();
  EXPECT_EQ(reader.Text(), "room");
  EXPECT_EQ(reader.Int(), 1000);
  EXPECT_EQ(reader.Int(), 500);
  ASSERT_EQ(reader.Int(), 3);
  for (const char* name : {"R", "G", "B"})
    EXPECT_EQ(reader.Text(), name);
  std::vector<int> updates(static_cast<std::size_t>(600 * 300));
  while (reader.rest() > 0) {
    reader.Length();
    ASSERT_EQ(reader.Byte(), 5) << "the image is created once";
    reader.Byte();
    EXPECT_EQ(reader.Text(), "room");
    ASSERT_EQ(reader.Int(), 3);
    for (int c = 0; c < 3; ++c)
      reader.Text();
    const int x0 = reader.Int() - 10;
    const int y0 = reader.Int() - 20;
    const int width = reader.Int();
    const int height = reader.Int();
    for (int c = 0; c < 3; ++c) {
      for (int y = y0; y < y0 + height; ++y) {
        for (int x = x0; x < x0 + width; ++x) {
          const int pixel = 600 * y + x;
          const float expected = c == 0 ? static_cast<float>(pixel) : c == 1 ? 0.5F : 2;
          ASSERT_EQ(reader.Float(), expected) << x << " " << y;
          if (c == 0) ++updates.at(static_cast<std::size_t>(pixel));
        }
      }
    }
  }
  for (const int count : updates)
    ASSERT_EQ(count, 2) << "each pixel once for each image";
}

TEST(TevViewTest, AViewerThatIsNotThereIsASentence) {
  for (const char* address : {"127.0.0.1:1", "nowhere", "127.0.0.1:none"}) {
    const auto view = TevView::Open(address);
    ASSERT_FALSE(view.ok());
    EXPECT_NE(view.status().message().find("leave --tev away"), absl::string_view::npos);
  }
}

TEST(TevViewTest, AViewerThatGoesIsLeftAlone) {
  testing::internal::CaptureStderr();
  int listening = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(::bind(listening, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  ASSERT_EQ(::listen(listening, 1), 0);
  socklen_t size = sizeof(address);
  ::getsockname(listening, reinterpret_cast<sockaddr*>(&address), &size);
  const auto view = TevView::Open("127.0.0.1:" + std::to_string(ntohs(address.sin_port)));
  ASSERT_TRUE(view.ok()) << view.status();
  ::close(::accept(listening, nullptr, nullptr));
  ::close(listening);
  for (int i = 0; i < 10; ++i)
    (*view)->Show("room", Example(600, 300));
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_EQ(said.find("takes no images"), said.rfind("takes no images")) << "once";
  EXPECT_NE(said.find("takes no images"), std::string::npos);
}

}  // namespace
}  // namespace lucerna
