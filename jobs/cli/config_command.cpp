#include <fmt/format.h>

#include <memory>

#include "common/base/settings.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/json_text.h"
#include "jobs/cli/say.h"

namespace baton {
namespace {

/// As it was taken when the program began: a variable that a file has set is in the environment
/// since.
void print_settings(const std::vector<Setting>& settings, bool json) {
  if (!json) {
    say("{}", settings_text(settings, "baton"));
    return;
  }
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Setting& setting : settings)
    list.push_back({{"name", setting.name},
                    {"value", setting.value},
                    {"from", setting.from},
                    {"options", setting.options}});
  fmt::print("{}\n", json_text({{"settings", list}, {"files", settings_files("baton")}}, 2));
}

}  // namespace

void add_config_command(CLI::App& app, const std::vector<Setting>& settings) {
  auto json = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand(
      "config", "What stands in for options that are not typed, and where it comes from");
  command->add_flag("--json", *json, "for machines");
  command->footer(
      "What is typed goes before the environment, and that before the files.\n"
      "A file has lines NAME=VALUE; baton-worker and baton-coordinator have files of their own:\n"
      "see their --manual.\n"
      "\n"
      "Examples:\n"
      "  echo BATON_COORDINATOR=tcp://farm:5570 >> ~/.config/baton/baton.conf\n"
      "  baton config");
  command->callback([json, &settings] { print_settings(settings, *json); });
}

}  // namespace baton
