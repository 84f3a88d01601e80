// Commands about tokens.
#pragma once

#include <string>

#include "client/output_options.h"
#include "render/base/status.h"

namespace lucerna {

// Makes a token and prints it, with the line that makes a coordinator accept it. Nothing is kept.
// `roles` is as in the file of tokens ("submit,work").
// Errors: Failure(kUsage) for a name or roles that cannot be in that file.
[[nodiscard]] Status NewToken(const std::string& name, const std::string& roles,
                              const OutputOptions& output_options);

}  // namespace lucerna
