// Output options of a command.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "render/film/display.h"

namespace lucerna {

class TevView;

// How much of a job or a comparison a JSON value holds. Short: the properties that a script needs
// to go on. Full: all that is known; those of the short value are the same.
enum class JsonDetail : std::uint8_t { kShort, kFull };

struct OutputOptions {
  bool json = false;   // results as one JSON value
  bool quiet = false;  // no progress, no summary, no warnings
  // Progress on a terminal may be redrawn in place, and may show the image.
  bool redraws = false;
  bool previews = false;
  JsonDetail detail = JsonDetail::kShort;  // of JSON
  // Where the image so far is shown; nullptr: in no viewer.
  std::shared_ptr<TevView> tev = nullptr;
  Display display = {.exposure_stops = std::nullopt};  // of PNG files and previews
};

}  // namespace lucerna
