#include "client/usage.h"

#include <algorithm>
#include <array>
#include <filesystem>

#include <CLI/CLI.hpp>

#include "render/base/escape.h"
#include "render/base/status.h"

namespace lucerna {
namespace {

constexpr std::array<std::string_view, 6> kSceneEndings = {".pbrt.gz", ".pbrt", ".gltf",
                                                           ".glb",     ".xml",  ".gz"};

std::vector<std::string> FlagsOf(const CLI::App& command) {
  std::vector<std::string> flags;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames())
      flags.push_back("--" + name);
  }
  return flags;
}

std::vector<const CLI::App*> CommandsOf(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

std::string_view EndingOf(std::string_view path) {
  const auto found = std::ranges::find_if(
      kSceneEndings, [&](std::string_view ending) { return path.ends_with(ending); });
  return found == kSceneEndings.end() ? std::string_view() : *found;
}

// Of two or more letters, a third may be wrong.
std::string Nearest(std::string_view word, const std::vector<std::string>& known) {
  std::string nearest;
  std::size_t least = word.size() / 3 + 1;
  for (const std::string& name : known) {
    const std::size_t distance = EditDistance(word, name);
    if (distance == 0) return "";
    if (distance < least) {
      least = distance;
      nearest = name;
    }
  }
  return nearest;
}

std::string Proposal(std::string_view word, const std::string& nearest) {
  if (nearest.empty()) return "";
  return absl::StrCat("lucerna: there is no ", Escaped(std::string(word)), "; did you mean ",
                      nearest, "?\n");
}

}  // namespace

const CLI::App* FindCommand(const CLI::App& app, const std::string& name) {
  const auto found =
      app.get_subcommands([&](const CLI::App* command) { return command->get_name() == name; });
  return found.empty() ? nullptr : found.front();
}

bool LooksLikeScene(std::string_view word) {
  return !word.starts_with('-') && !EndingOf(word).empty();
}

std::string ImageNameOf(std::string_view scene_path) {
  std::string name = std::filesystem::path(scene_path).filename().string();
  name.resize(name.size() - EndingOf(name).size());
  return name + ".exr";
}

std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> distance(a.size() + 1,
                                                 std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        distance[i][j] = i + j;
        continue;
      }
      const bool is_same = a[i - 1] == b[j - 1];
      distance[i][j] = std::min({distance[i - 1][j] + 1, distance[i][j - 1] + 1,
                                 distance[i - 1][j - 1] + (is_same ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        distance[i][j] = std::min(distance[i][j], distance[i - 2][j - 2] + 1);
    }
  }
  return distance[a.size()][b.size()];
}

std::string Suggestion(const CLI::App& app, const std::vector<std::string>& words) {
  if (words.empty()) return "";
  const auto is_flag = [](std::string_view word) { return word.starts_with("--"); };
  const CLI::App* command = FindCommand(app, words.front());
  if (command == nullptr) {
    if (is_flag(words.front())) return "";
    std::vector<std::string> commands;
    for (const CLI::App* known : CommandsOf(app))
      commands.push_back(known->get_name());
    return Proposal(words.front(), Nearest(words.front(), commands));
  }
  const std::vector<std::string> flags = FlagsOf(*command);
  for (const std::string& word : words) {
    const std::string flag = word.substr(0, word.find('='));
    if (!is_flag(flag) || std::ranges::find(flags, flag) != flags.end()) continue;
    if (std::string line = Proposal(flag, Nearest(flag, flags)); !line.empty()) return line;
  }
  return "";
}

namespace {

std::string Joined(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& word : words)
    all += (all.empty() ? "" : " ") + word;
  return all;
}

std::string BashScript(const CLI::App& app) {
  std::vector<std::string> names;
  std::string cases;
  for (const CLI::App* command : CommandsOf(app)) {
    names.push_back(command->get_name());
    std::vector<std::string> words = FlagsOf(*command);
    for (const CLI::App* below : CommandsOf(*command))
      words.push_back(below->get_name());
    cases += absl::StrCat("    ", command->get_name(), ") words=\"", Joined(words), "\" ;;\n");
  }
  return absl::StrCat(
      "_lucerna() {\n"
      "  local word=\"${COMP_WORDS[COMP_CWORD]}\" words=\"\"\n"
      "  case \"${COMP_WORDS[1]}\" in\n",
      cases,
      "  esac\n"
      "  if [ \"$COMP_CWORD\" -eq 1 ]; then words=\"",
      Joined(names),
      "\"; fi\n"
      "  COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n"
      "}\n"
      "complete -o default -F _lucerna lucerna\n");
}

// Within single quotes of fish.
std::string Quoted(const std::string& text) {
  std::string quoted;
  for (const char letter : text) {
    if (letter == '\'' || letter == '\\') quoted += '\\';
    quoted += letter;
  }
  return absl::StrCat("'", quoted, "'");
}

std::string FishScript(const CLI::App& app) {
  std::string script;
  for (const CLI::App* command : CommandsOf(app)) {
    const std::string& name = command->get_name();
    script += absl::StrCat("complete -c lucerna -n __fish_use_subcommand -a ", name, " -d ",
                           Quoted(command->get_description()), "\n");
    for (const CLI::Option* option : command->get_options()) {
      for (const std::string& flag : option->get_lnames()) {
        script += absl::StrCat("complete -c lucerna -n '__fish_seen_subcommand_from ", name,
                               "' -l ", flag, " -d ", Quoted(option->get_description()), "\n");
      }
    }
  }
  return script;
}

}  // namespace

std::string CompletionScript(const CLI::App& app, Shell shell) {
  if (shell == Shell::kFish) return FishScript(app);
  const std::string script = BashScript(app);
  return shell == Shell::kBash ? script : "autoload -U +X bashcompinit && bashcompinit\n" + script;
}

std::string ConfigPath(const char* config_home, const char* home) {
  const auto is_given = [](const char* path) { return path != nullptr && *path == '/'; };
  if (is_given(config_home)) return absl::StrCat(config_home, "/lucerna.toml");
  if (is_given(home)) return absl::StrCat(home, "/.config/lucerna.toml");
  return "";
}

}  // namespace lucerna
