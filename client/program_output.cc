#include "client/program_output.h"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace lucerna {
namespace {

constexpr std::size_t kMostBytes = std::size_t{64} << 20;

Status CannotRun(const std::string& program, int error) {
  return absl::NotFoundError(
      absl::StrCat("cannot run ", program, ": ", std::strerror(error),
                   "; install lucerna-server and lucerna-worker beside lucerna"));
}

}  // namespace

StatusOr<std::string> OutputOf(const std::string& program, std::vector<std::string> flags) {
  flags.insert(flags.begin(), program);
  std::vector<char*> argv;
  argv.reserve(flags.size() + 1);
  for (std::string& word : flags)
    argv.push_back(word.data());
  argv.push_back(nullptr);
  int pipe_ends[2];
  if (::pipe2(pipe_ends, O_CLOEXEC) != 0) return CannotRun(program, errno);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, pipe_ends[1], STDOUT_FILENO);
  pid_t pid = 0;
  const int error = posix_spawn(&pid, program.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(pipe_ends[1]);
  std::string output;
  bool is_too_long = false;
  char bytes[4096];
  while (error == 0 && !is_too_long) {
    const ssize_t got = ::read(pipe_ends[0], bytes, sizeof(bytes));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    output.append(bytes, static_cast<std::size_t>(got));
    is_too_long = output.size() > kMostBytes;
  }
  // A program that goes on writing is ended by it.
  ::close(pipe_ends[0]);
  if (error != 0) return CannotRun(program, error);
  int wait_status = 0;
  while (::waitpid(pid, &wait_status, 0) < 0 && errno == EINTR) {
  }
  if (is_too_long || !WIFEXITED(wait_status) || WEXITSTATUS(wait_status) != 0) {
    return absl::InternalError(absl::StrCat(program, " failed; what it said is above"));
  }
  return output;
}

}  // namespace lucerna
