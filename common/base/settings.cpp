#include "common/base/settings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>

#include "common/base/files.h"
#include "common/base/legible.h"
#include "common/base/suggest.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxFileBytes = 1 << 16;
constexpr const char* kLogLevel = "BATON_LOG";

std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  return value != nullptr ? value : "";
}

std::string trimmed(const std::string& text) {
  const char* const blanks = " \t\r";
  const std::size_t from = text.find_first_not_of(blanks);
  if (from == std::string::npos) return {};
  return text.substr(from, text.find_last_not_of(blanks) - from + 1);
}

/// What it says is done with this user's rights.
Status expect_own(const std::string& file) {
  struct stat found {};
  if (::stat(file.c_str(), &found) != 0) return {};
  const bool is_own = found.st_uid == ::geteuid() || found.st_uid == 0;
  if (is_own && (found.st_mode & (S_IWGRP | S_IWOTH)) == 0) return {};
  return Error{ErrorKind::bad_input,
               file +
                   ": others may write it: expected a file of root or of this user that only "
                   "its owner writes (chmod go-w)"};
}

Status take_file(const std::string& file, std::map<std::string, Setting>& settings) {
  std::error_code error;
  if (!fs::exists(file, error)) return {};
  BATON_TRY(expect_own(file));
  BATON_ASSIGN(const std::string text, read_text_file(file, kMaxFileBytes));
  std::vector<std::string> names;
  for (const auto& [name, setting] : settings) names.push_back(name);
  std::map<std::string, int> seen;
  int number = 0;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t to = std::min(text.find('\n', from), text.size());
    const std::string line = trimmed(text.substr(from, to - from));
    from = to + 1;
    const std::string place = fmt::format("{}:{}", file, ++number);
    if (line.empty() || line[0] == '#') continue;
    const auto fault = [&](const std::string& what) {
      return Error{ErrorKind::bad_input, place + ": " + what};
    };
    const std::size_t equals = line.find('=');
    if (equals == std::string::npos || legible_line(line) != line)
      return fault("expected NAME=VALUE, got '" + legible_line(line).substr(0, 80) + "'");
    const std::string name = trimmed(line.substr(0, equals));
    std::string value = trimmed(line.substr(equals + 1));
    if (value.size() > 1 && (value[0] == '"' || value[0] == '\'') && value.back() == value[0])
      value = value.substr(1, value.size() - 2);
    const auto setting = settings.find(name);
    if (setting == settings.end())
      return fault(name + ": no such setting" + suggestion(name, names));
    if (const auto [before, is_new] = seen.emplace(name, number); !is_new)
      return fault(fmt::format("{}: set already in line {}", name, before->second));
    if (setting->second.from != "environment") {
      setting->second.value = value;
      setting->second.from = place;
    }
  }
  return {};
}

}  // namespace

std::vector<std::string> settings_files(const std::string& program) {
  const std::string name = program + ".conf";
  if (const char* const folder = std::getenv("BATON_CONFIG_DIR"))
    return *folder != '\0' ? std::vector{(fs::path(folder) / name).string()}
                           : std::vector<std::string>();
  std::vector<std::string> files = {"/etc/baton/" + name};
  const std::string own = variable("XDG_CONFIG_HOME"), home = variable("HOME");
  if (!own.empty()) {
    files.push_back((fs::path(own) / "baton" / name).string());
  } else if (!home.empty()) {
    files.push_back((fs::path(home) / ".config" / "baton" / name).string());
  }
  return files;
}

Result<std::vector<Setting>> take_settings(const CommandInfo& program) {
  std::map<std::string, std::vector<std::string>> variables = {{kLogLevel, {}}};
  add_variables(program, variables);
  std::map<std::string, Setting> settings;
  for (auto& [name, options] : variables)
    settings[name] = {.name = name, .value = {}, .from = {}, .options = std::move(options)};
  for (auto& [name, setting] : settings) {
    const char* const value = std::getenv(name.c_str());
    if (value == nullptr) continue;
    setting.value = value;
    setting.from = "environment";
  }
  for (const std::string& file : settings_files(program.name)) BATON_TRY(take_file(file, settings));
  std::vector<Setting> all;
  for (auto& [name, setting] : settings) {
    if (!setting.from.empty()) ::setenv(name.c_str(), setting.value.c_str(), 0);
    all.push_back(std::move(setting));
  }
  return all;
}

std::string settings_text(const std::vector<Setting>& settings, const std::string& program) {
  std::string text;
  for (const Setting& setting : settings) {
    const std::string from = setting.from.empty() ? "not set" : setting.from;
    text += fmt::format("{:<18} {:<32} {}\n", setting.name, legible_line(setting.value), from);
  }
  for (const std::string& file : settings_files(program)) {
    std::error_code error;
    text += fmt::format("{}: {}\n", file, fs::exists(file, error) ? "read" : "not there");
  }
  return text;
}

}  // namespace baton
