// Scenes that tests write as pbrt-v4 texts.
#pragma once

#include <map>
#include <string>
#include <utility>

#include "gtest/gtest.h"

#include "render/formats/read_scene.h"
#include "tests/support/memory_files.h"

namespace lucerna {

// A whole file, with the others that it names.
inline ParsedScene ParsePbrt(const std::string& text,
                             std::map<std::string, std::string> others = {},
                             const SceneLimits& limits = {}) {
  others["s.pbrt"] = text;
  MemoryFiles files(std::move(others));
  return ReadScene(files, "s.pbrt", limits);
}
// What comes after WorldBegin, seen by a perspective camera.
inline ParsedScene ParseWorld(const std::string& world,
                              std::map<std::string, std::string> others = {}) {
  return ParsePbrt("Camera \"perspective\" WorldBegin\n" + world, std::move(others));
}

// The same of texts that must be right.
inline Scene ReadPbrt(const std::string& text, std::map<std::string, std::string> others = {}) {
  ParsedScene parsed = ParsePbrt(text, std::move(others));
  EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
  return std::move(parsed.scene);
}
inline Scene ReadWorld(const std::string& world, std::map<std::string, std::string> others = {}) {
  ParsedScene parsed = ParseWorld(world, std::move(others));
  EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
  return std::move(parsed.scene);
}

// All that is said of a text, one to a line.
inline std::string SaidOf(const ParsedScene& parsed) {
  std::string all;
  for (const Diagnostic& diagnostic : parsed.diagnostics)
    all += diagnostic.ToString() + "\n";
  return all;
}
inline std::string SaidOfPbrt(const std::string& text,
                              std::map<std::string, std::string> others = {},
                              const SceneLimits& limits = {}) {
  return SaidOf(ParsePbrt(text, std::move(others), limits));
}
inline std::string SaidOfWorld(const std::string& world) {
  return SaidOf(ParseWorld(world));
}

}  // namespace lucerna
