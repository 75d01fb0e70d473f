#pragma once

#include <string>

namespace baton {

/// Before the words of a command line are read: variables of the environment stand in for options
/// of the command that is called alone, and not for what a typed option rules out (--insecure: a
/// key). CLI11 reads those of all commands. App: CLI::App.
template <class App>
void limit_environment(App& app, int argc, char** argv) {
  App* called = &app;
  bool is_insecure = false;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    // Pages are of all commands, with their variables.
    if (word == "--manual" || word.starts_with("--completion")) return;
    is_insecure = is_insecure || word == "--insecure";
    for (App* const command : called->get_subcommands({})) {
      if (command->check_name(word)) {
        called = command;
        break;
      }
    }
  }
  const auto is_on_the_way = [&](const App* command) {
    for (const App* at = called; at != nullptr; at = at->get_parent())
      if (at == command) return true;
    return false;
  };
  const auto limit = [&](App& command, const auto& again) -> void {
    for (auto* const option : command.get_options()) {
      if (!is_on_the_way(&command) || (is_insecure && option->check_lname("key")))
        option->envname("");
    }
    for (App* const each : command.get_subcommands({})) again(*each, again);
  };
  limit(app, limit);
}

}  // namespace baton
