#include "tests/support/process.h"

#include <atomic>
#include <thread>

#include "gtest/gtest.h"
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "render/base/files.h"
#include "render/base/status.h"

namespace lucerna {
namespace {

constexpr std::chrono::milliseconds kLook{5};

std::string ReadOrEmpty(const std::string& path) {
  const StatusOr<std::string> bytes = ReadFile(path);
  return bytes.ok() ? *bytes : std::string();
}

}  // namespace

ChildProcess::ChildProcess(std::vector<std::string> command) {
  static std::atomic<int> serial = 0;
  const std::string stem =
      absl::StrCat(testing::TempDir(), "lucerna-child-", getpid(), "-", serial++);
  output_path_ = stem + ".out";
  errors_path_ = stem + ".err";
  std::vector<char*> arguments;
  for (std::string& argument : command)
    arguments.push_back(argument.data());
  arguments.push_back(nullptr);
  pid_ = fork();
  LUCERNA_CHECK(pid_ >= 0);
  if (pid_ == 0) {
    const int output = open(output_path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const int errors = open(errors_path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    dup2(output, STDOUT_FILENO);
    dup2(errors, STDERR_FILENO);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
}

ChildProcess::~ChildProcess() {
  if (!exit_code_) {
    Signal(SIGKILL);
    WaitForExit(std::chrono::seconds(10));
  }
  unlink(output_path_.c_str());
  unlink(errors_path_.c_str());
}

void ChildProcess::Signal(int signal) const {
  kill(pid_, signal);
}

std::optional<int> ChildProcess::WaitForExit(std::chrono::milliseconds wait) {
  const auto until = std::chrono::steady_clock::now() + wait;
  while (!exit_code_) {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) == pid_) {
      exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    } else if (std::chrono::steady_clock::now() >= until) {
      return std::nullopt;
    } else {
      std::this_thread::sleep_for(kLook);
    }
  }
  return exit_code_;
}

std::string ChildProcess::Output() const {
  return ReadOrEmpty(output_path_);
}
std::string ChildProcess::Errors() const {
  return ReadOrEmpty(errors_path_);
}

bool ChildProcess::WaitForText(const std::string& text, std::chrono::milliseconds wait) {
  const auto until = std::chrono::steady_clock::now() + wait;
  while (Output().find(text) == std::string::npos && Errors().find(text) == std::string::npos) {
    if (std::chrono::steady_clock::now() >= until) return false;
    std::this_thread::sleep_for(kLook);
  }
  return true;
}

Finished RunProgram(std::vector<std::string> command, std::chrono::milliseconds wait) {
  ChildProcess child(std::move(command));
  const int exit_code = child.WaitForExit(wait).value_or(-1);
  return {exit_code, child.Output(), child.Errors()};
}

}  // namespace lucerna
