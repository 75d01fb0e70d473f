#include "jobs/cli/farm/captured_command.h"

#include <fmt/format.h>
#include <signal.h>

#include "jobs/cli/child_process.h"

namespace baton {

Result<std::string> run_captured(const std::vector<std::string>& command,
                                 std::chrono::milliseconds patience) {
  const auto fail = [&](const std::string& what) {
    return Error{ErrorKind::io, fmt::format("{}: {}", command[0], what)};
  };
  BATON_ASSIGN(const MemoryFile out, MemoryFile::open(command[0]));
  BATON_ASSIGN(const MemoryFile err, MemoryFile::open(command[0]));
  BATON_ASSIGN(ChildProcess program,
               ChildProcess::start(command, {.output = out.number(), .error = err.number()}));
  if (!program.wait_for_end(patience)) {
    program.send_signal(SIGKILL);
    return fail(fmt::format("no answer within {} s", patience.count() / 1000));
  }
  const std::string end = program.ended().value_or("");
  if (end == ChildProcess::kSuccess) return out.text();
  return fail(end == ChildProcess::kCannotBeRun ? "cannot be run" : err.last_line());
}

}  // namespace baton
