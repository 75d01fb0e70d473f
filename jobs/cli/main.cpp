#include <fmt/format.h>

#include <cstdio>

#include "common/base/log.h"
#include "common/base/version.h"
#include "jobs/cli/commands.h"

namespace baton {

ExitCode finish(const Result<ExitCode>& outcome) {
  if (outcome) return *outcome;
  fmt::print(stderr, "{}\n", outcome.error().message);
  return exit_code_of(outcome.error().kind);
}

}  // namespace baton

namespace {

constexpr const char* kFooter = R"(Examples:
  baton check job.json --explain     what the job says, and what it will take
  baton render job.json              renders on this machine; again: goes on where it stopped
  baton job submit job.json          hands the job to a coordinator (see --coordinator)
  baton job list
  baton worker list
  baton chart study.json             error against time of several methods, as charts
  baton state show STATE.blob        what samples a tile hands to its next frame

Exit codes: 0 ok, 1 timeout, 2 failed, 3 cancelled, 64 wrong command line, 65 bad input,
69 no coordinator answers, 70 a bug, 74 disk or network.)";

}  // namespace

int main(int argc, char** argv) {
  baton::init_logging("baton");
  CLI::App app("Renders animations lit by changing HDR environments.", "baton");
  app.set_version_flag("--version", std::string("baton ") + baton::kVersion);
  app.require_subcommand(1);
  app.footer(kFooter);

  auto code = baton::ExitCode::ok;
  baton::add_check_command(app, code);
  baton::add_render_command(app, code);
  baton::add_job_command(app, code);
  baton::add_worker_command(app, code);
  baton::add_state_command(app, code);
  baton::add_chart_command(app, code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return static_cast<int>(app.exit(error) == 0 ? baton::ExitCode::ok : baton::ExitCode::usage);
  }
  return static_cast<int>(code);
}
