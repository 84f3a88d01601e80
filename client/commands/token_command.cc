#include "client/commands/token_command.h"

#include "absl/strings/escaping.h"
#include <nlohmann/json.hpp>

#include "client/exit_code.h"
#include "render/base/console.h"
#include "render/base/digest.h"
#include "render/base/random_id.h"
#include "render/base/token_file.h"

namespace lucerna {
namespace {

constexpr std::size_t kTokenBytes = 32;

}  // namespace

Status NewToken(const std::string& name, const std::string& roles,
                const OutputOptions& output_options) {
  if (!IsTokenName(name)) {
    return Failure(ExitCode::kUsage,
                   "a token's name is 1 to 64 letters, digits and any of . _ @ -");
  }
  if (const auto parsed = ParseRoles(roles); !parsed.ok()) {
    return Failure(ExitCode::kUsage, std::string(parsed.status().message()));
  }
  // The beginning is for people and programs that look for secrets where there should be none.
  const std::string token = "lucerna-" + absl::BytesToHexString(RandomBytes(kTokenBytes));
  const std::string line = absl::StrCat(name, " ", roles, " ", Sha256(token).Hex());
  if (output_options.json) {
    const nlohmann::ordered_json result = {{"token", token}, {"line", line}};
    PrintData(result.dump(2) + "\n");
    return absl::OkStatus();
  }
  PrintText(absl::StrCat("token, for ", name, " alone:\n", token,
                         "\nline for the coordinator's --tokens file:\n", line, "\n"));
  return absl::OkStatus();
}

}  // namespace lucerna
