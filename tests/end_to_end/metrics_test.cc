// Those who watch a farm read what its programs did, and the numbers are right.
#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>

#include "gtest/gtest.h"
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/support/process.h"

namespace lucerna {
namespace {

constexpr std::chrono::seconds kSoon{60};

// What a program answers to GET /metrics at the URL that it has printed.
std::string PageOf(const ChildProcess& program) {
  const std::string begin = "metrics at http://127.0.0.1:";
  const std::string said = program.Output();
  const std::size_t at = said.find(begin);
  if (at == std::string::npos) return {};
  const int port = std::atoi(said.c_str() + at + begin.size());
  const int connection = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::string page;
  if (connect(connection, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0) {
    const std::string request = "GET /metrics HTTP/1.0\r\nHost: localhost\r\n\r\n";
    if (write(connection, request.data(), request.size()) == static_cast<ssize_t>(request.size())) {
      char bytes[4096];
      for (ssize_t size = 0; (size = read(connection, bytes, sizeof(bytes))) > 0;)
        page.append(bytes, static_cast<std::size_t>(size));
    }
  }
  close(connection);
  return page;
}

// The value of a sample; -1 when it is not on the page.
double ValueOf(const std::string& page, const std::string& sample) {
  const std::size_t at = page.find("\n" + sample + " ");
  if (at == std::string::npos) return -1;
  return std::atof(page.c_str() + at + sample.size() + 2);
}

TEST(MetricsTest, CoordinatorAndWorkerTellWhatAJobTook) {
  const std::string bin = LUCERNA_BIN_DIR;
  ChildProcess server({bin + "/lucerna-server", "--listen", "127.0.0.1:0", "--metrics",
                       "127.0.0.1:0", "--audit-share", "0"});
  ASSERT_TRUE(server.WaitForText("/metrics\n", kSoon)) << server.Errors();
  const std::string greeting = "listening on ";
  const std::string said = server.Output();
  const std::string address = said.substr(greeting.size(), said.find('\n') - greeting.size());
  const std::string before = PageOf(server);
  EXPECT_EQ(ValueOf(before, "lucerna_workers{state=\"active\"}"), 0);
  EXPECT_EQ(ValueOf(before, "lucerna_jobs{state=\"succeeded\"}"), 0);
  EXPECT_EQ(ValueOf(before, "lucerna_photons_total"), 0);

  ChildProcess worker({bin + "/lucerna-worker", "--server", address, "--metrics", "127.0.0.1:0"});
  ASSERT_TRUE(worker.WaitForText("/metrics\n", kSoon)) << worker.Errors();
  const Finished submitted =
      RunProgram({bin + "/lucerna", "submit",
                  std::string(LUCERNA_SOURCE_DIR) + "/tests/scenes/corner.pbrt", "--size", "64x64",
                  "--passes", "6", "--photons-per-pass", "1000", "--server", address, "--json"},
                 kSoon);
  ASSERT_EQ(submitted.exit_code, 0) << submitted.errors;
  const std::string key = "\"job_id\":";
  const std::size_t begin = submitted.output.find('"', submitted.output.find(key) + key.size()) + 1;
  const std::string job = submitted.output.substr(begin, submitted.output.find('"', begin) - begin);
  const Finished waited = RunProgram({bin + "/lucerna", "wait", job, "--server", address}, kSoon);
  ASSERT_EQ(waited.exit_code, 0) << waited.errors;

  // The job's last words may come before the worker has its answer.
  std::string of_worker;
  for (int i = 0; i < 100 && ValueOf(of_worker, "lucerna_worker_photons_total") < 6000; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    of_worker = PageOf(worker);
  }
  const std::string page = PageOf(server);
  EXPECT_EQ(ValueOf(page, "lucerna_jobs{state=\"succeeded\"}"), 1) << page;
  EXPECT_EQ(ValueOf(page, "lucerna_photons_total"), 6000);
  EXPECT_EQ(ValueOf(page, "lucerna_workers{state=\"active\"}"), 1);
  EXPECT_EQ(ValueOf(page, "lucerna_leases"), 0);
  const double results = ValueOf(page, "lucerna_results_total{outcome=\"accepted\"}");
  EXPECT_GE(results, 1);
  EXPECT_EQ(ValueOf(page, "lucerna_result_seconds_count"), results);
  EXPECT_GE(ValueOf(page, "lucerna_leases_total"), results);
  EXPECT_EQ(
      ValueOf(page, "lucerna_call_seconds_count{method=\"/lucerna.v1.WorkerService/Register\"}"),
      1);
  EXPECT_GT(ValueOf(page, "process_resident_memory_bytes"), 1e6);
  EXPECT_EQ(ValueOf(of_worker, "lucerna_worker_connected"), 1) << of_worker;
  // A lease that was superseded is computed and not delivered.
  EXPECT_GE(ValueOf(of_worker, "lucerna_worker_photons_total"), 6000);
  EXPECT_GE(ValueOf(of_worker, "lucerna_worker_lease_seconds_count"), results);
  EXPECT_EQ(ValueOf(of_worker, "lucerna_worker_failures_total"), 0);
}

TEST(MetricsTest, AnAddressThatCannotBeUsedIsSaidSo) {
  const std::string bin = LUCERNA_BIN_DIR;
  const Finished open =
      RunProgram({bin + "/lucerna-server", "--listen", "127.0.0.1:0", "--metrics", "0.0.0.0:0"});
  EXPECT_EQ(open.exit_code, 2);
  EXPECT_NE(open.errors.find("--metrics 0.0.0.0:0 can be reached"), std::string::npos)
      << open.errors;
  const Finished wrong =
      RunProgram({bin + "/lucerna-server", "--listen", "127.0.0.1:0", "--metrics", "here"});
  EXPECT_EQ(wrong.exit_code, 2);
  ChildProcess server(
      {bin + "/lucerna-server", "--listen", "127.0.0.1:0", "--metrics", "127.0.0.1:0"});
  ASSERT_TRUE(server.WaitForText("/metrics\n", kSoon));
  const std::string said = server.Output();
  const std::size_t at = said.find("http://") + 7;
  const std::string used = said.substr(at, said.find('/', at) - at);
  const Finished second =
      RunProgram({bin + "/lucerna-server", "--listen", "127.0.0.1:0", "--metrics", used});
  EXPECT_EQ(second.exit_code, 3);
  EXPECT_NE(second.errors.find("cannot listen on " + used), std::string::npos) << second.errors;
}

}  // namespace
}  // namespace lucerna
