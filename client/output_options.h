// Output options of a command.
#pragma once

#include <optional>

#include "render/film/display.h"

namespace lucerna {

struct OutputOptions {
  bool json = false;   // results as one JSON value
  bool quiet = false;  // no progress, no summary, no warnings
  // Progress on a terminal may be redrawn in place, and may show the image.
  bool redraws = false;
  bool previews = false;
  Display display = {.exposure_stops = std::nullopt};  // of PNG files and previews
};

}  // namespace lucerna
