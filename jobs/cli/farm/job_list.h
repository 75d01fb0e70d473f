#pragma once

#include <CLI/CLI.hpp>

#include "common/base/exit_codes.h"

namespace baton {

/// `baton job list`.
void add_list_command(CLI::App& job, ExitCode& code);

}  // namespace baton
