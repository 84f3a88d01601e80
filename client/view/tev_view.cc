#include "client/view/tev_view.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <utility>

#include <netdb.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include "render/base/console.h"
#include "render/base/escape.h"

namespace lucerna {
namespace {

constexpr char kUpdateImage = 5;
constexpr char kCreateImage = 4;
constexpr int kTileSide = 256;
constexpr int kSendSeconds = 5;
const std::vector<std::string> kChannels = {"R", "G", "B"};

static_assert(std::endian::native == std::endian::little, "numbers are copied as they are");

class Packet {
 public:
  explicit Packet(char operation) : bytes_(sizeof(std::uint32_t), '\0') { bytes_ += operation; }

  Packet& Add(std::int32_t number) { return AddBytes(&number, sizeof(number)); }
  Packet& Add(bool flag) {
    bytes_ += static_cast<char>(flag ? 1 : 0);
    return *this;
  }
  // A zero byte would end it early.
  Packet& Add(const std::string& text) {
    bytes_ += text.substr(0, text.find('\0'));
    bytes_ += '\0';
    return *this;
  }
  Packet& Add(const std::vector<std::string>& texts) {
    for (const std::string& text : texts)
      Add(text);
    return *this;
  }
  Packet& Add(const std::vector<float>& numbers) {
    return AddBytes(numbers.data(), numbers.size() * sizeof(float));
  }

  [[nodiscard]] std::string Take() {
    const auto size = static_cast<std::uint32_t>(bytes_.size());
    std::memcpy(bytes_.data(), &size, sizeof(size));
    return std::move(bytes_);
  }

 private:
  Packet& AddBytes(const void* from, std::size_t size) {
    bytes_.append(static_cast<const char*>(from), size);
    return *this;
  }

  std::string bytes_;
};

}  // namespace

std::string TevCreatePacket(const std::string& name, int width, int height,
                            const std::vector<std::string>& channels) {
  return Packet(kCreateImage)
      .Add(/*grabs focus*/ true)
      .Add(name)
      .Add(width)
      .Add(height)
      .Add(static_cast<std::int32_t>(channels.size()))
      .Add(channels)
      .Take();
}

std::string TevUpdatePacket(const std::string& name, const std::vector<std::string>& channels,
                            const TevTile& tile) {
  return Packet(kUpdateImage)
      .Add(/*grabs focus*/ false)
      .Add(name)
      .Add(static_cast<std::int32_t>(channels.size()))
      .Add(channels)
      .Add(tile.x)
      .Add(tile.y)
      .Add(tile.width)
      .Add(tile.height)
      .Add(tile.pixels)
      .Take();
}

std::vector<TevTile> TevTilesOf(const Image& image) {
  std::vector<TevTile> tiles;
  for (int y = 0; y < image.height; y += kTileSide) {
    for (int x = 0; x < image.width; x += kTileSide) {
      TevTile tile = {.x = image.x0 + x,
                      .y = image.y0 + y,
                      .width = std::min(kTileSide, image.width - x),
                      .height = std::min(kTileSide, image.height - y),
                      .pixels = {}};
      for (const std::string& name : kChannels) {
        const ImageChannel* const channel = image.Find(name);
        for (int row = y; row < y + tile.height; ++row) {
          const std::size_t first =
              static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
              static_cast<std::size_t>(x);
          for (std::size_t i = 0; i < static_cast<std::size_t>(tile.width); ++i)
            tile.pixels.push_back(channel == nullptr ? 0 : channel->pixels[first + i]);
        }
      }
      tiles.push_back(std::move(tile));
    }
  }
  return tiles;
}

StatusOr<std::shared_ptr<TevView>> TevView::Open(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  const auto unavailable = [&](const char* why) {
    return absl::UnavailableError(absl::StrCat("cannot reach tev at ", Escaped(address), " (", why,
                                               "); start it with tev --host ", Escaped(address),
                                               ", or leave --tev away"));
  };
  if (colon == std::string::npos) return unavailable("that is not HOST:PORT");
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int error = ::getaddrinfo(address.substr(0, colon).c_str(),
                                  address.substr(colon + 1).c_str(), &wanted, &found);
  if (error != 0) return unavailable(::gai_strerror(error));
  int socket = -1;
  int reason = 0;
  for (const addrinfo* one = found; one != nullptr && socket < 0; one = one->ai_next) {
    socket = ::socket(one->ai_family, one->ai_socktype | SOCK_CLOEXEC, one->ai_protocol);
    if (socket < 0) continue;
    const timeval time = {.tv_sec = kSendSeconds, .tv_usec = 0};
    // Of the connection too.
    ::setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &time, sizeof(time));
    if (::connect(socket, one->ai_addr, one->ai_addrlen) == 0) continue;
    reason = errno;
    ::close(socket);
    socket = -1;
  }
  ::freeaddrinfo(found);
  if (socket < 0) return unavailable(std::strerror(reason));
  return std::shared_ptr<TevView>(new TevView(address, socket));
}

TevView::~TevView() {
  if (socket_ >= 0) ::close(socket_);
}

bool TevView::Send(const std::string& packet) {
  std::size_t sent = 0;
  while (sent < packet.size()) {
    const ssize_t taken = ::send(socket_, packet.data() + sent, packet.size() - sent, MSG_NOSIGNAL);
    if (taken < 0 && errno == EINTR) continue;
    if (taken <= 0) return false;
    sent += static_cast<std::size_t>(taken);
  }
  return true;
}

void TevView::Show(const std::string& name, const Image& image) {
  if (socket_ < 0) return;
  bool is_shown = true;
  if (!known_.contains(name)) {
    const bool is_part = image.whole_width > 0;
    is_shown = Send(TevCreatePacket(name, is_part ? image.whole_width : image.width,
                                    is_part ? image.whole_height : image.height, kChannels));
    known_.insert(name);
  }
  for (const TevTile& tile : TevTilesOf(image))
    is_shown = is_shown && Send(TevUpdatePacket(name, kChannels, tile));
  if (is_shown) return;
  PrintError(absl::StrCat("lucerna: warning: tev at ", Escaped(address_),
                          " takes no images any more (", std::strerror(errno), ")\n"));
  ::close(socket_);
  socket_ = -1;
}

}  // namespace lucerna
