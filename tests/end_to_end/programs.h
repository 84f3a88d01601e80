// The programs that were built, and scenes to give them.
#pragma once

#include <chrono>
#include <string>

namespace lucerna {

// For what must happen, however busy the machine is: ends only what hangs.
inline constexpr std::chrono::seconds kPatience{120};
inline const std::string kBin = LUCERNA_BIN_DIR;

// The path of a file of tests/scenes.
[[nodiscard]] inline std::string SceneOfTests(const std::string& name) {
  return std::string(LUCERNA_SOURCE_DIR) + "/tests/scenes/" + name;
}

}  // namespace lucerna
