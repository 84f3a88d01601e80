// Any bytes as a PLY file: no crash, no hang, no memory without bound. Its seeds are
// tests/fuzz/corpus/ply.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "render/formats/ply_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const auto mesh = lucerna::ParsePly({reinterpret_cast<const char*>(bytes), size});
  if (!mesh.ok()) return 0;
  for (const std::uint32_t index : mesh->indices)
    LUCERNA_CHECK(index < mesh->positions.size());
  return 0;
}
