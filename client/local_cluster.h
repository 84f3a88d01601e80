// Who renders when there is no farm?
//
// A coordinator and its workers as child processes on loopback, for one job. They are found beside
// the program itself. They die with this process, however it ends: the kernel kills them when it
// vanishes. What they write is read and its last lines are kept, for the day one of them fails.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "render/base/status.h"

namespace lucerna {

// The folder that holds the running program. Errors: what the system says.
[[nodiscard]] StatusOr<std::string> ProgramFolder();

struct ClusterOptions {
  std::string program_folder;  // holds lucerna-server and lucerna-worker
  int workers = 1;             // >= 1
  int threads = 0;             // of each worker; 0: the machine's, shared between the workers
  // Where the coordinator keeps its jobs, so that a later cluster can go on; empty: nowhere.
  std::string state_folder = {};
};

class LocalCluster {
 public:
  // Returns when the coordinator accepts calls. To be called by a thread that lives as long as the
  // cluster: the kernel ties the children to it.
  // Errors: NOT_FOUND when the programs are not there, INTERNAL with the last lines of a child
  // that ended, Failure(kInterrupted).
  [[nodiscard]] static StatusOr<std::unique_ptr<LocalCluster>> Start(const ClusterOptions& options);

  // Stops what is left.
  ~LocalCluster();

  // "127.0.0.1:PORT".
  [[nodiscard]] const std::string& address() const { return address_; }

  // OK while the coordinator and at least one worker live. Errors: INTERNAL with the last lines of
  // the one that ended.
  [[nodiscard]] Status Check();

  // Sends SIGTERM to all, kills those that have not left after three seconds, and reaps them. A
  // coordinator with a state has a minute, to write its last checkpoint.
  void Stop();

 private:
  class Child;
  LocalCluster();

  std::string address_;
  bool has_state_ = false;
  std::unique_ptr<Child> coordinator_;
  std::vector<std::unique_ptr<Child>> workers_;
};

}  // namespace lucerna
