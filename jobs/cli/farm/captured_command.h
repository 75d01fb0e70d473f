#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace baton {

/// Runs a program of the PATH to its end and returns what it printed to stdout. Errors (io): it
/// cannot be run, ended otherwise than with exit code 0, in which case the last line of its stderr
/// is named, or took longer than `patience`, after which it was killed.
Result<std::string> run_captured(const std::vector<std::string>& command,
                                 std::chrono::milliseconds patience);

}  // namespace baton
