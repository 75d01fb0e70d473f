#include "common/base/command_pages.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <functional>
#include <map>

namespace baton {
namespace {

// ---- manual -------------------------------------------------------------------------------------

/// Text that roff takes as it is: no escapes, no line that begins with a request.
std::string roff(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    const bool is_first = safe.empty() || safe.back() == '\n';
    if (is_first && (c == '.' || c == '\'')) safe += "\\&";
    if (c == '\\') {
      safe += "\\e";
    } else if (c == '-') {
      safe += "\\-";
    } else {
      safe += c;
    }
  }
  return safe;
}

std::string option_text(const OptionInfo& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.names) names.push_back("\\fB" + roff(name) + "\\fR");
  std::string text = fmt::format(".TP\n{}", fmt::join(names, ", "));
  if (!option.choices.empty()) {
    text += fmt::format(" {}", roff(fmt::format("{}", fmt::join(option.choices, "|"))));
  } else if (!option.value.empty()) {
    text += " \\fI" + roff(option.value) + "\\fR";
  }
  text += "\n" + roff(option.about);
  if (!option.preset.empty()) text += roff("; default: " + option.preset);
  if (!option.variable.empty()) text += roff("; environment: " + option.variable);
  return text + (option.is_required ? "; required\n" : "\n");
}

void add_command(const CommandInfo& command, std::string& page) {
  page += fmt::format(".SS {}\n{}\n", roff(command.name), roff(command.about));
  for (const OptionInfo& option : command.options) page += option_text(option);
  if (!command.footer.empty()) page += fmt::format(".PP\n.nf\n{}\n.fi\n", roff(command.footer));
  for (const CommandInfo& each : command.commands) add_command(each, page);
}

// ---- completion ---------------------------------------------------------------------------------

/// In single quotes of a shell.
std::string quoted(const std::string& text) {
  std::string safe = "'";
  for (const char c : text) safe += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return safe + "'";
}

std::vector<std::string> words_of(const CommandInfo& command) {
  std::vector<std::string> words;
  for (const CommandInfo& each : command.commands)
    words.push_back(each.name.substr(each.name.rfind(' ') + 1));
  return words;
}

std::vector<std::string> names_of(const CommandInfo& command) {
  std::vector<std::string> names;
  for (const OptionInfo& option : command.options) {
    if (!option.is_positional) names.insert(names.end(), option.names.begin(), option.names.end());
  }
  return names;
}

void flatten(const CommandInfo& command, std::vector<const CommandInfo*>& all) {
  all.push_back(&command);
  for (const CommandInfo& each : command.commands) flatten(each, all);
}

/// The lines of both shells that find out which command the words before this one name, and offer
/// the choices of an option behind it. open: what begins an arm of a `case`. offer: the line that
/// offers choices, in a shell's words.
std::string walk_text(const std::vector<const CommandInfo*>& commands, const std::string& open,
                      const std::function<std::string(const std::string& choices)>& offer) {
  std::vector<std::string> steps;
  std::string choices;
  for (const CommandInfo* command : commands) {
    for (const CommandInfo& each : command->commands) steps.push_back(quoted(each.name));
    for (const OptionInfo& option : command->options) {
      if (option.choices.empty()) continue;
      std::vector<std::string> arms;
      for (const std::string& each : option.names)
        arms.push_back(quoted(command->name + " " + each));
      choices += fmt::format("    {}{}) {}; return ;;\n", open, fmt::join(arms, "|"),
                             offer(fmt::format("{}", fmt::join(option.choices, " "))));
    }
  }
  std::string text;
  if (!steps.empty())
    text = fmt::format("    case \"$at $word\" in\n      {}{}) at=\"$at $word\" ;;\n    esac\n",
                       open, fmt::join(steps, "|"));
  return text + "    :\n  done\n  case \"$at $before\" in\n" + choices +
         "  esac\n  case \"$at\" in\n";
}

/// What the first line of a text says, to its first sentence.
std::string brief(const std::string& text) {
  return text.substr(0, std::min(text.find('\n'), text.find(';')));
}

std::string bash_script(const std::string& name, const std::vector<const CommandInfo*>& commands) {
  std::string script = fmt::format(R"(# bash completion of {0}, to be sourced
_{0}() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} at={0} word
  local commands= options=
  COMPREPLY=()
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
)",
                                   name);
  script += walk_text(commands, "", [](const std::string& choices) {
    return fmt::format("COMPREPLY=($(compgen -W {} -- \"$current\"))", quoted(choices));
  });
  for (const CommandInfo* command : commands) {
    script += fmt::format("    {}) commands={} options={} ;;\n", quoted(command->name),
                          quoted(fmt::format("{}", fmt::join(words_of(*command), " "))),
                          quoted(fmt::format("{}", fmt::join(names_of(*command), " "))));
  }
  script += R"(  esac
  if [[ $current == -* ]]; then
    COMPREPLY=($(compgen -W "$options" -- "$current"))
  elif [[ -n $commands ]]; then
    COMPREPLY=($(compgen -W "$commands" -- "$current"))
  fi
}
)";
  return script + fmt::format("complete -o default -F _{0} {0}\n", name);
}

/// "name:what it is" of _describe, in quotes.
std::string described(const std::string& name, const std::string& about) {
  std::string safe;
  for (const char c : name) safe += c == ':' ? std::string("\\:") : std::string(1, c);
  return quoted(safe + ":" + brief(about));
}

std::string zsh_script(const std::string& name, const std::vector<const CommandInfo*>& commands) {
  std::string script = fmt::format(R"(#compdef {0}
# zsh completion of {0}: a file _{0} in a folder of fpath
_{0}() {{
  local at={0} word before=${{words[CURRENT-1]}}
  local -a commands options
  for word in ${{words[2,CURRENT-1]}}; do
)",
                                   name);
  script +=
      walk_text(commands, "(", [](const std::string& choices) { return "compadd -- " + choices; });
  for (const CommandInfo* command : commands) {
    std::vector<std::string> words, options;
    for (const CommandInfo& each : command->commands)
      words.push_back(described(each.name.substr(each.name.rfind(' ') + 1), each.about));
    for (const OptionInfo& option : command->options) {
      if (option.is_positional) continue;
      for (const std::string& each : option.names) options.push_back(described(each, option.about));
    }
    script += fmt::format("    ({})\n      commands=({})\n      options=({}) ;;\n",
                          quoted(command->name), fmt::join(words, " "), fmt::join(options, " "));
  }
  script += fmt::format(R"(  esac
  if [[ $PREFIX == -* ]]; then
    _describe option options
  elif (( ${{#commands}} )); then
    _describe command commands
  else
    _files
  fi
}}
if [[ $zsh_eval_context[-1] == loadautofunc ]]; then
  _{0} "$@"
else
  compdef _{0} {0}
fi
)",
                        name);
  return script;
}

}  // namespace

std::string manual_page(const CommandInfo& program) {
  std::string title = program.name;
  std::ranges::transform(title, title.begin(), [](unsigned char c) { return std::toupper(c); });
  std::string page =
      fmt::format(".TH {} 1 \"\" Baton\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n.B {}\n[OPTIONS]{}\n",
                  roff(title), roff(program.name), roff(brief(program.about)), roff(program.name),
                  program.commands.empty() ? "" : " COMMAND");
  page += ".SH OPTIONS\n";
  for (const OptionInfo& option : program.options) page += option_text(option);
  if (!program.commands.empty()) page += ".SH COMMANDS\n";
  for (const CommandInfo& command : program.commands) add_command(command, page);
  if (!program.footer.empty())
    page += fmt::format(".SH NOTES\n.nf\n{}\n.fi\n", roff(program.footer));
  std::map<std::string, std::vector<std::string>> options;
  add_variables(program, options);
  std::map<std::string, std::string> variables = {
      {"BATON_LOG", "the least of trace, debug, info, warn, error, off that is logged"}};
  for (const auto& [variable, of] : options)
    variables[variable] = "stands in for " + of.front().substr(of.front().rfind(' ') + 1);
  page +=
      ".SH ENVIRONMENT\nWhat is typed goes before the environment, and that before the files "
      "below.\n";
  for (const auto& [variable, about] : variables)
    page += fmt::format(".TP\n.B {}\n{}\n", roff(variable), roff(about));
  page += fmt::format(
      ".SH FILES\n~/.config/baton/{0}.conf goes before /etc/baton/{0}.conf: lines NAME=VALUE, with "
      "names "
      "of the environment.\n",
      roff(program.name));
  return page;
}

std::vector<std::string> completion_shells() { return {"bash", "zsh"}; }

std::string completion_script(const CommandInfo& program, const std::string& shell) {
  std::vector<const CommandInfo*> commands;
  flatten(program, commands);
  return shell == "zsh" ? zsh_script(program.name, commands) : bash_script(program.name, commands);
}

void print_page(const std::string& page) { fmt::print("{}", page); }

}  // namespace baton
