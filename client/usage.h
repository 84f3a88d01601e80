// What did a user mean whose command line is not understood, or is short?
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}  // namespace CLI

namespace lucerna {

// nullptr when there is no command of this name.
[[nodiscard]] const CLI::App* FindCommand(const CLI::App& app, const std::string& name);

// Whether a first word is a scene and not a command: `lucerna room.pbrt` renders it.
[[nodiscard]] bool LooksLikeScene(std::string_view word);

// Where the image of a scene goes when no output is given: "room.exr" in this folder, of
// "rooms/room.pbrt.gz".
[[nodiscard]] std::string ImageNameOf(std::string_view scene_path);

// How many letters are to be inserted, left out, replaced or swapped with the next one to make `a`
// of `b` (Damerau 1964, with each place changed once).
[[nodiscard]] std::size_t EditDistance(std::string_view a, std::string_view b);

// A line with the command or flag that is nearest to the first unknown one of `words`; empty where
// none is near.
[[nodiscard]] std::string Suggestion(const CLI::App& app, const std::vector<std::string>& words);

enum class Shell : unsigned char { kBash, kZsh, kFish };
// A script that completes commands, flags and names of files.
[[nodiscard]] std::string CompletionScript(const CLI::App& app, Shell shell);

// The file of flags that is read when none is named: lucerna.toml in $XDG_CONFIG_HOME, else in
// ~/.config; empty when both are unknown. Either argument may be null.
[[nodiscard]] std::string ConfigPath(const char* config_home, const char* home);

}  // namespace lucerna
