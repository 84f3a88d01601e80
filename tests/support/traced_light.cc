#include "tests/support/traced_light.h"

#include <cstddef>
#include <cstdint>
#include <sstream>

#include "absl/strings/str_format.h"

#include "render/base/files.h"
#include "render/base/status.h"
#include "render/math/rng.h"
#include "tests/support/path_tracer.h"

namespace lucerna {

TracedLight TraceClass(const PathClass& cell, int times, std::uint64_t key) {
  const Effort effort = EffortFor(cell);
  PathTracerSettings settings;
  settings.key = Mix64(KeyOf(NameOf(cell)));
  if (key != 0) settings.key = CombineKeys(settings.key, key);
  settings.max_depth = kDepthOfPathClasses;
  settings.paths_per_replica = effort.paths * times;
  settings.delta_radius = effort.delta_radius;
  settings.delta_angle_rad = effort.delta_radius / 2;
  const TracedImage image = TracePaths(SceneOf(cell), settings);
  const int half = settings.width / 2;
  TracedLight light;
  light[0] = image.MeanOver({0, 0, 2 * half, 2 * half}, 1);
  for (int i = 0; i < 4; ++i) {
    const int x = i % 2 * half;
    const int y = i / 2 * half;
    light[static_cast<std::size_t>(i) + 1] = image.MeanOver({x, y, x + half, y + half}, 1);
  }
  return light;
}

std::string WriteTracedLight(const std::map<std::string, TracedLight>& classes) {
  std::string text = "class";
  for (const char* block : {"whole", "first", "second", "third", "fourth"})
    text += absl::StrFormat(",%s,standard_error", block);
  text += '\n';
  for (const auto& [name, light] : classes) {
    text += name;
    for (const MeasuredMean& mean : light)
      text += absl::StrFormat(",%.6g,%.3g", mean.mean, mean.standard_error);
    text += '\n';
  }
  return text;
}

std::map<std::string, TracedLight> ReadTracedLight(const std::string& path) {
  const StatusOr<std::string> text = ReadFile(path);
  LUCERNA_CHECK(text.ok());
  std::istringstream lines(*text);
  std::string line;
  std::getline(lines, line);
  std::map<std::string, TracedLight> classes;
  while (std::getline(lines, line)) {
    std::istringstream fields(line);
    std::string name;
    std::getline(fields, name, ',');
    TracedLight& light = classes[name];
    char comma = ',';
    for (MeasuredMean& mean : light) {
      if (&mean != light.data()) fields >> comma;
      LUCERNA_CHECK(comma == ',' && fields >> mean.mean >> comma >> mean.standard_error);
    }
  }
  return classes;
}

}  // namespace lucerna
