#include "tests/support/on_terminal.h"

#include <pty.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "render/base/status.h"

namespace lucerna {

OnTerminal RunOnTerminal(std::vector<std::string> command) {
  std::vector<char*> arguments;
  for (std::string& argument : command)
    arguments.push_back(argument.data());
  arguments.push_back(nullptr);
  winsize size{};
  size.ws_col = 120;
  size.ws_row = 40;
  int terminal = -1;
  const pid_t pid = ::forkpty(&terminal, nullptr, nullptr, &size);
  LUCERNA_CHECK(pid >= 0);
  if (pid == 0) {
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  OnTerminal result;
  char bytes[4096];
  // An error is the end: the other side is closed.
  for (ssize_t got = 0; (got = ::read(terminal, bytes, sizeof(bytes))) > 0;)
    result.bytes.append(bytes, static_cast<std::size_t>(got));
  ::close(terminal);
  int status = 0;
  ::waitpid(pid, &status, 0);
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

}  // namespace lucerna
