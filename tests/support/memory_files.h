// A scene's files, held in memory: for tests that parse a text they spell out.
#pragma once

#include <map>
#include <string>

#include "render/base/status.h"
#include "render/scene/scene_files.h"

namespace lucerna {

class MemoryFiles final : public SceneFiles {
 public:
  explicit MemoryFiles(std::map<std::string, std::string> files) : files_(std::move(files)) {}

  [[nodiscard]] StatusOr<std::string> Read(const std::string& logical_path) override {
    if (Status status = CheckLogicalPath(logical_path); !status.ok()) return status;
    const auto file = files_.find(logical_path);
    if (file == files_.end()) return absl::NotFoundError(logical_path + ": no such file");
    return file->second;
  }

 private:
  std::map<std::string, std::string> files_;
};

}  // namespace lucerna
