// With --log-format json every line that a service writes to stderr is one JSON object, and a
// worker that is killed is in it with the reason.
#include <csignal>
#include <sstream>
#include <string>
#include <vector>

#include "gtest/gtest.h"
#include <nlohmann/json.hpp>

#include "tests/end_to_end/programs.h"
#include "tests/support/process.h"

namespace lucerna {
namespace {

using nlohmann::json;

std::vector<json> LinesOf(const std::string& log) {
  std::vector<json> lines;
  std::istringstream stream(log);
  for (std::string line; std::getline(stream, line);) {
    const json parsed = json::parse(line, nullptr, /*allow_exceptions=*/false);
    EXPECT_TRUE(parsed.is_object()) << line;
    if (!parsed.is_object()) continue;
    for (const char* name : {"time", "level", "program", "message"})
      EXPECT_TRUE(parsed.contains(name) && parsed[name].is_string()) << line;
    lines.push_back(parsed);
  }
  return lines;
}

TEST(JsonLogTest, EveryLineIsAnObjectAndALostWorkerHasItsReason) {
  ChildProcess server(
      {kBin + "/lucerna-server", "--listen", "127.0.0.1:0", "--log-format", "json"});
  ASSERT_TRUE(server.WaitForText("listening on ", kPatience));
  const std::string said = server.Output();
  const std::string address = said.substr(said.find("127."), said.find('\n') - said.find("127."));
  ChildProcess worker(
      {kBin + "/lucerna-worker", "--server", address, "--threads", "1", "--log-format", "json"});
  ASSERT_TRUE(worker.WaitForText("joined", kPatience));
  worker.Signal(SIGKILL);
  // At once, or where its first call for work had not come yet, after half a minute of silence.
  ASSERT_TRUE(server.WaitForText("\"warning\"", 3 * kPatience));
  server.Signal(SIGTERM);
  ASSERT_EQ(server.WaitForExit(kPatience), 0);

  bool is_lost = false;
  for (const json& line : LinesOf(server.Errors())) {
    EXPECT_EQ(line["program"], "lucerna-server");
    const std::string message = line["message"];
    is_lost = is_lost || (line["level"] == "warning" &&
                          (message.find("its connection broke") != std::string::npos ||
                           message.find("it crashed or was cut off") != std::string::npos));
  }
  EXPECT_TRUE(is_lost);
  EXPECT_GE(LinesOf(worker.Errors()).size(), 1U);
}

TEST(JsonLogTest, TheLastWordsOfAProgramAreALineToo) {
  const Finished worker = RunProgram({kBin + "/lucerna-worker", "--server", "127.0.0.1:1",
                                      "--connect-timeout", "0.1", "--log-format", "json"});
  EXPECT_EQ(worker.exit_code, 3);
  const std::vector<json> lines = LinesOf(worker.errors);
  ASSERT_FALSE(lines.empty());
  EXPECT_EQ(lines.back()["level"], "critical");
}

}  // namespace
}  // namespace lucerna
