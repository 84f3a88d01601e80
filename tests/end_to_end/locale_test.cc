// The locale is obeyed by the real programs: its character set decides what is drawn, numbers have
// a point everywhere, and what programs read is UTF-8 everywhere.
#include <algorithm>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include <nlohmann/json.hpp>

#include "render/base/files.h"
#include "tests/end_to_end/programs.h"
#include "tests/support/on_terminal.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

using testing::HasSubstr;

constexpr const char* kTinyScene =
    "LookAt 0 0 9  0 0 0  0 1 0\nCamera \"perspective\"\nWorldBegin\n"
    "LightSource \"point\" \"point3 from\" [0 5 5]\nShape \"sphere\"\n";

bool IsAscii(const std::string& text) {
  return std::ranges::all_of(text, [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}

// The client with these variables and no others that name a locale.
std::vector<std::string> InLocale(const std::vector<std::string>& variables,
                                  const std::vector<std::string>& words) {
  std::vector<std::string> command = {"/usr/bin/env", "-u",   "LC_ALL", "-u",      "LC_CTYPE",
                                      "-u",           "LANG", "-u",     "NO_COLOR"};
  command.insert(command.end(), variables.begin(), variables.end());
  command.push_back(kBin + "/lucerna");
  command.insert(command.end(), words.begin(), words.end());
  return command;
}

Finished Lucerna(const std::vector<std::string>& variables, const std::vector<std::string>& words) {
  return RunProgram(InLocale(variables, words), kPatience);
}

// A render long enough for a curve and a picture.
std::string LiveViewIn(const std::string& variable, const TemporaryFolder& folder) {
  const OnTerminal ran = RunOnTerminal(
      InLocale({variable, "TERM=xterm-256color", "COLORTERM=truecolor"},
               {"render", SceneOfTests("caustic.pbrt"), "--size", "96x72", "--passes", "40",
                "--error", "0.01%", "-o", folder.At("image.exr"), "--no-checkpoints", "--force"}));
  EXPECT_EQ(ran.exit_code, 0) << ran.bytes;
  return ran.bytes;
}

TEST(LocaleTest, TheLiveViewIsDrawnWithTheCharactersOfTheLocale) {
  const TemporaryFolder folder;
  const std::string in_utf8 = LiveViewIn("LC_ALL=C.UTF-8", folder);
  EXPECT_THAT(in_utf8, HasSubstr("▀"));
  EXPECT_THAT(in_utf8, HasSubstr("⠀")) << "a letter of the curve without dots";
  for (const char* variable : {"LC_ALL=C", "LC_CTYPE=C", "LANG=C", "LC_ALL=no_SUCH.UTF-8"}) {
    const std::string in_ascii = LiveViewIn(variable, folder);
    EXPECT_TRUE(IsAscii(in_ascii)) << variable;
    EXPECT_THAT(in_ascii, HasSubstr("\x1b[48;2;")) << "the picture";
    EXPECT_THAT(in_ascii, HasSubstr("-----")) << "the target";
  }
}

TEST(LocaleTest, TheEnvironmentIsReadInTheOrderOfPosix) {
  const std::vector<std::string> words = {"selfcheck", "--only", "extreme-inside-glass"};
  const auto said = [&](const std::vector<std::string>& variables) {
    const Finished ran = Lucerna(variables, words);
    EXPECT_EQ(ran.exit_code, 0) << ran.errors;
    return ran.output;
  };
  EXPECT_THAT(said({"LANG=C", "LC_CTYPE=C", "LC_ALL=C.UTF-8"}), HasSubstr("n² times"));
  EXPECT_THAT(said({"LANG=C.UTF-8", "LC_CTYPE=C.UTF-8", "LC_ALL=C"}), HasSubstr("n^2 times"));
  EXPECT_THAT(said({"LANG=C", "LC_CTYPE=C.UTF-8"}), HasSubstr("n² times"));
  EXPECT_THAT(said({"LANG=C.UTF-8"}), HasSubstr("n² times"));
  EXPECT_THAT(said({}), HasSubstr("n^2 times")) << "without a locale it is C";
}

TEST(LocaleTest, TextIsAsciiAndDataIsUtf8) {
  const TemporaryFolder folder;
  const std::string scene = folder.At("küche.pbrt");
  ASSERT_TRUE(WriteFile(scene, kTinyScene).ok());
  const std::vector<std::string> words = {"validate", scene};
  const Finished in_utf8 = Lucerna({"LC_ALL=C.UTF-8"}, words);
  const Finished in_ascii = Lucerna({"LC_ALL=C"}, words);
  EXPECT_EQ(in_utf8.exit_code, 0) << in_utf8.errors;
  EXPECT_THAT(in_utf8.output, HasSubstr("küche.pbrt: 0 errors"));
  EXPECT_TRUE(IsAscii(in_ascii.output + in_ascii.errors)) << in_ascii.output << in_ascii.errors;
  EXPECT_THAT(in_ascii.output, HasSubstr("k\\u{fc}che.pbrt: 0 errors"));

  // What was typed comes back in messages, also in those of the parser of flags.
  const Finished wrong = Lucerna({"LC_ALL=C"}, {"render", scene, "--größe", "1"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_TRUE(IsAscii(wrong.output + wrong.errors)) << wrong.errors;
  EXPECT_THAT(wrong.errors, HasSubstr("gr\\u{f6}\\u{df}e"));

  const std::vector<std::string> render = {"render", scene,    "--size", "8x8", "--passes",
                                           "1",      "--json", "-o",     ""};
  const auto json_of = [&](const std::string& variable) {
    std::vector<std::string> now = render;
    now.back() = folder.At("größe.exr");
    const Finished ran = Lucerna({variable}, now);
    EXPECT_EQ(ran.exit_code, 0) << ran.errors;
    const auto printed = nlohmann::json::parse(ran.output);
    EXPECT_THAT(ran.output, HasSubstr("größe.exr"));
    return printed.at("name").get<std::string>();
  };
  EXPECT_EQ(json_of("LC_ALL=C"), "küche.pbrt");
  EXPECT_EQ(json_of("LC_ALL=C.UTF-8"), "küche.pbrt");
}

TEST(LocaleTest, TheLogOfAServiceIsInTheCharactersOfTheLocaleAndItsJsonInUtf8) {
  const TemporaryFolder folder;
  const std::string scene = folder.At("küche.pbrt");
  ASSERT_TRUE(WriteFile(scene, kTinyScene).ok());
  const auto log = [&](const std::string& variable, const std::string& format) {
    ChildProcess server({"/usr/bin/env", variable, kBin + "/lucerna-server", "--listen",
                         "127.0.0.1:0", "--log-format", format});
    EXPECT_TRUE(server.WaitForText("listening on ", kPatience));
    const std::string said = server.Output();
    const std::string address = said.substr(said.find("127."), said.find('\n') - said.find("127."));
    const Finished ran = Lucerna({"LC_ALL=C.UTF-8"}, {"submit", scene, "--server", address});
    EXPECT_EQ(ran.exit_code, 0) << ran.errors;
    if (ran.exit_code != 0) return std::string();
    EXPECT_TRUE(server.WaitForText("che.pbrt", kPatience)) << server.Errors();
    return server.Errors();
  };
  EXPECT_THAT(log("LC_ALL=C.UTF-8", "text"), HasSubstr("küche.pbrt"));
  const std::string in_ascii = log("LC_ALL=C", "text");
  EXPECT_TRUE(IsAscii(in_ascii)) << in_ascii;
  EXPECT_THAT(in_ascii, HasSubstr("k\\u{fc}che.pbrt"));
  EXPECT_THAT(log("LC_ALL=C", "json"), HasSubstr("küche.pbrt"));
}

// A locale with a comma, made for this test where Debian's package locales is installed.
TEST(LocaleTest, NumbersHaveAPointInEveryLocale) {
  const TemporaryFolder folder;
  const std::string locale = folder.At("de_DE.UTF-8");
  const Finished made = RunProgram(
      {"/usr/bin/env", "localedef", "--no-archive", "-i", "de_DE", "-f", "UTF-8", locale});
  if (!ReadFile(locale + "/LC_NUMERIC").ok()) {
    GTEST_SKIP() << "localedef makes no de_DE.UTF-8 here: " << made.errors;
  }
  const std::vector<std::string> german = {"LOCPATH=" + folder.At(""), "LC_ALL=de_DE.UTF-8"};
  const Finished comma =
      RunProgram({"/usr/bin/env", german[0], german[1], "/usr/bin/printf", "%.1f", "1,5"});
  ASSERT_EQ(comma.output, "1,5") << "the locale has a comma";

  ASSERT_EQ(Lucerna({}, {"render", SceneOfTests("caustic.pbrt"), "--size", "24x16", "--passes", "2",
                         "-o", folder.At("a.exr"), "--quiet"})
                .exit_code,
            0);
  const std::vector<std::vector<std::string>> commands = {
      {"diff", folder.At("a.exr"), folder.At("a.exr"), "--json"},
      {"plan", SceneOfTests("caustic.pbrt")},
      {"diff", folder.At("a.exr"), folder.At("a.exr"), "--trim", "0.25"},
      {"png", folder.At("a.exr"), folder.At("a.png"), "--layer", "radius", "--false-color"},
      {"help", "settings"},
      {"help", "man"}};
  for (const std::vector<std::string>& words : commands) {
    const Finished in_german = Lucerna(german, words);
    EXPECT_EQ(in_german.exit_code, 0) << in_german.errors;
    EXPECT_EQ(in_german.output, Lucerna({"LC_ALL=C.UTF-8"}, words).output) << words[0];
  }
  // Numbers that are typed and those of scene files too.
  ASSERT_EQ(Lucerna(german, {"render", SceneOfTests("caustic.pbrt"), "--size", "24x16", "--passes",
                             "2", "-o", folder.At("b.exr"), "--quiet"})
                .exit_code,
            0);
  EXPECT_EQ(Lucerna({}, {"digest", folder.At("a.exr")}).output,
            Lucerna(german, {"digest", folder.At("b.exr")}).output);
}

}  // namespace
}  // namespace lucerna
