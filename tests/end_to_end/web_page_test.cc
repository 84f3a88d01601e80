// The coordinator's page in a real browser: what it shows, whom it answers, and that nothing which
// a user or a worker calls itself becomes more than text.
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include "render/base/files.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

constexpr std::chrono::seconds kSoon{60};

// The rest of the line that begins so.
std::string LineAfter(const std::string& text, const std::string& begin) {
  const std::size_t at = text.find(begin);
  if (at == std::string::npos) return {};
  return text.substr(at + begin.size(), text.find('\n', at) - at - begin.size());
}

class WebPageTest : public testing::Test {
 protected:
  // With these flags beside the addresses.
  void Start(const std::vector<std::string>& flags = {}) {
    std::vector<std::string> command = {bin_ + "/lucerna-server", "--listen", "127.0.0.1:0",
                                        "--web", "127.0.0.1:0"};
    command.insert(command.end(), flags.begin(), flags.end());
    server_ = std::make_unique<ChildProcess>(command);
    ASSERT_TRUE(server_->WaitForText("page at", kSoon)) << server_->Errors();
    address_ = LineAfter(server_->Output(), "listening on ");
    const std::string url = LineAfter(server_->Output(), "page at http://127.0.0.1:");
    port_ = std::atoi(url.c_str());
  }

  // The whole answer to GET `path` with these header lines.
  [[nodiscard]] std::string Get(const std::string& path,
                                const std::string& headers = "Host: localhost\r\n") const {
    const int connection = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port_));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    std::string answer;
    if (connect(connection, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0) {
      const std::string request =
          "GET " + path + " HTTP/1.1\r\n" + headers + "Connection: close\r\n\r\n";
      if (write(connection, request.data(), request.size()) ==
          static_cast<ssize_t>(request.size())) {
        char bytes[4096];
        for (ssize_t size = 0; (size = read(connection, bytes, sizeof(bytes))) > 0;)
          answer.append(bytes, static_cast<std::size_t>(size));
      }
    }
    close(connection);
    return answer;
  }
  [[nodiscard]] int CodeOf(const std::string& path,
                           const std::string& headers = "Host: localhost\r\n") const {
    return std::atoi(Get(path, headers).substr(9, 3).c_str());
  }

  // Submits a copy of a small scene whose file has this name, and waits until it is done.
  std::string Render(const std::string& name) {
    const std::string path = folder_.path() + "/" + name;
    std::filesystem::copy_file(std::string(LUCERNA_SOURCE_DIR) + "/tests/scenes/corner.pbrt", path);
    const Finished submitted = RunProgram({bin_ + "/lucerna", "submit", path, "--size", "48x32",
                                           "--passes", "32", "--server", address_, "--json"},
                                          kSoon);
    EXPECT_EQ(submitted.exit_code, 0) << submitted.errors;
    const std::string key = "\"job_id\":";
    const std::size_t begin =
        submitted.output.find('"', submitted.output.find(key) + key.size()) + 1;
    const std::string job =
        submitted.output.substr(begin, submitted.output.find('"', begin) - begin);
    EXPECT_EQ(RunProgram({bin_ + "/lucerna", "wait", job, "--server", address_}, kSoon).exit_code,
              0);
    return job;
  }

  const std::string bin_ = LUCERNA_BIN_DIR;
  TemporaryFolder folder_;
  std::unique_ptr<ChildProcess> server_;
  std::string address_;
  int port_ = 0;
};

TEST_F(WebPageTest, ABrowserShowsJobsImagesErrorsWorkersAndLog) {
  if (!std::filesystem::exists("/usr/bin/chromium"))
    GTEST_SKIP() << "chromium is not installed; `bash deploy/packages.sh tests` does that";
  Start();
  ChildProcess worker({bin_ + "/lucerna-worker", "--server", address_});
  ASSERT_TRUE(server_->WaitForText(" joined with ", kSoon));
  Render("<img src=x onerror=alert(1)>.pbrt");
  const Finished visit = RunProgram(
      {"/usr/bin/chromium", "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run",
       "--disable-background-networking", "--enable-logging=stderr", "--virtual-time-budget=8000",
       "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
       "--user-data-dir=" + folder_.path() + "/profile", "--dump-dom",
       "http://127.0.0.1:" + std::to_string(port_) + "/"},
      kSoon);
  const std::string& dom = visit.output;
  EXPECT_NE(dom.find("data-ready=\"true\""), std::string::npos) << dom;
  // The name is text.
  EXPECT_NE(dom.find("&lt;img src=x onerror=alert(1)&gt;.pbrt</a>"), std::string::npos) << dom;
  EXPECT_EQ(dom.find("<img src=\"x\""), std::string::npos);
  EXPECT_NE(dom.find("<td>succeeded</td>"), std::string::npos) << dom;
  EXPECT_NE(dom.find("id=\"image\" alt=\"The image so far\" src=\"blob:"), std::string::npos)
      << dom;
  EXPECT_NE(dom.find("<td>active</td>"), std::string::npos) << dom;
  EXPECT_NE(dom.find(" joined with "), std::string::npos) << "the log";
  EXPECT_NE(dom.find("srcdoc=\"&lt;!"), std::string::npos) << "the report";
  EXPECT_NE(dom.find("error about"), std::string::npos) << dom;
  // Scripts and policies of the page agree: the browser complains of nothing.
  EXPECT_EQ(visit.errors.find(":CONSOLE("), std::string::npos) << visit.errors;
}

TEST_F(WebPageTest, PicturesFollowExposureAndWrongRequestsAreRefused) {
  Start();
  ChildProcess worker({bin_ + "/lucerna-worker", "--server", address_});
  const std::string job = Render("corner.pbrt");
  const auto picture = [&](const std::string& asked) {
    const std::string answer = Get("/jobs/" + job + "/image.png?" + asked);
    EXPECT_NE(answer.find("\x89PNG"), std::string::npos) << asked << "\n" << answer.substr(0, 300);
    return answer.substr(std::min(answer.size(), answer.find("\x89PNG")));
  };
  const std::string bright = picture("stops=2");
  EXPECT_NE(bright, picture("stops=-2"));
  EXPECT_NE(bright, picture("stops=2&curve=filmic"));
  EXPECT_EQ(bright, picture("stops=2"));
  EXPECT_EQ(CodeOf("/jobs/" + job + "/report"), 200);
  EXPECT_EQ(CodeOf("/jobs/" + job + "/image.png?stops=wide"), 400);
  EXPECT_EQ(CodeOf("/jobs/" + job + "/image.png?curve=wide"), 400);
  EXPECT_EQ(CodeOf("/jobs/unknown/image.png"), 404);
  EXPECT_EQ(CodeOf("/jobs/unknown/report"), 404);
  EXPECT_EQ(CodeOf("/etc/passwd"), 404);
  EXPECT_EQ(CodeOf("/../etc/passwd"), 404);
  // A page from elsewhere whose name leads to this machine.
  EXPECT_EQ(CodeOf("/api/farm", "Host: elsewhere.example\r\n"), 403);
  EXPECT_EQ(CodeOf("/jobs/" + job + "/report", "Host: elsewhere.example:80\r\n"), 403);
  EXPECT_EQ(CodeOf("/api/farm", "Host: 127.0.0.1:" + std::to_string(port_) + "\r\n"), 200);
}

TEST_F(WebPageTest, WithTokensItAnswersAdminsAlone) {
  const auto make_token = [&](const std::string& roles) {
    const Finished made =
        RunProgram({bin_ + "/lucerna", "token", "new", "someone", "--roles", roles, "--json"});
    EXPECT_EQ(made.exit_code, 0) << made.errors;
    const auto field = [&](const std::string& name) {
      const std::size_t begin =
          made.output.find('"', made.output.find("\"" + name + "\":") + name.size() + 3) + 1;
      return made.output.substr(begin, made.output.find('"', begin) - begin);
    };
    return std::pair(field("token"), field("line"));
  };
  const auto [admin, admin_line] = make_token("admin");
  const auto [user, user_line] = make_token("submit");
  const std::string tokens = folder_.path() + "/tokens";
  ASSERT_TRUE(WriteFile(tokens, admin_line + "\n" + user_line + "\n").ok());
  std::filesystem::permissions(tokens, std::filesystem::perms::owner_read);
  Start({"--tokens", tokens});
  const std::string host = "Host: localhost\r\n";
  EXPECT_EQ(CodeOf("/"), 200) << "the page itself says nothing of jobs";
  EXPECT_EQ(CodeOf("/api/farm"), 401);
  EXPECT_EQ(CodeOf("/jobs/a-1/report"), 401);
  EXPECT_EQ(CodeOf("/jobs/a-1/image.png"), 401);
  EXPECT_EQ(CodeOf("/api/farm", host + "Authorization: Bearer wrong\r\n"), 401);
  EXPECT_EQ(CodeOf("/api/farm", host + "Authorization: Bearer " + user + "\r\n"), 403);
  EXPECT_EQ(CodeOf("/api/farm", host + "Authorization: Bearer " + admin + "\r\n"), 200);
}

TEST_F(WebPageTest, AnAddressThatOthersReachMustBeAskedForByName) {
  const Finished open =
      RunProgram({bin_ + "/lucerna-server", "--listen", "127.0.0.1:0", "--web", "0.0.0.0:0"});
  EXPECT_EQ(open.exit_code, 2);
  EXPECT_NE(open.errors.find("--web 0.0.0.0:0 can be reached"), std::string::npos) << open.errors;
  Start();
  const Finished second = RunProgram({bin_ + "/lucerna-server", "--listen", "127.0.0.1:0", "--web",
                                      "127.0.0.1:" + std::to_string(port_)});
  EXPECT_EQ(second.exit_code, 3);
  EXPECT_NE(second.errors.find("cannot listen on 127.0.0.1"), std::string::npos) << second.errors;
}

}  // namespace
}  // namespace lucerna
