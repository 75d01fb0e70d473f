#pragma once

#include <CLI/CLI.hpp>

#include "common/base/exit_codes.h"

namespace baton {

/// `baton job trace`.
void add_job_trace(CLI::App& job, ExitCode& code);

}  // namespace baton
