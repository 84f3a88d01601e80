// The client's children must be found, told apart when they die, and never outlive it.
//
// Shell scripts play the coordinator and the worker, so that a test can make them fail at will.
#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "gtest/gtest.h"
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "client/local_cluster.h"

namespace lucerna {
namespace {

using std::chrono::milliseconds;

constexpr char kListens[] = "echo starting >&2; echo listening on 127.0.0.1:1234; ";
constexpr char kStays[] = "exec sleep 100";

class LocalClusterTest : public testing::Test {
 protected:
  LocalClusterTest() {
    std::string pattern = testing::TempDir() + "clusterXXXXXX";
    folder_ = mkdtemp(pattern.data());
  }
  ~LocalClusterTest() override { std::filesystem::remove_all(folder_); }

  // Each script first writes its process number down.
  void Write(const std::string& name, const std::string& script) {
    const std::string path = folder_ + "/" + name;
    std::ofstream(path) << "#!/bin/sh\necho $$ >> " << path << ".pids; echo \"$@\" >> " << path
                        << ".flags\n"
                        << script << "\n";
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  }
  std::string Lines(const std::string& name) {
    std::ifstream file(folder_ + "/" + name);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  // Waits for the script's number: a child may have been started and not have run yet.
  pid_t PidOf(const std::string& name) {
    for (int i = 0; i < 6000; ++i) {
      const std::string lines = Lines(name + ".pids");
      if (lines.find('\n') != std::string::npos) return std::stoi(lines);
      std::this_thread::sleep_for(milliseconds(10));
    }
    ADD_FAILURE() << name << " did not start";
    return -1;
  }
  static bool EndsSoon(pid_t pid) {
    for (int i = 0; i < 6000; ++i) {
      if (::kill(pid, 0) != 0) return true;
      std::this_thread::sleep_for(milliseconds(10));
    }
    return false;
  }
  ClusterOptions Options(int workers) { return {folder_, workers, 0}; }

  std::string folder_;
};

TEST_F(LocalClusterTest, StartsAndEndsAll) {
  Write("lucerna-server", std::string(kListens) + kStays);
  Write("lucerna-worker", kStays);
  auto cluster = LocalCluster::Start(Options(1));
  ASSERT_TRUE(cluster.ok()) << cluster.status();
  EXPECT_EQ((*cluster)->address(), "127.0.0.1:1234");
  EXPECT_TRUE((*cluster)->Check().ok());
  const pid_t worker = PidOf("lucerna-worker");
  const pid_t coordinator = PidOf("lucerna-server");
  EXPECT_EQ(Lines("lucerna-server.flags"), "--listen 127.0.0.1:0\n");
  EXPECT_EQ(Lines("lucerna-worker.flags"), "--server 127.0.0.1:1234 --threads 0\n");
  (*cluster)->Stop();
  EXPECT_NE(::kill(worker, 0), 0);
  EXPECT_NE(::kill(coordinator, 0), 0);
}

TEST_F(LocalClusterTest, ChildrenHaveTheVariablesOfTheUserAndHugePages) {
  ::setenv("LUCERNA_LOCAL_CLUSTER_TEST", "here", 1);
  const std::string script =
      "echo \"$LUCERNA_LOCAL_CLUSTER_TEST $GLIBC_TUNABLES\" > " + folder_ + "/variables\n" + kStays;
  const auto variables_of_worker = [&] {
    Write("lucerna-server", std::string(kListens) + kStays);
    Write("lucerna-worker", script);
    std::filesystem::remove(folder_ + "/variables");
    auto cluster = LocalCluster::Start(Options(1));
    EXPECT_TRUE(cluster.ok()) << cluster.status();
    std::string lines;
    for (int i = 0; i < 6000 && !lines.ends_with('\n'); ++i) {
      lines = Lines("variables");
      std::this_thread::sleep_for(milliseconds(10));
    }
    return lines;
  };
  ::unsetenv("GLIBC_TUNABLES");
  EXPECT_EQ(variables_of_worker(), "here glibc.malloc.hugetlb=1\n");
  ::setenv("GLIBC_TUNABLES", "glibc.malloc.arena_max=2", 1);
  EXPECT_EQ(variables_of_worker(), "here glibc.malloc.arena_max=2\n");
  ::unsetenv("GLIBC_TUNABLES");
  ::unsetenv("LUCERNA_LOCAL_CLUSTER_TEST");
}

TEST_F(LocalClusterTest, KillsAChildThatDoesNotLeave) {
  Write("lucerna-server", std::string(kListens) + "trap '' TERM; while true; do sleep 0.1; done");
  Write("lucerna-worker", kStays);
  auto cluster = LocalCluster::Start(Options(1));
  ASSERT_TRUE(cluster.ok()) << cluster.status();
  const pid_t coordinator = PidOf("lucerna-server");
  (*cluster)->Stop();
  EXPECT_NE(::kill(coordinator, 0), 0);
}

TEST_F(LocalClusterTest, SaysWhyTheCoordinatorDidNotStart) {
  Write("lucerna-server", "echo no such flag >&2; exit 2");
  Write("lucerna-worker", kStays);
  const Status status = LocalCluster::Start(Options(1)).status();
  EXPECT_NE(std::string(status.message()).find("coordinator ended by itself with code 2"),
            std::string::npos)
      << status;
  EXPECT_NE(std::string(status.message()).find("no such flag"), std::string::npos) << status;
}

TEST_F(LocalClusterTest, SaysWhereItLooksForAProgramThatIsMissing) {
  Write("lucerna-server", std::string(kListens) + kStays);
  const Status status = LocalCluster::Start(Options(1)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_NE(std::string(status.message()).find(folder_ + "/lucerna-worker"), std::string::npos);
  EXPECT_TRUE(EndsSoon(PidOf("lucerna-server"))) << "the coordinator must not stay behind";
}

TEST_F(LocalClusterTest, GoesOnWhileOneWorkerLives) {
  Write("lucerna-server", std::string(kListens) + kStays);
  // Only the first one to make the folder dies.
  Write("lucerna-worker",
        "if mkdir " + folder_ + "/first; then echo out of memory >&2; exit 9; fi\n" + kStays);
  auto cluster = LocalCluster::Start(Options(2));
  ASSERT_TRUE(cluster.ok()) << cluster.status();
  std::this_thread::sleep_for(milliseconds(300));
  EXPECT_TRUE((*cluster)->Check().ok()) << (*cluster)->Check();
}

TEST_F(LocalClusterTest, SaysWhyItsOnlyWorkerEnded) {
  Write("lucerna-server", std::string(kListens) + kStays);
  Write("lucerna-worker", "echo out of memory >&2; kill -9 $$");
  auto cluster = LocalCluster::Start(Options(1));
  ASSERT_TRUE(cluster.ok()) << cluster.status();
  Status status;
  for (int i = 0; i < 6000 && status.ok(); ++i) {
    status = (*cluster)->Check();
    std::this_thread::sleep_for(milliseconds(10));
  }
  EXPECT_EQ(std::string(status.message()).find("no worker is left"), 0U) << status;
  EXPECT_NE(std::string(status.message()).find("worker was ended by signal 9"), std::string::npos)
      << status;
  EXPECT_NE(std::string(status.message()).find("out of memory"), std::string::npos) << status;
}

TEST_F(LocalClusterTest, ChildrenDieWithAClientThatIsKilled) {
  Write("lucerna-server", std::string(kListens) + kStays);
  Write("lucerna-worker", kStays);
  const pid_t client = ::fork();
  if (client == 0) {
    const auto cluster = LocalCluster::Start(Options(1));
    while (true)
      ::pause();
  }
  const pid_t worker = PidOf("lucerna-worker");
  const pid_t coordinator = PidOf("lucerna-server");
  ::kill(client, SIGKILL);
  ::waitpid(client, nullptr, 0);
  // Orphans are reaped by whoever is first in this container, if anybody; a zombie is dead too.
  const auto is_dead = [](pid_t pid) {
    std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
    std::string number;
    std::string name;
    std::string state;
    return !(file >> number >> name >> state) || state == "Z" || state == "X";
  };
  for (int i = 0; i < 6000 && !(is_dead(worker) && is_dead(coordinator)); ++i) {
    std::this_thread::sleep_for(milliseconds(10));
  }
  EXPECT_TRUE(is_dead(worker));
  EXPECT_TRUE(is_dead(coordinator));
}

}  // namespace
}  // namespace lucerna
