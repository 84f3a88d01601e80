// How is text of others shown, so that it can do nothing but be read?
//
// A worker's name, a scene's path or a server's message may hold bytes that move a terminal's
// cursor, forge a line of a log, or turn the order of letters around. Whatever comes from another
// process or from a file goes through here before it reaches a terminal or a log.
#pragma once

#include <string>
#include <string_view>

namespace lucerna {

// `text` on one line: printable UTF-8 stays as it is. Control characters, line ends among them, and
// bytes that are not UTF-8 become \xNN; characters that are invisible or change the direction of
// writing become \u{NNNN}. Backslashes stay, so escaping twice is the same as once.
[[nodiscard]] std::string Escaped(std::string_view text);

// The same for text of several lines: '\n' stays.
[[nodiscard]] std::string EscapedLines(std::string_view text);

}  // namespace lucerna
