#pragma once

#include <CLI/CLI.hpp>

#include "common/base/exit_codes.h"
#include "common/base/settings.h"

namespace baton {

/// Each adds one subcommand to the command line. When it was given, parsing runs it and leaves in
/// `code` how it ended; errors have then been printed to stderr.
void add_chart_command(CLI::App& app, ExitCode& code);
void add_check_command(CLI::App& app, ExitCode& code);
void add_compare_command(CLI::App& app, ExitCode& code);
void add_farm_command(CLI::App& app, ExitCode& code);
void add_job_command(CLI::App& app, ExitCode& code);
void add_key_command(CLI::App& app, ExitCode& code);
void add_movie_command(CLI::App& app, ExitCode& code);
void add_render_command(CLI::App& app, ExitCode& code);
void add_state_command(CLI::App& app, ExitCode& code);
void add_top_command(CLI::App& app, ExitCode& code);
void add_trace_command(CLI::App& app, ExitCode& code);
void add_view_command(CLI::App& app, ExitCode& code);
void add_worker_command(CLI::App& app, ExitCode& code);

/// settings: what take_settings() will have given when the command runs.
void add_config_command(CLI::App& app, const std::vector<Setting>& settings);

/// Prints the error of a command, if it has one, and gives its exit code.
ExitCode finish(const Result<ExitCode>& outcome);

}  // namespace baton
