// How does a test start a real program, talk with it and end it?
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

namespace lucerna {

// A child process whose stdout and stderr go to files of its own. One that still lives when it is
// destroyed is killed.
class ChildProcess {
 public:
  explicit ChildProcess(std::vector<std::string> command);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  void Signal(int signal) const;
  // The exit code, or 128 + the signal that ended it; absent when it lives on after `wait`.
  std::optional<int> WaitForExit(std::chrono::milliseconds wait);
  [[nodiscard]] std::string Output() const;
  [[nodiscard]] std::string Errors() const;
  // Waits until `text` stands in the child's stdout or stderr. False after `wait`.
  [[nodiscard]] bool WaitForText(const std::string& text, std::chrono::milliseconds wait);

 private:
  pid_t pid_ = -1;
  std::optional<int> exit_code_;
  std::string output_path_, errors_path_;
};

// One that is run to its end.
struct Finished {
  int exit_code = -1;  // -1: did not end within the time
  std::string output, errors;
};
[[nodiscard]] Finished RunProgram(std::vector<std::string> command,
                                  std::chrono::milliseconds wait = std::chrono::seconds(60));

}  // namespace lucerna
