#pragma once

#include <algorithm>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include "common/base/command_info.h"
#include "common/base/exit_codes.h"
#include "common/base/legible.h"

namespace baton {

/// A page for man(1), in roff: the program with all its commands, the variables of its environment
/// and the files that set them (settings.h).
std::string manual_page(const CommandInfo& program);

/// The shells that completion_script knows.
std::vector<std::string> completion_shells();
/// What completes the program's commands, options and choices in a shell, and names of files
/// elsewhere: to be sourced by bash; for zsh a file in its fpath, named _PROGRAM.
std::string completion_script(const CommandInfo& program, const std::string& shell);

/// To standard output.
void print_page(const std::string& page);

/// Adds --manual and --completion, which print these pages of the whole app and end the program by
/// throwing an Ended. Once everything else is added. App: CLI::App; Ended: CLI::Success.
template <class Ended, class App>
void add_page_options(App& app) {
  app.add_flag_callback(
      "--manual",
      [&app] {
        print_page(manual_page(describe_command(app)));
        throw Ended();
      },
      "print this program's page for man(1)");
  app.template add_option_function<std::string>(
         "--completion",
         [&app](const std::string& shell) {
           print_page(completion_script(describe_command(app), shell));
           throw Ended();
         },
         "print what completes this program's words in bash or zsh")
      ->check([](const std::string& shell) {
        const std::vector<std::string> known = completion_shells();
        const bool is_known = std::ranges::find(known, shell) != known.end();
        return std::string(is_known ? "" : "expected bash or zsh");
      });
}

/// Prints why the words of a command line are not taken, legibly, or the help that was asked for;
/// returns the exit code. App: CLI::App; Fault: CLI::ParseError.
template <class App, class Fault>
int end_parsing(const App& app, const Fault& fault) {
  std::ostringstream help, faults;
  const int code = app.exit(fault, help, faults);
  print_page(help.str());
  std::fputs(legible_text(faults.str()).c_str(), stderr);
  return static_cast<int>(code == 0 ? ExitCode::ok : ExitCode::usage);
}

}  // namespace baton
