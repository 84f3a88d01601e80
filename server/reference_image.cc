#include "server/reference_image.h"

#include <array>

#include "render/image/exr_file.h"

namespace lucerna {

StatusOr<ReferenceImage> ReadReference(std::string_view exr_bytes, const RenderSettings& settings) {
  const StatusOr<Image> image = DecodeExr(exr_bytes);
  if (!image.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat("the reference image cannot be read: ", image.status().message()));
  }
  if (image->width != settings.crop_width() || image->height != settings.crop_height()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "the reference image has ", image->width, "x", image->height, " pixels and the job's ",
        settings.crop_width(), "x", settings.crop_height(), "; give them the same size"));
  }
  std::array<const ImageChannel*, 3> channels = {image->Find("R"), image->Find("G"),
                                                 image->Find("B")};
  ReferenceImage reference(static_cast<std::size_t>(image->width) *
                           static_cast<std::size_t>(image->height));
  for (const ImageChannel* channel : channels) {
    if (channel == nullptr) {
      return absl::InvalidArgumentError("the reference image lacks one of the channels R, G, B");
    }
  }
  for (std::size_t pixel = 0; pixel < reference.size(); ++pixel) {
    reference[pixel] = {channels[0]->pixels[pixel], channels[1]->pixels[pixel],
                        channels[2]->pixels[pixel]};
    if (!IsFinite(reference[pixel])) {
      return absl::InvalidArgumentError("the reference image has pixels that are not numbers");
    }
  }
  return reference;
}

}  // namespace lucerna
