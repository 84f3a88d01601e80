// A line of a JSON log is one object whatever the message holds.
#include "render/wire/program_log.h"

#include <chrono>
#include <string>

#include "gtest/gtest.h"
#include <nlohmann/json.hpp>

namespace lucerna {
namespace {

using nlohmann::json;

constexpr std::chrono::system_clock::time_point kTime{std::chrono::milliseconds{1'764'028'799'007}};

TEST(JsonLogTest, HasTimeLevelProgramAndMessage) {
  EXPECT_EQ(
      JsonLogLine(kTime, "info", "lucerna-server", "job 1 submitted"),
      "{\"time\":\"2025-11-24T23:59:59.007Z\",\"level\":\"info\",\"program\":\"lucerna-server\","
      "\"message\":\"job 1 submitted\"}");
}

TEST(JsonLogTest, EveryMessageComesBackAsItWas) {
  std::string all;
  for (char c = 1; c < 127; ++c)
    all += c;
  all += '\0';
  for (const std::string& message : {all, std::string("\"quoted\" \\ back\nnew line\ttab"),
                                     std::string("größer 字 \U0001F4A1")}) {
    const std::string line = JsonLogLine(kTime, "warning", "p", message);
    EXPECT_EQ(line.find('\n'), std::string::npos);
    EXPECT_EQ(json::parse(line).at("message").get<std::string>(), message);
  }
}

TEST(JsonLogTest, BytesThatAreNotUtf8AreReplaced) {
  const std::string line = JsonLogLine(kTime, "error", "p", "a\xFFz\xC3");
  EXPECT_EQ(json::parse(line).at("message").get<std::string>(), "a\uFFFDz\uFFFD");
}

}  // namespace
}  // namespace lucerna
