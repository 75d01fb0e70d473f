#pragma once

#include <CLI/CLI.hpp>

#include "common/base/exit_codes.h"

namespace baton {

/// `baton job log`.
void add_job_log(CLI::App& job, ExitCode& code);

}  // namespace baton
