#include "client/frames.h"

#include <algorithm>
#include <filesystem>
#include <optional>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"

#include "client/exit_code.h"

namespace lucerna {
namespace {

// All requests are made before the first is rendered, of some hundred bytes each.
constexpr std::size_t kMostFrames = 100'000;

Status NoFrames(std::string_view frames) {
  return Failure(ExitCode::kUsage,
                 absl::StrCat("--frames ", std::string(frames),
                              ": give numbers and ranges of them, like 1-24 or 1,5,8-10"));
}

// Whole numbers from 0, no longer than their digits.
std::optional<int> NumberOf(const std::string& text) {
  int number = 0;
  const bool has_digits_alone =
      !text.empty() && std::ranges::all_of(text, [](char c) { return absl::ascii_isdigit(c); });
  if (!has_digits_alone || !absl::SimpleAtoi(text, &number)) return std::nullopt;
  return number;
}

StatusOr<std::vector<int>> NumbersOf(std::string_view frames) {
  std::vector<int> numbers;
  const std::vector<std::string> parts = absl::StrSplit(std::string(frames), ',');
  for (const std::string& part : parts) {
    const std::vector<std::string> ends = absl::StrSplit(part, absl::MaxSplits('-', 1));
    const std::optional<int> first = NumberOf(ends.front());
    const std::optional<int> last = NumberOf(ends.back());
    if (!first || !last || *last < *first) return NoFrames(frames);
    if (static_cast<std::size_t>(*last - *first) >= kMostFrames - numbers.size()) {
      return Failure(ExitCode::kUsage,
                     absl::StrCat("--frames ", std::string(frames), ": more than ", kMostFrames,
                                  " frames; give fewer at once"));
    }
    for (int number = *first; number <= *last; ++number)
      numbers.push_back(number);
  }
  return numbers;
}

// What a file's name ends with, before its endings.
std::optional<int> NumberInName(const std::string& path) {
  std::string stem = std::filesystem::path(path).filename().string();
  if (stem.ends_with(".gz")) stem.resize(stem.size() - 3);
  stem = std::filesystem::path(stem).stem().string();
  const std::size_t other = stem.find_last_not_of("0123456789");
  return NumberOf(other == std::string::npos ? stem : stem.substr(other + 1));
}

}  // namespace

bool HasFrameNumber(std::string_view path) {
  return path.find('#') != std::string_view::npos;
}

std::string WithFrameNumber(std::string_view path, int number) {
  const std::size_t last = path.rfind('#');
  if (last == std::string_view::npos) return std::string(path);
  const std::size_t before = path.find_last_not_of('#', last);
  const std::size_t first = before == std::string_view::npos ? 0 : before + 1;
  return absl::StrFormat("%s%0*d%s", std::string(path.substr(0, first)),
                         static_cast<int>(last + 1 - first), number,
                         std::string(path.substr(last + 1)));
}

StatusOr<std::vector<SceneFrame>> FramesOf(const std::vector<std::string>& scenes,
                                           std::string_view frames) {
  const bool has_numbers = std::ranges::any_of(scenes, HasFrameNumber);
  std::vector<SceneFrame> found;
  if (frames.empty()) {
    if (has_numbers) {
      return Failure(ExitCode::kUsage,
                     "a # in a scene's name stands for the number of a frame; say which with "
                     "--frames, like --frames 1-24");
    }
    for (const std::string& scene : scenes)
      found.push_back({scene, NumberInName(scene).value_or(static_cast<int>(found.size()) + 1)});
    return found;
  }
  if (!has_numbers) {
    return Failure(ExitCode::kUsage,
                   "--frames needs a scene with # in its name, like room.####.pbrt");
  }
  LUCERNA_ASSIGN_OR_RETURN(const std::vector<int> numbers, NumbersOf(frames));
  for (const int number : numbers) {
    for (const std::string& scene : scenes)
      found.push_back({WithFrameNumber(scene, number), number});
  }
  return found;
}

}  // namespace lucerna
