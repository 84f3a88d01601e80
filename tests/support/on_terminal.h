// What does a program write when it runs on a terminal?
#pragma once

#include <string>
#include <vector>

namespace lucerna {

struct OnTerminal {
  int exit_code = -1;
  std::string bytes;  // standard output and error, as the terminal gets them
};

// Runs the program to its end on a pseudo-terminal of 120 columns and 40 rows.
[[nodiscard]] OnTerminal RunOnTerminal(std::vector<std::string> command);

}  // namespace lucerna
