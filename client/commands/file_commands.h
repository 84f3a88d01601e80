// Commands that read local files and need no coordinator.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "client/commands/job_commands.h"
#include "render/base/status.h"
#include "render/film/image_metrics.h"

namespace lucerna {

// The image in an EXR file. Errors begin with the path.
[[nodiscard]] StatusOr<Image> ReadImage(const std::string& path);

// Says everything there is to say about the scene.
// Errors: INVALID_ARGUMENT when it has errors, or, if `strict`, warnings.
[[nodiscard]] Status Validate(const SceneSource& source, bool strict,
                              const OutputOptions& output_options);

// Compares `image_path` with `reference_path`. `mask_path` may be empty; `options.mask` is not
// used.
[[nodiscard]] Status Diff(const std::string& image_path, const std::string& reference_path,
                          const std::string& mask_path, MetricsOptions options,
                          const OutputOptions& output_options);

// Prints the digest of the pixels and settings.
[[nodiscard]] Status PrintDigest(const std::string& exr_path, const OutputOptions& output_options);

// Turns an EXR file, or one of its layers, into a file of another format.
struct PictureRequest {
  std::string exr_path;
  std::string path;             // .png, .pfm or .hdr
  std::string layer;            // empty: the image
  bool is_false_color = false;  // its numbers as colours (render/film/false_color.h)
  std::optional<std::pair<double, double>> range = std::nullopt;  // of them; absent: by the layer
};
[[nodiscard]] Status ConvertToPicture(const PictureRequest& request, const Display& display);

}  // namespace lucerna
