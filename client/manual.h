// The manual page of lucerna(1), made from its commands and the table of settings.
#pragma once

#include <string>

namespace CLI {
class App;
}  // namespace CLI

namespace lucerna {

// In the language of man(7).
[[nodiscard]] std::string ManualOf(const CLI::App& app);

}  // namespace lucerna
