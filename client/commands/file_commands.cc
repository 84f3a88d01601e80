#include "client/commands/file_commands.h"

#include <array>
#include <cmath>
#include <filesystem>

#include "absl/strings/str_format.h"

#include "client/exit_code.h"
#include "client/scene_reading.h"
#include "client/view/report.h"
#include "render/base/console.h"
#include "render/base/escape.h"
#include "render/base/files.h"
#include "render/estimate/error_estimate.h"
#include "render/film/false_color.h"
#include "render/film/picture_file.h"
#include "render/image/exr_file.h"

namespace lucerna {
namespace {

std::string Counted(std::size_t count, const std::string& word) {
  return absl::StrCat(count, " ", word, count == 1 ? "" : "s");
}

}  // namespace

StatusOr<Image> ReadImage(const std::string& path) {
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, ReadFile(path));
  StatusOr<Image> image = DecodeExr(bytes);
  if (image.ok()) return image;
  return absl::InvalidArgumentError(absl::StrCat(path, ": ", image.status().message()));
}

Status Validate(const SceneSource& source, bool strict, const OutputOptions& output_options) {
  const std::string& scene_path = source.path;
  LUCERNA_RETURN_IF_ERROR(CheckNamesFile(scene_path));
  const std::string main_file = MainFileOf(source);
  DirectoryFiles files = FilesOf(source);
  // A program gets them all, up to what fits in memory.
  constexpr std::size_t kMaxForPrograms = 1'000'000;
  const ParsedScene parsed = ReadScene(
      files, main_file, {}, output_options.json ? kMaxForPrograms : Diagnostics::kMaxOfEach);
  std::array<std::size_t, 3> counts{};
  for (const Diagnostic& diagnostic : parsed.diagnostics) {
    ++counts[static_cast<std::size_t>(diagnostic.severity)];
    const bool is_error = diagnostic.severity == Diagnostic::Severity::kError;
    // As JSON they are the result itself.
    if (output_options.json || (output_options.quiet && !is_error)) continue;
    PrintError(Escaped(diagnostic.ToString()) + "\n");
  }
  const bool is_ok = parsed.ok() && !(strict && counts[1] > 0);
  if (output_options.json) PrintData(SceneReport(parsed.diagnostics, is_ok));
  const std::string summary =
      absl::StrCat(scene_path, ": ", Counted(counts[0], "error"), ", ",
                   Counted(counts[1], "warning"), ", ", Counted(counts[2], "note"));
  if (!is_ok) return absl::InvalidArgumentError(summary);
  if (!output_options.json && !output_options.quiet) PrintText(summary + "\n");
  return absl::OkStatus();
}

Status Diff(const std::string& image_path, const std::string& reference_path,
            const std::string& mask_path, MetricsOptions options,
            const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const Image image, ReadImage(image_path));
  LUCERNA_ASSIGN_OR_RETURN(const Image reference, ReadImage(reference_path));
  Image mask;
  if (!mask_path.empty()) {
    LUCERNA_ASSIGN_OR_RETURN(mask, ReadImage(mask_path));
    options.mask = &mask;
  }
  LUCERNA_ASSIGN_OR_RETURN(const ImageMetrics metrics, Compare(image, reference, options));
  if (output_options.json) {
    PrintData(MetricsReport(metrics));
    return absl::OkStatus();
  }
  const double trimmed_share = options.trim_share > 0 ? options.trim_share : kTrimmedShare;
  const std::string text = absl::StrFormat(
      "pixels compared  %d\n"
      "RMSE             %.6g\n"
      "relMSE trimmed   %.6g  (without the worst %g %% of pixels)\n"
      "relMSE untrimmed %.6g  (all pixels)\n"
      "means            %.6g and %.6g\n"
      "mean ratio       %.6f  (R %.6f, G %.6f, B %.6f)\n",
      metrics.pixels, metrics.rmse, metrics.rel_mse_trimmed, 100 * trimmed_share,
      metrics.rel_mse_untrimmed, metrics.mean_a, metrics.mean_b, metrics.mean_ratio,
      metrics.channel_mean_ratio[0], metrics.channel_mean_ratio[1], metrics.channel_mean_ratio[2]);
  PrintText(text);
  if (metrics.reference_rel_mse && metrics.reference_mse) {
    const std::string of_reference = absl::StrFormat(
        "the reference's noise: relMSE trimmed %.6g, untrimmed %.6g; RMSE %.6g\n"
        "without it: relMSE trimmed %.6g, untrimmed %.6g\n",
        metrics.reference_rel_mse_trimmed, metrics.reference_rel_mse_untrimmed,
        std::sqrt(*metrics.reference_mse),
        metrics.rel_mse_trimmed - metrics.reference_rel_mse_trimmed,
        metrics.rel_mse_untrimmed - metrics.reference_rel_mse_untrimmed);
    PrintText(of_reference);
  }
  return absl::OkStatus();
}

Status PrintDigest(const std::string& exr_path, const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const Image image, ReadImage(exr_path));
  const std::string text =
      output_options.json ? DigestReport(image) : absl::StrCat(image.PixelDigest().Hex(), "\n");
  PrintData(EscapedLines(text));
  return absl::OkStatus();
}

Status ConvertToPicture(const PictureRequest& request, const Display& display) {
  if (IsSameFile(request.exr_path, request.path)) {
    return Failure(
        ExitCode::kUsage,
        absl::StrCat(request.path, ": the picture would replace the EXR; give it another name"));
  }
  std::error_code ignored;
  StatusOr<PictureFormat> format = PictureFormatOf(request.path);
  if (std::filesystem::is_other(request.path, ignored)) format = PictureFormat::kPng;
  if (!format.ok()) {
    return Failure(ExitCode::kUsage, absl::StrCat(request.path, ": ", format.status().message()));
  }
  LUCERNA_ASSIGN_OR_RETURN(Image image, ReadImage(request.exr_path));
  if (request.is_false_color) {
    const std::string layer = request.layer.empty() ? "density" : request.layer;
    LUCERNA_ASSIGN_OR_RETURN(const FalseColors colors, FalseColorsOf(image, layer, request.range));
    LUCERNA_ASSIGN_OR_RETURN(const std::string bytes,
                             EncodePicture(colors.picture, *format, Display()));
    LUCERNA_RETURN_IF_ERROR(WriteFile(request.path, bytes));
    PrintText(absl::StrFormat("%s: dark blue is %.4g, white %.4g%s\n", Escaped(layer),
                              colors.scale.low, colors.scale.high,
                              colors.scale.is_logarithmic ? ", logarithmic between" : ""));
    return absl::OkStatus();
  }
  if (!request.layer.empty()) {
    LUCERNA_ASSIGN_OR_RETURN(image, PictureOfLayer(image, request.layer));
  }
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, EncodePicture(image, *format, display));
  return WriteFile(request.path, bytes);
}

}  // namespace lucerna
