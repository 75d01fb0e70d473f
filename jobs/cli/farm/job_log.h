#pragma once

#include <CLI/CLI.hpp>

#include <string>

#include "common/base/exit_codes.h"

namespace baton {

/// `baton job log`.
void add_job_log(CLI::App& job, ExitCode& code);

/// --logs, for who reads the workers' logs or traces; folder: empty: as the coordinator has it.
void add_logs_option(CLI::App& command, std::string& folder);

}  // namespace baton
