#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

namespace baton {

/// An option or a positional of a command line, as people are told of it.
struct OptionInfo {
  /// "--frames", "-l"; of a positional its name.
  std::vector<std::string> names;
  bool is_positional = false;
  /// What it takes: "TEXT", "INT"; empty: nothing.
  std::string value;
  std::string about;
  /// The default where it is shown; empty: none.
  std::string preset;
  std::string variable;              ///< of the environment; empty: none
  std::vector<std::string> choices;  ///< empty: any value
  bool is_required = false;

  bool operator==(const OptionInfo&) const = default;
};

/// A program or one of its commands.
struct CommandInfo {
  std::string name;  ///< with those before it: "baton job list"
  std::string about, footer;
  std::vector<OptionInfo> options;
  std::vector<CommandInfo> commands;
};

/// The variables of the environment that stand in for options, each with the commands and options
/// that it stands in for: "baton job list --key".
inline void add_variables(const CommandInfo& command,
                          std::map<std::string, std::vector<std::string>>& variables) {
  for (const OptionInfo& option : command.options) {
    if (!option.variable.empty())
      variables[option.variable].push_back(command.name + " " + option.names.back());
  }
  for (const CommandInfo& each : command.commands) add_variables(each, variables);
}

/// "TEXT:{a,b}" has choices.
inline std::vector<std::string> choices_in(const std::string& type) {
  std::vector<std::string> choices;
  const std::size_t from = type.find(":{"), to = type.rfind('}');
  if (from == std::string::npos || to == std::string::npos) return choices;
  std::string rest = type.substr(from + 2, to - from - 2);
  for (std::size_t comma = 0; comma != std::string::npos; rest.erase(0, comma + 1)) {
    comma = rest.find(',');
    choices.push_back(rest.substr(0, comma));
    if (comma == std::string::npos) break;
  }
  return choices;
}

/// The command line of a program that CLI11 reads. App: CLI::App.
template <class App>
CommandInfo describe_command(const App& app, const std::string& before = {}) {
  CommandInfo info;
  info.name = before + (before.empty() ? "" : " ") + app.get_name();
  info.about = app.get_description();
  info.footer = app.get_footer();
  for (const auto* const option : app.get_options()) {
    OptionInfo& told = info.options.emplace_back();
    for (const std::string& name : option->get_snames()) told.names.push_back("-" + name);
    for (const std::string& name : option->get_lnames()) told.names.push_back("--" + name);
    told.is_positional = option->get_positional();
    if (told.names.empty()) told.names.push_back(option->get_name());
    const std::string type = option->get_type_name();
    if (option->get_items_expected_max() > 0) told.value = type.substr(0, type.find(':'));
    told.about = option->get_description();
    told.preset = option->get_default_str();
    told.variable = option->get_envname();
    told.choices = choices_in(type);
    told.is_required = option->get_required();
  }
  for (const App* const command : app.get_subcommands([](const App*) { return true; }))
    info.commands.push_back(describe_command(*command, info.name));
  return info;
}

}  // namespace baton
