#include "client/local_cluster.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <deque>
#include <filesystem>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "client/exit_code.h"
#include "client/interruption.h"
#include "render/base/clock.h"
#include "render/base/mutex.h"

namespace lucerna {
namespace {

constexpr Duration kStartTime = std::chrono::seconds(20);
constexpr Duration kTimeToLeave = std::chrono::seconds(3);
constexpr Duration kTimeToKeep = std::chrono::minutes(1);
constexpr std::chrono::milliseconds kPollEvery{10};
constexpr std::size_t kKeptLines = 10;
constexpr std::size_t kMaxLineBytes = 1000;
constexpr char kListening[] = "listening on ";
// Of the GNU C library: memory comes in huge pages where the kernel has them on request, which
// saves page faults and misses of the TLB (docs/decisions/huge-pages.md).
constexpr char kTunables[] = "GLIBC_TUNABLES=";
constexpr char kHugePages[] = "glibc.malloc.hugetlb=1";

// This process's variables, and huge pages unless the user has tunables of their own.
std::vector<std::string> ChildEnvironment() {
  std::vector<std::string> variables;
  for (char** variable = ::environ; *variable != nullptr; ++variable)
    variables.emplace_back(*variable);
  if (std::ranges::none_of(
          variables, [](const std::string& variable) { return variable.starts_with(kTunables); })) {
    variables.push_back(absl::StrCat(kTunables, kHugePages));
  }
  return variables;
}

// What exec takes; it ends with a null and points into `words`.
std::vector<char*> Pointers(std::vector<std::string>& words) {
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (std::string& word : words)
    pointers.push_back(word.data());
  pointers.push_back(nullptr);
  return pointers;
}

std::string HowItEnded(int wait_status) {
  if (WIFSIGNALED(wait_status)) {
    return absl::StrCat("was ended by signal ", WTERMSIG(wait_status), " (",
                        strsignal(WTERMSIG(wait_status)), ")");
  }
  return absl::StrCat("ended by itself with code ", WEXITSTATUS(wait_status));
}

}  // namespace

// One child process and what it says.
class LocalCluster::Child {
 public:
  static StatusOr<std::unique_ptr<Child>> Start(std::string name, const std::string& program,
                                                const std::vector<std::string>& flags) {
    if (::access(program.c_str(), X_OK) != 0) {
      return absl::NotFoundError(absl::StrCat(
          program, ": cannot run it; install lucerna-server and lucerna-worker beside lucerna"));
    }
    int pipe_ends[2];
    if (::pipe2(pipe_ends, O_CLOEXEC) != 0) {
      return absl::ResourceExhaustedError(
          absl::StrCat("cannot start ", program, ": ", std::strerror(errno)));
    }
    // All that exec takes is made before the fork; after it, only calls that are safe there.
    std::vector<std::string> words = {program};
    words.insert(words.end(), flags.begin(), flags.end());
    std::vector<std::string> variables = ChildEnvironment();
    const std::vector<char*> argv = Pointers(words);
    const std::vector<char*> environment = Pointers(variables);
    const pid_t parent = ::getpid();
    const pid_t pid = ::fork();
    if (pid == 0) Become(argv, environment, pipe_ends[1], parent);
    ::close(pipe_ends[1]);
    if (pid < 0) {
      ::close(pipe_ends[0]);
      return absl::ResourceExhaustedError(
          absl::StrCat("cannot start ", program, ": ", std::strerror(errno)));
    }
    return std::unique_ptr<Child>(new Child(std::move(name), pid, pipe_ends[0]));
  }

  ~Child() {
    Signal(SIGKILL);
    WaitUntil(std::nullopt);
    reader_.join();
    ::close(output_);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  // OK while it lives.
  [[nodiscard]] Status Check() {
    if (!HasEnded()) return absl::OkStatus();
    std::string message = absl::StrCat("the ", name_, " ", HowItEnded(wait_status_));
    // Its last words may still be on their way through the pipe.
    for (int i = 0; i < 20 && !IsSilent(); ++i)
      std::this_thread::sleep_for(kPollEvery);
    const MutexLock lock(mutex_);
    absl::StrAppend(&message, last_lines_.empty() ? " and said nothing" : "; its last lines:");
    for (const std::string& line : last_lines_)
      absl::StrAppend(&message, "\n  ", line);
    return absl::InternalError(message);
  }

  [[nodiscard]] bool HasEnded() {
    if (!has_ended_ && ::waitpid(pid_, &wait_status_, WNOHANG) == pid_) has_ended_ = true;
    return has_ended_;
  }

  // What follows `prefix` in the first line that begins with it; nothing if there is none yet.
  [[nodiscard]] std::optional<std::string> Announcement() {
    const MutexLock lock(mutex_);
    return announcement_;
  }

  void Signal(int number) {
    // A reaped child's number may belong to somebody else by now.
    if (!HasEnded()) ::kill(pid_, number);
  }

  // Waits until it has ended or until `deadline`, whichever is first.
  void WaitUntil(std::optional<SteadyTime> deadline) {
    while (!HasEnded() && (!deadline || SystemClock().Steady() < *deadline)) {
      std::this_thread::sleep_for(kPollEvery);
    }
  }

 private:
  Child(std::string name, pid_t pid, int output)
      : name_(std::move(name)), pid_(pid), output_(output), reader_([this] { ReadLines(); }) {}

  // The new process, between fork and exec.
  [[noreturn]] static void Become(const std::vector<char*>& argv,
                                  const std::vector<char*>& environment, int output, pid_t parent) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    // The parent may have gone before the line above.
    if (::getppid() != parent) ::_exit(1);
    // Ctrl-C in the terminal is for the client to answer; it ends its children in order.
    ::setpgid(0, 0);
    const int nothing = ::open("/dev/null", O_RDONLY);
    if (nothing >= 0) ::dup2(nothing, STDIN_FILENO);
    ::dup2(output, STDOUT_FILENO);
    ::dup2(output, STDERR_FILENO);
    ::execve(argv[0], argv.data(), environment.data());
    constexpr char kMessage[] = "the program could not be executed\n";
    const ssize_t written = ::write(STDERR_FILENO, kMessage, sizeof(kMessage) - 1);
    ::_exit(written < 0 ? 126 : 127);
  }

  // Reads until the child has closed its end, so that it never waits for a full pipe.
  void ReadLines() {
    std::string line;
    char bytes[4096];
    for (;;) {
      const ssize_t got = ::read(output_, bytes, sizeof(bytes));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) break;
      for (const char c : std::string_view(bytes, static_cast<std::size_t>(got))) {
        if (c == '\n') {
          Keep(std::exchange(line, {}));
        } else if (line.size() < kMaxLineBytes) {
          line.push_back(c);
        }
      }
    }
    if (!line.empty()) Keep(std::move(line));
    const MutexLock lock(mutex_);
    is_silent_ = true;
  }

  void Keep(std::string line) {
    const MutexLock lock(mutex_);
    if (!announcement_ && line.starts_with(kListening)) {
      announcement_ = line.substr(sizeof(kListening) - 1);
    }
    last_lines_.push_back(std::move(line));
    if (last_lines_.size() > kKeptLines) last_lines_.pop_front();
  }

  [[nodiscard]] bool IsSilent() {
    const MutexLock lock(mutex_);
    return is_silent_;
  }

  const std::string name_;
  const pid_t pid_;
  const int output_;
  bool has_ended_ = false;
  int wait_status_ = 0;
  Mutex mutex_;
  std::deque<std::string> last_lines_ LUCERNA_GUARDED_BY(mutex_);
  std::optional<std::string> announcement_ LUCERNA_GUARDED_BY(mutex_);
  bool is_silent_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::thread reader_;  // last: it uses all of the above
};

StatusOr<std::string> ProgramFolder() {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) {
    return absl::NotFoundError(
        absl::StrCat("cannot find the folder of this program: ", error.message()));
  }
  return program.parent_path().string();
}

LocalCluster::LocalCluster() = default;

LocalCluster::~LocalCluster() {
  Stop();
}

StatusOr<std::unique_ptr<LocalCluster>> LocalCluster::Start(const ClusterOptions& options) {
  LUCERNA_CHECK(options.workers >= 1);
  auto cluster = std::unique_ptr<LocalCluster>(new LocalCluster());
  std::vector<std::string> flags = {"--listen", "127.0.0.1:0"};
  if (!options.state_folder.empty()) {
    flags.insert(flags.end(), {"--state", options.state_folder});
    cluster->has_state_ = true;
  }
  LUCERNA_ASSIGN_OR_RETURN(
      cluster->coordinator_,
      Child::Start("coordinator", options.program_folder + "/lucerna-server", flags));
  const SteadyTime give_up = SystemClock().Steady() + kStartTime;
  for (;;) {
    if (const auto address = cluster->coordinator_->Announcement()) {
      cluster->address_ = *address;
      break;
    }
    LUCERNA_RETURN_IF_ERROR(cluster->coordinator_->Check());
    if (IsInterrupted()) return Failure(ExitCode::kInterrupted, "interrupted");
    if (SystemClock().Steady() > give_up) {
      return absl::InternalError("the coordinator did not begin to listen within 20 seconds");
    }
    SleepUnlessInterrupted(kPollEvery);
  }

  int threads = options.threads;
  if (threads == 0 && options.workers > 1) {
    const int machine = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    threads = std::max(1, machine / options.workers);
  }
  for (int i = 0; i < options.workers; ++i) {
    LUCERNA_ASSIGN_OR_RETURN(
        auto worker,
        Child::Start(options.workers == 1 ? "worker" : absl::StrCat("worker ", i + 1),
                     options.program_folder + "/lucerna-worker",
                     {"--server", cluster->address_, "--threads", std::to_string(threads)}));
    cluster->workers_.push_back(std::move(worker));
  }
  return cluster;
}

Status LocalCluster::Check() {
  LUCERNA_RETURN_IF_ERROR(coordinator_->Check());
  const bool one_lives =
      std::ranges::any_of(workers_, [](const auto& worker) { return !worker->HasEnded(); });
  if (one_lives) return absl::OkStatus();
  return absl::InternalError(
      absl::StrCat("no worker is left to render: ", workers_.back()->Check().message()));
}

void LocalCluster::Stop() {
  // Workers first: they hand back their leases to a coordinator that is still there.
  for (const auto& worker : workers_)
    worker->Signal(SIGTERM);
  SteadyTime deadline = SystemClock().Steady() + kTimeToLeave;
  for (const auto& worker : workers_)
    worker->WaitUntil(deadline);
  workers_.clear();
  if (coordinator_ == nullptr) return;
  coordinator_->Signal(SIGTERM);
  deadline = SystemClock().Steady() + (has_state_ ? kTimeToKeep : kTimeToLeave);
  coordinator_->WaitUntil(deadline);
  coordinator_.reset();
}

}  // namespace lucerna
