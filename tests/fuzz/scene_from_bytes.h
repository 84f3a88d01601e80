// A scene's text that may be anything, beside a few good files that it may name; with small limits.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/files.h"
#include "render/formats/read_scene.h"
#include "tests/support/memory_files.h"

namespace lucerna {

struct NamedBytes {
  std::string name, bytes;
};

// The files of a folder of tests/, by name.
[[nodiscard]] inline std::vector<NamedBytes> FilesOf(const std::string& folder) {
  std::vector<NamedBytes> files;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(LUCERNA_SOURCE_DIR) + "/tests/" + folder)) {
    files.push_back({entry.path().filename().string(), ReadFile(entry.path().string()).value()});
  }
  std::sort(files.begin(), files.end(),
            [](const NamedBytes& a, const NamedBytes& b) { return a.name < b.name; });
  return files;
}

[[nodiscard]] inline std::string BytesOf(const std::string& file) {
  return ReadFile(std::string(LUCERNA_SOURCE_DIR) + "/tests/" + file).value();
}

// `name` of the main file chooses the format.
[[nodiscard]] inline ParsedScene SceneFromBytes(std::string_view bytes,
                                                const std::string& name = "fuzz.pbrt") {
  static const std::map<std::string, std::string>& good =
      *new std::map<std::string, std::string>{{"part.pbrt", "Shape \"sphere\"\n"},
                                              {"whole.pbrt",
                                               "Camera \"perspective\" WorldBegin "
                                               "LightSource \"point\" Shape \"sphere\"\n"},
                                              {"mesh.ply", FilesOf("fuzz/seeds/ply").at(0).bytes},
                                              {"sky.pfm", BytesOf("fuzz/seeds/image/square.pfm")},
                                              {"tiles.png", BytesOf("fuzz/seeds/image/rgb.png")}};
  std::map<std::string, std::string> all = good;
  all[name] = bytes;
  MemoryFiles files(std::move(all));
  SceneLimits limits;
  limits.max_files = 50;
  limits.max_picture_bytes = 1 << 20;
  limits.max_total_bytes = 1 << 20;
  limits.max_triangles = 2'000;
  limits.max_shape_bytes = 1 << 24;
  return ReadScene(files, name, limits);
}

}  // namespace lucerna
