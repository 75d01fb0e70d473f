#pragma once

#include <CLI/CLI.hpp>

#include "common/base/exit_codes.h"

namespace baton {

/// `baton farm status` and `stop`.
void add_status_commands(CLI::App& farm, ExitCode& code);

}  // namespace baton
