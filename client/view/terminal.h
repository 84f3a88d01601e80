// How large is the terminal?
//
// The only file that queries it.
#pragma once

#include <optional>

namespace lucerna {

struct TerminalSize {
  int columns = 80, rows = 24;

  bool operator==(const TerminalSize&) const = default;
};

// Of the terminal behind the file descriptor, now; absent when it is none. One that does not know
// its size gets the customary one.
[[nodiscard]] std::optional<TerminalSize> SizeOfTerminal(int descriptor);

}  // namespace lucerna
