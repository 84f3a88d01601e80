// Any bytes as an image file of each format: no crash, no hang, no memory without bound. Its seeds
// are tests/fuzz/seeds/image.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "render/formats/image_file.h"
#include "tests/fuzz/sound_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  for (const char* name : {"a.png", "a.jpg", "a.tga", "a.hdr", "a.pfm", "a.exr"}) {
    const auto picture = lucerna::ReadPicture({reinterpret_cast<const char*>(bytes), size}, name,
                                              {}, std::uint64_t{1} << 24);
    if (picture.ok()) LUCERNA_CHECK(lucerna::PictureIsSound(*picture));
  }
  return 0;
}
