// What workers say of themselves is shown and can do nothing else.
#include <algorithm>
#include <string>

#include "gtest/gtest.h"

#include "client/view/worker_view.h"

namespace lucerna {
namespace {

v1::Worker Hostile() {
  v1::Worker worker;
  worker.set_worker_id("0123456789abcdef");
  worker.set_name("host\x1b[2J\nWORKER forged");
  worker.set_reason("its \x07 reason");
  worker.set_state(v1::WORKER_STATE_QUARANTINED);
  worker.set_failed(3);
  worker.mutable_silent()->set_seconds(75);
  return worker;
}

TEST(WorkerViewTest, TheTableEscapesNamesAndReasons) {
  const std::string table = WorkersTable({Hostile()});
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 2) << table;
  EXPECT_EQ(table.find('\x1b'), std::string::npos);
  EXPECT_EQ(table.find('\x07'), std::string::npos);
  EXPECT_NE(table.find("quarantine"), std::string::npos);
  EXPECT_NE(table.find("0123456789abcdef"), std::string::npos);
}

TEST(WorkerViewTest, TheReportIsJsonWithTheSameFigures) {
  const std::string report = WorkersReport({Hostile()});
  EXPECT_NE(report.find("\"failed\": 3"), std::string::npos) << report;
  EXPECT_NE(report.find("\"silent_s\": 75"), std::string::npos) << report;
  EXPECT_EQ(report.find('\x1b'), std::string::npos);
  EXPECT_EQ(WorkersReport({}), "[]\n");
}

}  // namespace
}  // namespace lucerna
