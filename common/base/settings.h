#pragma once

#include <string>
#include <vector>

#include "common/base/command_info.h"
#include "common/base/result.h"

namespace baton {

/// A variable of the environment that stands in for options, and where its value comes from.
struct Setting {
  std::string name;
  std::string value;  ///< empty: none
  /// "environment", "FILE:LINE"; empty: it is not set.
  std::string from;
  std::vector<std::string> options;  ///< "--key", with the commands that have it
};

/// Where a program looks for values of its variables, the strongest last: /etc/baton/PROGRAM.conf,
/// then baton/PROGRAM.conf in $XDG_CONFIG_HOME or ~/.config. With BATON_CONFIG_DIR in the
/// environment only in that folder; empty: nowhere.
std::vector<std::string> settings_files(const std::string& program);

/// Puts what the files say into the environment of this process, for variables that are not there
/// (an empty one is), and gives all that options of the program have, by name. Before the command
/// line is read, and before there are threads. Errors (bad_input) name file and line: no line
/// NAME=VALUE (blank ones and # comments pass; the value may be quoted), a name that is no variable
/// of the program, one twice, a control character; a file that others than root and this user may
/// write.
Result<std::vector<Setting>> take_settings(const CommandInfo& program);

/// For people: a line each.
std::string settings_text(const std::vector<Setting>& settings, const std::string& program);

}  // namespace baton
