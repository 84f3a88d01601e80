#include "render/base/byte_size.h"

#include <charconv>
#include <cmath>
#include <system_error>

namespace lucerna {

std::optional<std::uint64_t> ParseByteSize(std::string_view text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value, std::chars_format::fixed);
  if (error != std::errc() || !(value >= 0)) return std::nullopt;
  std::string_view unit(stopped, static_cast<std::size_t>(end - stopped));
  if (unit.ends_with('B')) unit.remove_suffix(1);
  if (!unit.empty()) {
    constexpr std::string_view kPrefixes = "kMGT";
    const std::size_t prefix = kPrefixes.find(unit[0] == 'K' ? 'k' : unit[0]);
    const bool is_binary = unit.substr(1) == "i";
    if (prefix == std::string_view::npos || !(unit.size() == 1 || is_binary)) return std::nullopt;
    value *= std::pow(is_binary ? 1024.0 : 1000.0, static_cast<double>(prefix + 1));
  }
  if (!(value <= 0x1p53)) return std::nullopt;
  return static_cast<std::uint64_t>(value);
}

}  // namespace lucerna
