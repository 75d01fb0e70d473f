#pragma once

#include <CLI/CLI.hpp>

#include "common/base/exit_codes.h"

namespace baton {

/// `baton job requeue`.
void add_job_requeue(CLI::App& job, ExitCode& code);

}  // namespace baton
