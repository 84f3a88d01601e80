// A timeline is JSON that viewers take, shows each span once and whole, and is bounded.
#include "server/job_trace.h"

#include <map>
#include <string>
#include <vector>

#include "gtest/gtest.h"
#include <nlohmann/json.hpp>

namespace lucerna {
namespace {

using nlohmann::json;

SteadyTime At(int ms) {
  return SteadyTime(std::chrono::milliseconds(ms));
}

// The events of a phase, by their order in the file.
std::vector<json> Events(const json& file, const std::string& phase) {
  std::vector<json> events;
  for (const json& event : file.at("traceEvents")) {
    if (event.at("ph") == phase) events.push_back(event);
  }
  return events;
}

TEST(JobTraceTest, ShowsEachSpanOnItsRow) {
  JobTrace trace("job", At(100));
  trace.AddWorkers({"w1", "passes 0 to 4", At(110), At(150), {{"ending", "delivered"}}});
  trace.AddOwn({"estimate", "error after 4 \"passes\"", At(155), At(156)});
  trace.AddWorkers({"w1", "passes 4 to 8", At(150), At(170)});
  const json file = json::parse(trace.Json());
  EXPECT_EQ(file.at("otherData").at("job"), "job");
  EXPECT_EQ(file.at("otherData").at("spans_dropped"), 0);
  const std::vector<json> spans = Events(file, "X");
  ASSERT_EQ(spans.size(), 3U);
  EXPECT_EQ(spans[0].at("name"), "passes 0 to 4");
  EXPECT_EQ(spans[0].at("ts"), 10000) << "[µs] since the job began";
  EXPECT_EQ(spans[0].at("dur"), 40000);
  EXPECT_EQ(spans[0].at("args").at("ending"), "delivered");
  EXPECT_EQ(spans[1].at("name"), "passes 4 to 8") << "in order of their begin";
  EXPECT_EQ(spans[1].at("tid"), spans[0].at("tid")) << "a span that begins when another ends";
  EXPECT_EQ(spans[2].at("name"), "error after 4 \"passes\"");
  EXPECT_NE(spans[2].at("pid"), spans[0].at("pid"));

  std::map<std::pair<int, int>, std::string> names;
  for (const json& event : Events(file, "M")) {
    if (event.at("name") == "thread_name")
      names[{event.at("pid"), event.at("tid")}] = event.at("args").at("name");
  }
  for (const json& span : spans)
    EXPECT_TRUE(names.contains({span.at("pid"), span.at("tid")}));
  EXPECT_EQ((names[{spans[0].at("pid"), spans[0].at("tid")}]), "w1");
}

TEST(JobTraceTest, SpansThatOverlapHaveThreadsOfTheirOwn) {
  JobTrace trace("job", At(0));
  for (int i = 0; i < 40; ++i)
    trace.AddOwn({"merge", std::to_string(i), At(10 * i), At(10 * i + 25)});
  const json file = json::parse(trace.Json());
  std::map<int, double> free_at;
  for (const json& span : Events(file, "X")) {
    double& at = free_at[span.at("tid")];
    EXPECT_GE(span.at("ts").get<double>(), at);
    at = span.at("ts").get<double>() + span.at("dur").get<double>();
  }
  EXPECT_EQ(free_at.size(), 3U) << "as many as there are at once";
}

TEST(JobTraceTest, KeepsTheNewestAndSaysHowManyAreMissing) {
  JobTrace trace("job", At(0), /*most_spans=*/10);
  for (int i = 0; i < 25; ++i)
    trace.AddOwn({"row", std::to_string(i), At(i), At(i + 1)});
  const json file = json::parse(trace.Json());
  const std::vector<json> spans = Events(file, "X");
  ASSERT_EQ(spans.size(), 10U);
  EXPECT_EQ(spans.front().at("name"), "15");
  EXPECT_EQ(file.at("otherData").at("spans_dropped"), 15);
}

}  // namespace
}  // namespace lucerna
