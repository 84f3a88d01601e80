// The texts of the page that WebListener serves.
#pragma once

#include <string_view>

namespace lucerna {

extern const std::string_view kWebPage, kWebScript, kWebStyle;

}  // namespace lucerna
