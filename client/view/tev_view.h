// Shows the image of a job in tev, a viewer for HDR images, while it renders.
//
// tev listens on a TCP port (tev --host). Packets as its own sources have them: the length of the
// whole packet [uint32], the kind of operation [byte], then its values. Integers and floats are
// little-endian, texts end with a zero byte. Source: github.com/Tom94/tev, README.md and
// include/tev/Ipc.h.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "render/base/status.h"
#include "render/image/image.h"

namespace lucerna {

// A tile: `pixels` has its channels one after the other, each [height × width].
struct TevTile {
  int x = 0, y = 0, width = 0, height = 0;  // in the whole image
  std::vector<float> pixels;
};

// Creates an image, or overwrites the one of that name. Operation 4.
[[nodiscard]] std::string TevCreatePacket(const std::string& name, int width, int height,
                                          const std::vector<std::string>& channels);
// Replaces a part of it. Operation 5 (UpdateImageV2, several channels).
[[nodiscard]] std::string TevUpdatePacket(const std::string& name,
                                          const std::vector<std::string>& channels,
                                          const TevTile& tile);
// R, G and B of an image in tiles that cover it once.
[[nodiscard]] std::vector<TevTile> TevTilesOf(const Image& image);

class TevView {
 public:
  // Connects. Errors: UNAVAILABLE that says what to do.
  [[nodiscard]] static StatusOr<std::shared_ptr<TevView>> Open(const std::string& address);
  ~TevView();
  TevView(const TevView&) = delete;
  TevView& operator=(const TevView&) = delete;

  // Shows an image under a name. A viewer that has gone, or takes nothing for seconds, is warned of
  // once on stderr, and shown nothing more. Threads: one at a time.
  void Show(const std::string& name, const Image& image);

 private:
  TevView(std::string address, int socket) : address_(std::move(address)), socket_(socket) {}
  [[nodiscard]] bool Send(const std::string& packet);

  const std::string address_;
  int socket_;                   // -1: closed
  std::set<std::string> known_;  // images that were created
};

}  // namespace lucerna
