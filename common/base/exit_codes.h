#pragma once

#include "common/base/result.h"

namespace baton {

/// The one table of exit codes, for every program.
enum class ExitCode : int {
  ok = 0,
  timeout = 1,
  failed = 2,  ///< the job or the operation failed
  cancelled = 3,
  usage = 64,        ///< the command line is wrong
  bad_input = 65,    ///< a job, scene, image or state is wrong
  unavailable = 69,  ///< no coordinator answers
  internal = 70,
  io = 74,
};

constexpr ExitCode exit_code_of(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::usage:
      return ExitCode::usage;
    case ErrorKind::bad_input:
    case ErrorKind::corrupt:
    case ErrorKind::version:
      return ExitCode::bad_input;
    case ErrorKind::io:
    case ErrorKind::no_space:
      return ExitCode::io;
    case ErrorKind::timeout:
      return ExitCode::timeout;
    case ErrorKind::cancelled:
      return ExitCode::cancelled;
    case ErrorKind::internal:
      return ExitCode::internal;
  }
  return ExitCode::internal;
}

}  // namespace baton
