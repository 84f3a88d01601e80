// What does the path tracer see of each class of light paths?
//
// Writes the file that PathClassTest compares renders with (tests/statistical/traced_light.csv).
// Run: build/release/bin/lucerna-trace-path-classes OUT.csv [NAME...]
//   NAME  only these classes; the others stay as OUT.csv has them
// All take some ten minutes on two cores.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/files.h"
#include "tests/support/path_classes.h"
#include "tests/support/traced_light.h"

int main(int argc, char** argv) {
  using namespace lucerna;
  // So many times the paths of a class's effort.
  constexpr int kTimes = 4;
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s OUT.csv [NAME...]\n", argv[0]);
    return 2;
  }
  const std::string path = argv[1];
  const std::vector<std::string_view> names(argv + 2, argv + argc);
  std::map<std::string, TracedLight> before;
  if (std::filesystem::exists(path)) before = ReadTracedLight(path);
  const std::vector<PathClass> cells = AllPathClasses();
  for (const std::string_view name : names) {
    if (std::ranges::none_of(cells, [&](const PathClass& cell) { return NameOf(cell) == name; })) {
      std::fprintf(stderr, "there is no class %s\n", std::string(name).c_str());
      return 2;
    }
  }
  std::map<std::string, TracedLight> classes;
  for (const PathClass& cell : cells) {
    const std::string name = NameOf(cell);
    const auto known = before.find(name);
    if (!names.empty() && known != before.end() && std::ranges::find(names, name) == names.end()) {
      classes[name] = known->second;
      continue;
    }
    classes[name] = TraceClass(cell, kTimes);
    std::printf("%s %g +- %g\n", name.c_str(), classes[name][0].mean,
                classes[name][0].standard_error);
    std::fflush(stdout);
  }
  if (const Status written = WriteFile(path, WriteTracedLight(classes)); !written.ok()) {
    std::fprintf(stderr, "%s\n", std::string(written.message()).c_str());
    return 1;
  }
}
