// What comes out of a render: named layers of pixels and what is known about them.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/digest.h"
#include "render/base/status.h"

namespace lucerna {

// One channel of pixels. Row 0 is the top of the image.
struct ImageChannel {
  std::string name;           // as EXR names it: "R", "direct.G", "N.X", "radius"
  std::vector<float> pixels;  // [height × width]
};

// The channels of one picture plus text metadata.
// The layers of a render: film/layers.h.
struct Image {
  int width = 0, height = 0;  // [pixels]
  // Of a part of a picture: where its upper left pixel lies in the whole, and the size of that. 0:
  // it is the whole. In a file the data window and the display window.
  int x0 = 0, y0 = 0, whole_width = 0, whole_height = 0;
  std::vector<ImageChannel> channels;  // sorted by name once written
  // Keys beginning with "lucerna." are ours. Those beginning with "lucerna.run." tell of one run
  // (seconds, machine names) and are left out of the digest; all others are in it.
  std::map<std::string, std::string> metadata;

  // nullptr when there is no such channel.
  [[nodiscard]] const ImageChannel* Find(std::string_view name) const;
  // The digest of size, channels and metadata except "lucerna.run.*": equal exactly when two
  // renders gave the same bits. Does not depend on the order of the channels.
  [[nodiscard]] Digest PixelDigest() const;
};

// An image that is made a band of rows at a time, so that it need not be in memory as a whole.
struct BandedImage {
  Image head;  // all but its channels
  // The rows [first, last) of all channels, by the same names each time.
  std::function<std::vector<ImageChannel>(int first, int last)> rows;

  // As one; its rows are made from the top.
  [[nodiscard]] Image Whole() const;
};
// Bands of an image that is there.
[[nodiscard]] BandedImage InBands(Image whole);

// Calls body(first, last) for bands of whole rows that hold some ten thousand pixels each, from the
// top.
void ForBands(int width, int height, const std::function<void(int first, int last)>& body);

}  // namespace lucerna
