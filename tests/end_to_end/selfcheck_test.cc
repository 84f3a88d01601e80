// The real programs, on this machine, must pass the check that users are given.
#include <array>
#include <cstdio>
#include <string>

#include "gtest/gtest.h"
#include <nlohmann/json.hpp>
#include <sys/wait.h>

namespace lucerna {
namespace {

struct Ran {
  int code = 0;
  std::string out;
};

Ran Selfcheck(const std::string& words) {
  const std::string command = std::string(LUCERNA_BIN_DIR) + "/lucerna selfcheck " + words;
  FILE* pipe = ::popen(command.c_str(), "r");
  Ran ran;
  std::array<char, 4096> buffer;
  while (const std::size_t size = std::fread(buffer.data(), 1, buffer.size(), pipe))
    ran.out.append(buffer.data(), size);
  const int status = ::pclose(pipe);
  ran.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ran;
}

TEST(SelfcheckTest, EveryCaseHolds) {
  const Ran ran = Selfcheck("--json");
  EXPECT_EQ(ran.code, 0);
  const nlohmann::json report = nlohmann::json::parse(ran.out);
  EXPECT_TRUE(report["holds"]);
  EXPECT_GT(report["cases"].size(), 5U);
  for (const nlohmann::json& one : report["cases"])
    EXPECT_TRUE(one["holds"]) << one.dump(2);
}

TEST(SelfcheckTest, OneLineForEachCaseThatIsAskedFor) {
  const Ran ran = Selfcheck("--only fixed-point");
  EXPECT_EQ(ran.code, 0);
  EXPECT_TRUE(ran.out.starts_with("ok     fixed-point: ")) << ran.out;
  EXPECT_EQ(ran.out.find('\n'), ran.out.size() - 1) << ran.out;
}

TEST(SelfcheckTest, AnUnknownCaseIsWrongUsage) {
  EXPECT_EQ(Selfcheck("--only nothing-like-it 2>/dev/null").code, 2);
}

}  // namespace
}  // namespace lucerna
