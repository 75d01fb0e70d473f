#pragma once

#include <CLI/CLI.hpp>

#include "common/base/exit_codes.h"

namespace baton {

/// Adds `baton farm events`.
void add_events_command(CLI::App& farm, ExitCode& code);

}  // namespace baton
