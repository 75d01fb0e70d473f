#include "jobs/cli/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <thread>
#include <utility>

namespace baton {
namespace {

namespace fs = std::filesystem;

constexpr int kCannotRun = 127;

/// What the child does between fork and exec: only calls that are safe there.
[[noreturn]] void become_program(char* const* arguments, const ChildProcess::Files& files,
                                 pid_t parent) {
  // Die with the parent, also when it died before this line.
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(kCannotRun);

  ::setpgid(0, 0);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::dup2(files.input.value_or(STDIN_FILENO), STDIN_FILENO);
  ::dup2(files.output, STDOUT_FILENO);
  ::dup2(files.error.value_or(files.output), STDERR_FILENO);
  ::execvp(arguments[0], arguments);
  ::_exit(kCannotRun);
}

}  // namespace

Result<MemoryFile> MemoryFile::open(const std::string& name) {
  FileDescriptor file(::memfd_create("printed", MFD_CLOEXEC));
  if (!file) return Error{ErrorKind::io, fmt::format("{}: {}", name, std::strerror(errno))};
  return MemoryFile(std::move(file));
}

std::string MemoryFile::text() const {
  std::string text(static_cast<std::size_t>(std::max<off_t>(0, ::lseek(number(), 0, SEEK_END))),
                   '\0');
  const ssize_t count = ::pread(number(), text.data(), text.size(), 0);
  text.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
  return text;
}

std::string MemoryFile::last_line() const {
  std::string line = text();
  while (line.ends_with('\n')) line.pop_back();
  return line.substr(line.rfind('\n') + 1);
}

Result<ChildProcess> ChildProcess::start(const std::vector<std::string>& command,
                                         const fs::path& log) {
  // A named pipe must not make us wait.
  const FileDescriptor file(::open(
      log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK, 0600));
  if (!file)
    return Error{ErrorKind::io,
                 fmt::format("{}: cannot open: {}", log.string(), std::strerror(errno))};
  return start(command, {.output = file.number()});
}

Result<ChildProcess> ChildProcess::start(const std::vector<std::string>& command,
                                         const Files& files) {
  // Everything that needs memory comes before fork.
  std::vector<std::string> words = command;
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid == 0) become_program(arguments.data(), files, parent);
  if (pid < 0)
    return Error{ErrorKind::io,
                 fmt::format("{}: cannot start: {}", command[0], std::strerror(errno))};
  return ChildProcess(pid);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), wait_status_(other.wait_status_) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  if (this != &other) {
    kill_now();
    pid_ = std::exchange(other.pid_, -1);
    wait_status_ = other.wait_status_;
  }
  return *this;
}

ChildProcess::~ChildProcess() { kill_now(); }

std::optional<std::string> ChildProcess::ended() {
  int status = 0;
  if (!wait_status_ && ::waitpid(pid_, &status, WNOHANG) == pid_) wait_status_ = status;
  if (!wait_status_) return std::nullopt;
  if (WIFSIGNALED(*wait_status_)) {
    return fmt::format("signal {} ({})", WTERMSIG(*wait_status_),
                       ::strsignal(WTERMSIG(*wait_status_)));
  }
  return fmt::format("exit code {}", WEXITSTATUS(*wait_status_));
}

bool ChildProcess::wait_for_end(std::chrono::milliseconds patience) {
  constexpr std::chrono::milliseconds kStep{10};
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (!ended()) {
    if (std::chrono::steady_clock::now() >= deadline) return false;
    std::this_thread::sleep_for(kStep);
  }
  return true;
}

void ChildProcess::send_signal(int signal_number) {
  if (!ended()) ::kill(pid_, signal_number);
}

void ChildProcess::kill_now() {
  if (pid_ < 0 || ended()) return;
  ::kill(pid_, SIGKILL);
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) continue;
}

Result<std::string> sibling_program(const std::string& name) {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  const fs::path program = self.parent_path() / name;
  if (error || ::access(program.c_str(), X_OK) != 0) {
    return Error{ErrorKind::io,
                 fmt::format("{}: expected a program beside {}", program.string(), self.string())};
  }
  return program.string();
}

}  // namespace baton
