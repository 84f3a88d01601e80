#include "client/view_flags.h"

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"
#include <CLI/CLI.hpp>

#include "render/base/text.h"

namespace lucerna {
namespace {

std::array<double, 3> PointOf(const std::string& flag, const std::string& text) {
  std::array<double, 3> point{};
  const std::vector<std::string> numbers = absl::StrSplit(text, ',');
  bool is_point = numbers.size() == point.size();
  for (std::size_t i = 0; is_point && i < point.size(); ++i)
    is_point = absl::SimpleAtod(numbers[i], &point[i]) && std::isfinite(point[i]);
  if (!is_point) {
    throw CLI::ValidationError(
        flag, Concat("must be three numbers with commas between them, like 0,1.6,4; it is ",
                     Quoted(text)));
  }
  return point;
}

CLI::Option* AddNumber(CLI::App& command, const std::string& flag, std::optional<double>& number,
                       const std::string& help) {
  return command
      .add_option_function<double>(
          flag,
          [flag, &number](double given) {
            if (!std::isfinite(given)) throw CLI::ValidationError(flag, "must be a finite number");
            number = given;
          },
          help)
      ->type_name("NUMBER");
}

CLI::Option* AddPoint(CLI::App& command, const std::string& flag,
                      std::optional<std::array<double, 3>>& point, const std::string& help) {
  return command
      .add_option_function<std::string>(
          flag, [flag, &point](const std::string& text) { point = PointOf(flag, text); }, help)
      ->type_name("X,Y,Z");
}

}  // namespace

void AddCameraFlags(CLI::App& command, SceneView& view) {
  CLI::Option* from = AddPoint(command, "--camera-from", view.from,
                               "where the camera is, in place of the scene's own");
  CLI::Option* to = AddPoint(command, "--camera-to", view.to, "the point that it looks at");
  from->needs(to);
  to->needs(from);
  AddNumber(command, "--fov", view.fov_deg,
            "its angle [degrees] of the image's shorter side (default: 40)")
      ->needs(from);
}

void AddEnvironmentFlags(CLI::App& command, SceneView& view) {
  CLI::Option* environment =
      command.add_option("--environment", view.environment,
                         "picture in latitude and longitude that is the sky, in place of the "
                         "scene's infinite lights");
  AddNumber(command, "--environment-scale", view.scale, "what its pixels are multiplied by")
      ->needs(environment);
  AddNumber(command, "--environment-turn", view.turn_deg,
            "by how much it is turned about the upward direction [degrees]")
      ->needs(environment);
  AddPoint(command, "--up", view.up,
           "the upward direction of that camera and sky (default: 0,1,0)");
}

}  // namespace lucerna
