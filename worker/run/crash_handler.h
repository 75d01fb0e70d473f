#pragma once

#include <string_view>

namespace baton {

/// From now on a crash (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT) first prints every living
/// CrashNote to stderr.
void install_crash_handler();

/// A line that a crash prints while the note lives: what the thread was doing and the command that
/// repeats it. Text past 500 bytes is cut; with more than 256 notes at once the newest print
/// nothing.
class CrashNote {
 public:
  explicit CrashNote(std::string_view text);
  ~CrashNote();
  CrashNote(const CrashNote&) = delete;
  CrashNote& operator=(const CrashNote&) = delete;

 private:
  int slot_ = -1;
};

}  // namespace baton
