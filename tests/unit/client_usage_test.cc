// A command line that is short, or has a typo.
#include <string>
#include <vector>

#include "gtest/gtest.h"
#include <CLI/CLI.hpp>

#include "client/usage.h"

namespace lucerna {
namespace {

TEST(UsageTest, AFirstWordMayBeAScene) {
  for (const char* word : {"room.pbrt", "a/room.pbrt.gz", "x.gltf", "x.glb"})
    EXPECT_TRUE(LooksLikeScene(word)) << word;
  for (const char* word : {"render", "--version", "room", "-o.pbrt", "room.exr", ""})
    EXPECT_FALSE(LooksLikeScene(word)) << word;
}

TEST(UsageTest, TheImageHasTheNameOfTheScene) {
  EXPECT_EQ(ImageNameOf("rooms/room.pbrt"), "room.exr");
  EXPECT_EQ(ImageNameOf("room.v2.pbrt.gz"), "room.v2.exr");
  EXPECT_EQ(ImageNameOf("room.glb"), "room.exr");
  EXPECT_EQ(ImageNameOf("room"), "room.exr");
}

TEST(UsageTest, EditsAreCounted) {
  EXPECT_EQ(EditDistance("", ""), 0U);
  EXPECT_EQ(EditDistance("abc", ""), 3U);
  EXPECT_EQ(EditDistance("kitten", "sitting"), 3U);
  EXPECT_EQ(EditDistance("rendre", "render"), 1U) << "two letters are swapped";
  EXPECT_EQ(EditDistance("watch", "wtahc"), 2U);
}

TEST(UsageTest, TheNearestCommandOrFlagIsProposed) {
  CLI::App app;
  CLI::App* render = app.add_subcommand("render", "");
  app.add_subcommand("report", "");
  std::string value;
  render->add_option("-o,--output", value);
  render->add_option("--passes", value);
  const auto of = [&](const std::vector<std::string>& words) { return Suggestion(app, words); };
  EXPECT_EQ(of({"rendr", "x"}), "lucerna: there is no rendr; did you mean render?\n");
  EXPECT_EQ(of({"repotr"}), "lucerna: there is no repotr; did you mean report?\n");
  EXPECT_EQ(of({"render", "x", "--pases=3"}),
            "lucerna: there is no --pases; did you mean --passes?\n");
  EXPECT_EQ(of({"render", "--passes", "x"}), "");
  EXPECT_EQ(of({"cook"}), "");
  EXPECT_EQ(of({"render", "--colour"}), "");
  EXPECT_EQ(of({"rende\x1br"}), "lucerna: there is no rende\\x1br; did you mean render?\n")
      << "escaped";
  EXPECT_EQ(of({}), "");
}

TEST(UsageTest, ShellsCompleteCommandsAndFlags) {
  CLI::App app;
  CLI::App* render = app.add_subcommand("render", "render the user's scene");
  CLI::App* token = app.add_subcommand("token", "tokens");
  token->add_subcommand("new", "");
  std::string value;
  render->add_option("--passes", value, "how many");
  const std::string bash = CompletionScript(app, Shell::kBash);
  EXPECT_NE(bash.find("render) words=\"--help --passes\""), std::string::npos) << bash;
  EXPECT_NE(bash.find("token) words=\"--help new\""), std::string::npos) << bash;
  EXPECT_NE(bash.find("words=\"render token\""), std::string::npos) << bash;
  EXPECT_NE(CompletionScript(app, Shell::kZsh).find(bash), std::string::npos);
  const std::string fish = CompletionScript(app, Shell::kFish);
  EXPECT_NE(fish.find("-a render -d 'render the user\\'s scene'\n"), std::string::npos) << fish;
  EXPECT_NE(fish.find("'__fish_seen_subcommand_from render' -l passes -d 'how many'\n"),
            std::string::npos)
      << fish;
}

TEST(UsageTest, TheFileOfFlagsIsWhereOthersKeepTheirs) {
  EXPECT_EQ(ConfigPath("/c", "/home/u"), "/c/lucerna.toml");
  EXPECT_EQ(ConfigPath("", "/home/u"), "/home/u/.config/lucerna.toml");
  EXPECT_EQ(ConfigPath(nullptr, "/home/u"), "/home/u/.config/lucerna.toml");
  EXPECT_EQ(ConfigPath("relative", nullptr), "") << "as the XDG base directories have it";
}

}  // namespace
}  // namespace lucerna
