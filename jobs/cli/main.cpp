#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "common/base/build.h"
#include "common/base/command_pages.h"
#include "common/base/log.h"
#include "common/base/option_environment.h"
#include "common/base/option_values.h"
#include "common/base/settings.h"
#include "common/base/suggest.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/say.h"

namespace baton {

ExitCode finish(const Result<ExitCode>& outcome) {
  if (outcome) return *outcome;
  tell("{}\n", outcome.error().message);
  return exit_code_of(outcome.error().kind);
}

}  // namespace baton

namespace {

constexpr const char* kFooter = R"(Examples:
  baton check job.json --explain     what the job says, and what it will take
  baton render job.json              renders on this machine; again: goes on where it stopped
  baton render job.json --frames 12 --scale .25 --out look.png
  baton view frame.0012.exr --aov depth
  baton movie job.json               the sequence as it looks: preview.mp4, or PNGs
  baton job submit job.json          hands the job to a coordinator (see --coordinator)
  baton job list
  baton job why shot7                why it is not done
  baton worker list
  baton top                          jobs and workers of the farm, shown anew
  baton farm slurm job.json --nodes 1-8 --time 2:00:00
  baton config                       what the environment and files say of options
  baton key create keys              keys for a farm of several machines
  baton chart study.json             error against time of several methods, as charts
  baton compare a.json b.json        two ways to render the same frames, side by side
  baton trace shot.json              where a rendering's time went (baton render --trace)
  baton state show STATE.blob        what samples a tile hands to its next frame

Exit codes: 0 ok, 1 timeout, 2 failed, 3 cancelled, 64 wrong command line, 65 bad input,
69 no coordinator answers, 70 a bug, 74 disk or network.)";

/// The first word that should be a command and is none, with what is near it; empty: there is none.
std::string unknown_command(const CLI::App& app, int argc, char** argv) {
  const CLI::App* group = &app;
  for (int i = 1; i < argc; ++i) {
    std::vector<std::string> names;
    for (const CLI::App* command : group->get_subcommands({})) names.push_back(command->get_name());
    const std::string word = argv[i];
    if (names.empty() || word.starts_with('-')) return {};
    const auto found = std::find(names.begin(), names.end(), word);
    if (found == names.end())
      return fmt::format("{} {}: no such command{}", group->get_name(), word,
                         baton::suggestion(word, names));
    group = group->get_subcommand(word);
  }
  return {};
}

/// The first option that the command of these words does not have, with what is near it; empty:
/// there is none.
std::string unknown_option(const CLI::App& app, int argc, char** argv) {
  const CLI::App* command = &app;
  const auto has_command = [&](const std::string& word) {
    const auto commands = command->get_subcommands({});
    return std::ranges::any_of(commands, [&](const CLI::App* c) { return c->get_name() == word; });
  };
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (has_command(word)) {
      command = command->get_subcommand(word);
      continue;
    }
    if (word == "--") return {};
    if (!word.starts_with("--")) continue;
    std::vector<std::string> names;
    for (const CLI::Option* option : command->get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
    const std::string name = word.substr(0, word.find('='));
    if (std::ranges::find(names, name) == names.end())
      return fmt::format("{}: no option {}{}", command->get_name(), name,
                         baton::suggestion(name, names));
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Renders animations lit by changing HDR environments.", "baton");
  app.set_version_flag("--version", baton::build_identity());
  app.require_subcommand(1);
  app.footer(kFooter);

  app.parse_complete_callback([&app] {
    if (const std::string fault = baton::value_fault(app); !fault.empty())
      throw CLI::ValidationError(fault);
  });
  auto code = baton::ExitCode::ok;
  baton::add_check_command(app, code);
  baton::add_render_command(app, code);
  baton::add_job_command(app, code);
  baton::add_worker_command(app, code);
  baton::add_top_command(app, code);
  baton::add_farm_command(app, code);
  baton::add_key_command(app, code);
  baton::add_state_command(app, code);
  baton::add_chart_command(app, code);
  baton::add_compare_command(app, code);
  baton::add_trace_command(app, code);
  baton::add_view_command(app, code);
  baton::add_movie_command(app, code);
  std::vector<baton::Setting> settings;
  baton::add_config_command(app, settings);
  baton::add_page_options<CLI::Success>(app);
  if (auto taken = baton::take_settings(baton::describe_command(app))) {
    settings = std::move(*taken);
  } else {
    return static_cast<int>(baton::finish(taken.error()));
  }
  baton::init_logging("baton");
  for (const auto& look : {unknown_command, unknown_option}) {
    if (const std::string fault = look(app, argc, argv); !fault.empty()) {
      baton::tell("{}\n", fault);
      return static_cast<int>(baton::ExitCode::usage);
    }
  }
  try {
    baton::limit_environment(app, argc, argv);
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return baton::end_parsing(app, error);
  }
  return static_cast<int>(code);
}
