#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/file_descriptor.h"
#include "common/base/result.h"

namespace baton {

/// A file without a name, in memory, for what a program prints.
class MemoryFile {
 public:
  /// `name` goes first in the error.
  static Result<MemoryFile> open(const std::string& name);
  int number() const { return file_.number(); }
  /// All that was written so far.
  std::string text() const;
  /// The last line that is not empty.
  std::string last_line() const;

 private:
  explicit MemoryFile(FileDescriptor file) : file_(std::move(file)) {}

  FileDescriptor file_;
};

/// A program that this process started. It has a process group of its own, so that Ctrl-C on the
/// terminal reaches only this process, and the kernel kills it when this process dies, however that
/// happens. The destructor kills it.
class ChildProcess {
 public:
  /// command: the program's path, or its name where it is on the PATH, then its arguments. stdout
  /// and stderr are appended to `log`.
  static Result<ChildProcess> start(const std::vector<std::string>& command,
                                    const std::filesystem::path& log);
  /// The same with open files, which stay the caller's.
  struct Files {
    int output;
    std::optional<int> error = {};  ///< none: as output
    std::optional<int> input = {};  ///< none: this process's
  };
  static Result<ChildProcess> start(const std::vector<std::string>& command, const Files& files);

  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;
  ~ChildProcess();

  /// What ended() says of success, of a wrong command line (ExitCode::usage), and of a command that
  /// is no program.
  static constexpr const char *kSuccess = "exit code 0", *kWrongUsage = "exit code 64",
                              *kCannotBeRun = "exit code 127";

  pid_t pid() const { return pid_; }
  /// How it ended: "exit code 2" or "signal 9 (Killed)"; nullopt while it runs.
  std::optional<std::string> ended();
  /// Waits at most `patience` for the end; false when it still runs.
  bool wait_for_end(std::chrono::milliseconds patience);
  /// Sends a signal, unless it has ended.
  void send_signal(int signal_number);

 private:
  explicit ChildProcess(pid_t pid) : pid_(pid) {}
  void kill_now();

  pid_t pid_ = -1;  ///< -1: moved from
  std::optional<int> wait_status_;
};

/// The path of a program in the folder of the running one. Error: it is not there.
Result<std::string> sibling_program(const std::string& name);

}  // namespace baton
