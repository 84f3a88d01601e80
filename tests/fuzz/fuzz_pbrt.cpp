// Any bytes as a scene's text: no crash, no hang, no memory without bound, and a scene without
// errors is sound. Its seeds are tests/fuzz/corpus/pbrt and tests/scenes.
#include <cstddef>
#include <cstdint>
#include <string>

#include "render/formats/read_scene.h"
#include "tests/fuzz/sound_scene.h"
#include "tests/support/memory_files.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  lucerna::MemoryFiles files(
      {{"fuzz.pbrt", std::string(reinterpret_cast<const char*>(bytes), size)}});
  lucerna::SceneLimits limits;
  limits.max_files = 50;
  limits.max_total_bytes = 1 << 20;
  limits.max_triangles = 10'000;
  const lucerna::ParsedScene parsed = lucerna::ReadScene(files, "fuzz.pbrt", limits);
  LUCERNA_CHECK(!parsed.ok() || lucerna::WhatIsUnsound(parsed.scene).empty());
  return 0;
}
