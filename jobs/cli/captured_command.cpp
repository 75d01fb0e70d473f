#include "jobs/cli/captured_command.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace baton {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kNotRun = 127;

/// What the child does between fork and exec: only calls that are safe there.
[[noreturn]] void become_captured(char* const* arguments, int out, int err) {
  ::setpgid(0, 0);  // Ctrl-C on the terminal is for the one who started it
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(err, STDERR_FILENO);
  ::execvp(arguments[0], arguments);
  ::_exit(kNotRun);
}

/// Reads both ends until they are closed; false when the time is up first.
bool read_all(std::array<pollfd, 2> ends, std::array<std::string, 2>& texts,
              Clock::time_point end) {
  while (ends[0].fd >= 0 || ends[1].fd >= 0) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
    if (left.count() <= 0) return false;
    if (::poll(ends.data(), ends.size(), static_cast<int>(left.count())) < 0 && errno != EINTR)
      return false;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if (ends[i].fd < 0 || ends[i].revents == 0) continue;
      std::array<char, 4096> buffer{};
      const ssize_t count = ::read(ends[i].fd, buffer.data(), buffer.size());
      if (count > 0) texts[i].append(buffer.data(), static_cast<std::size_t>(count));
      if (count == 0 || (count < 0 && errno != EINTR)) ends[i].fd = -1;
    }
  }
  return true;
}

std::string last_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

}  // namespace

Result<std::string> run_captured(const std::vector<std::string>& command,
                                 std::chrono::milliseconds patience) {
  std::vector<std::string> words = command;
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  std::array<int, 2> out{-1, -1}, err{-1, -1};
  if (::pipe2(out.data(), O_CLOEXEC) != 0 || ::pipe2(err.data(), O_CLOEXEC) != 0)
    return Error{ErrorKind::io, fmt::format("{}: {}", command[0], std::strerror(errno))};

  const Clock::time_point end = Clock::now() + patience;
  const pid_t pid = ::fork();
  if (pid == 0) become_captured(arguments.data(), out[1], err[1]);
  ::close(out[1]);
  ::close(err[1]);
  std::array<std::string, 2> texts;
  const bool in_time =
      pid > 0 && read_all({pollfd{out[0], POLLIN, 0}, pollfd{err[0], POLLIN, 0}}, texts, end);
  ::close(out[0]);
  ::close(err[0]);
  if (pid < 0) return Error{ErrorKind::io, fmt::format("{}: cannot start", command[0])};

  if (!in_time) ::kill(pid, SIGKILL);
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) continue;
  if (!in_time)
    return Error{ErrorKind::io,
                 fmt::format("{}: no answer within {} s", command[0], patience.count() / 1000)};
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return std::move(texts[0]);
  const bool is_there = !WIFEXITED(status) || WEXITSTATUS(status) != kNotRun;
  return Error{ErrorKind::io, is_there ? fmt::format("{}: {}", command[0], last_line(texts[1]))
                                       : fmt::format("{}: cannot be run", command[0])};
}

}  // namespace baton
