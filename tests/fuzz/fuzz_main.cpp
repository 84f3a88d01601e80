// The libFuzzer program of one target, LUCERNA_FUZZ_TARGET. With --write-seeds=FOLDER it writes the
// target's seeds there and ends.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include <google/protobuf/stubs/logging.h>

#include "render/base/files.h"
#include "tests/fuzz/fuzz_targets.h"

namespace lucerna {
namespace {

const FuzzTarget& Target() {
  static const FuzzTarget* const found = [] {
    const FuzzTarget* of_name = nullptr;
    for (const FuzzTarget& target : AllFuzzTargets()) {
      if (std::string_view(target.name) == LUCERNA_FUZZ_TARGET) of_name = &target;
    }
    LUCERNA_CHECK(of_name != nullptr);
    return of_name;
  }();
  return *found;
}

}  // namespace
}  // namespace lucerna

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  // It would write a line for most inputs.
  google::protobuf::SetLogHandler(nullptr);
  constexpr std::string_view kWriteSeeds = "--write-seeds=";
  for (int i = 1; i < *count; ++i) {
    const std::string_view argument = (*arguments)[i];
    if (!argument.starts_with(kWriteSeeds)) continue;
    const std::string folder(argument.substr(kWriteSeeds.size()));
    int written = 0;
    for (const std::string& seed : lucerna::Target().seeds())
      LUCERNA_CHECK(
          lucerna::WriteFile(folder + "/seed-" + std::to_string(written++), {{seed}}, "seed").ok());
    std::exit(0);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static_cast<void>(lucerna::Target().read({reinterpret_cast<const char*>(bytes), size}));
  return 0;
}
