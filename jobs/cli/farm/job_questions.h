#pragma once

#include <CLI/CLI.hpp>

#include "common/base/exit_codes.h"

namespace baton {

/// `baton job why`, `tasks` and `set`.
void add_job_questions(CLI::App& job, ExitCode& code);
/// `baton worker why`.
void add_worker_questions(CLI::App& worker, ExitCode& code);

}  // namespace baton
