// The kinds of shape, light, material and so on that are read: a table from name to function.
//
// Each kind has a small reader function of its own and one row in the table of its directive, from
// which the messages that list the supported names are made too.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/text.h"

namespace lucerna {

template <typename Function>
struct Kind {
  std::string_view name;
  Function read;
};

// The reader of the kind `name`; nullptr when there is no such kind.
template <typename Function>
[[nodiscard]] Function FindReader(std::span<const Kind<Function>> kinds, std::string_view name) {
  for (const Kind<Function>& kind : kinds) {
    if (kind.name == name) return kind.read;
  }
  return nullptr;
}

// "there are sphere and disk".
template <typename Function>
[[nodiscard]] std::string SupportedKinds(std::span<const Kind<Function>> kinds) {
  std::vector<std::string_view> names;
  for (const Kind<Function>& kind : kinds)
    names.push_back(kind.name);
  return Concat(names.size() == 1 ? "there is " : "there are ", Listed(names));
}

}  // namespace lucerna
