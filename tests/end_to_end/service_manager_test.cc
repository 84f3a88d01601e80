// What systemd would hear of the real programs: a socket takes its place.
#include <csignal>
#include <cstddef>
#include <cstring>
#include <string>

#include "gtest/gtest.h"
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include "tests/end_to_end/programs.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

class Manager {
 public:
  Manager() : path_(folder_.At("notify")), socket_(::socket(AF_UNIX, SOCK_DGRAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof(address.sun_path) - 1);
    is_bound_ = ::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  }
  ~Manager() { ::close(socket_); }
  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;

  [[nodiscard]] bool is_bound() const { return is_bound_; }

  // Starts a program with a watchdog of 400 ms.
  [[nodiscard]] std::vector<std::string> Command(std::vector<std::string> words) const {
    std::vector<std::string> command = {"/usr/bin/env", "-u", "WATCHDOG_PID",
                                        "NOTIFY_SOCKET=" + path_, "WATCHDOG_USEC=400000"};
    command.insert(command.end(), words.begin(), words.end());
    return command;
  }

  // The next word of the program; empty when it says nothing for `wait`, which is not 0.
  [[nodiscard]] std::string Next(std::chrono::milliseconds wait) const {
    const timeval time = {wait.count() / 1000, wait.count() % 1000 * 1000};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &time, sizeof(time));
    char word[256];
    const ssize_t size = ::recv(socket_, word, sizeof(word), 0);
    return size > 0 ? std::string(word, static_cast<std::size_t>(size)) : "";
  }
  // The next one that is not that it lives.
  [[nodiscard]] std::string NextBesideLife() const {
    std::string word;
    do
      word = Next(kPatience);
    while (word == "WATCHDOG=1");
    return word;
  }

 private:
  const TemporaryFolder folder_;
  const std::string path_;
  const int socket_;
  bool is_bound_ = false;
};

TEST(ServiceManagerTest, TheCoordinatorSaysThatItListensLivesAndEnds) {
  const Manager manager;
  ASSERT_TRUE(manager.is_bound());
  ChildProcess server(manager.Command({kBin + "/lucerna-server", "--listen", "127.0.0.1:0"}));
  ASSERT_EQ(manager.Next(kPatience), "READY=1");
  EXPECT_TRUE(server.WaitForText("listening on", std::chrono::seconds(0)));
  EXPECT_EQ(manager.Next(kPatience), "WATCHDOG=1");
  EXPECT_EQ(manager.Next(kPatience), "WATCHDOG=1");
  // One that stands still is not heard of any more, once what it had said before is read.
  server.Signal(SIGSTOP);
  while (manager.Next(std::chrono::milliseconds(100)) == "WATCHDOG=1") {
  }
  EXPECT_EQ(manager.Next(std::chrono::seconds(2)), "");
  server.Signal(SIGCONT);
  server.Signal(SIGTERM);
  EXPECT_EQ(manager.NextBesideLife(), "STOPPING=1");
  EXPECT_EQ(server.WaitForExit(kPatience), 0);
}

TEST(ServiceManagerTest, AWorkerSaysThatItLivesAndEnds) {
  const Manager manager;
  ASSERT_TRUE(manager.is_bound());
  // Without a coordinator too: it waits for one.
  ChildProcess worker(manager.Command(
      {kBin + "/lucerna-worker", "--server", "127.0.0.1:1", "--connect-timeout", "600"}));
  EXPECT_EQ(manager.Next(kPatience), "WATCHDOG=1");
  EXPECT_EQ(manager.Next(kPatience), "WATCHDOG=1");
  worker.Signal(SIGTERM);
  EXPECT_EQ(manager.NextBesideLife(), "STOPPING=1");
  EXPECT_EQ(worker.WaitForExit(kPatience), 0);
}

}  // namespace
}  // namespace lucerna
