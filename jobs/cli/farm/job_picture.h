#pragma once

#include <CLI/CLI.hpp>

#include "common/base/exit_codes.h"

namespace baton {

/// `baton job picture`.
void add_job_picture(CLI::App& job, ExitCode& code);

}  // namespace baton
