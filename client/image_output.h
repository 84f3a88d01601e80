// Where do images go on the user's machine?
#pragma once

#include <string>
#include <string_view>

#include "client/view/report.h"
#include "render/base/status.h"
#include "render/film/display.h"
#include "render/image/image.h"

namespace lucerna {

// Where an image goes; empty: not there.
struct OutputPaths {
  std::string image;      // .exr, .png, .pfm or .hdr
  std::string png;        // a PNG file beside it
  bool replaces = false;  // files that this program has not written too

  [[nodiscard]] bool empty() const { return image.empty() && png.empty(); }
};

// Devices and pipes have no ending, and take an EXR file.
[[nodiscard]] bool IsDevice(const std::string& path);

// Errors: Failure(kUsage) for names that cannot be, and for a file that is there and was not
// written by this program; what the system says of folders.
[[nodiscard]] Status CheckOutputs(const OutputPaths& outputs);

// Of a file that is no image. Errors: what the system says of folders; Failure(kUsage) for a file
// that is there without `mark` in its first bytes: something else wrote it.
[[nodiscard]] Status CheckMayWrite(const std::string& path, std::string_view mark);

// Writes the image, whose EXR file is `exr`. What cannot be written leaves no other file out, and
// goes to the folder for temporary files.
[[nodiscard]] StatusOr<SavedImage> WriteOutputs(const Image& image, const std::string& exr,
                                                const OutputPaths& outputs, const Display& display);

}  // namespace lucerna
