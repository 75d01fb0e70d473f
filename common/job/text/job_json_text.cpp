#include "common/job/text/job_json_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <vector>

#include "common/base/limits.h"

namespace baton {
namespace {

using nlohmann::json;
using Event = json::parse_event_t;

/// Follows the parser through a document for what it lets pass: keys given twice and deep nesting.
class StructureCheck {
 public:
  /// Returns whether to keep the value: nothing below kMaxJsonDepth is.
  bool operator()(int depth, Event event, const json& value) {
    if (depth > limits::kMaxJsonDepth) {
      if (!too_deep_)
        faults_.push_back(
            fmt::format("expected at most {} levels, got more", limits::kMaxJsonDepth));
      too_deep_ = true;
      return false;
    }
    switch (event) {
      case Event::object_start:
      case Event::array_start: {
        std::string path = next_path();
        levels_.push_back({event == Event::array_start, std::move(path), {}, 0, {}});
        break;
      }
      case Event::object_end:
      case Event::array_end:
        levels_.pop_back();
        break;
      case Event::key:
        add_key(value.get<std::string>());
        break;
      case Event::value:
        next_path();
        break;
    }
    return true;
  }

  const std::vector<std::string>& faults() const { return faults_; }

 private:
  struct Level {
    bool array = false;
    std::string path;
    std::string key;
    std::size_t index = 0;
    std::set<std::string> keys;
  };

  /// Path of the value that begins here.
  std::string next_path() {
    if (levels_.empty()) return "$";
    Level& level = levels_.back();
    return level.array ? json_path_index(level.path, level.index++)
                       : json_path_key(level.path, level.key);
  }

  void add_key(const std::string& key) {
    Level& level = levels_.back();
    level.key = key;
    if (level.keys.insert(key).second || faults_.size() >= limits::kMaxFaultsReported) return;
    faults_.push_back(
        fmt::format("{}: expected one value, got the key twice", json_path_key(level.path, key)));
  }

  std::vector<Level> levels_;
  std::vector<std::string> faults_;
  bool too_deep_ = false;
};

/// The parser's message without its own prefixes: "line 3, column 7: syntax error ...".
std::string plain_message(std::string message) {
  for (const std::string_view prefix : {"] ", "parse error at "}) {
    const std::size_t at = message.find(prefix);
    if (at != std::string::npos) message.erase(0, at + prefix.size());
  }
  return message;
}

}  // namespace

Result<json> parse_json_text(std::string_view text, const std::string& name) {
  StructureCheck check;
  json value;
  try {
    value = json::parse(
        text, [&](int depth, Event event, json& parsed) { return check(depth, event, parsed); });
  } catch (const json::exception& error) {
    return Error{ErrorKind::bad_input, fmt::format("{}: {}", name, plain_message(error.what()))};
  }
  if (check.faults().empty()) return value;

  std::string message;
  for (const std::string& fault : check.faults()) {
    message += fmt::format("{}{}: {}", message.empty() ? "" : "\n", name, fault);
  }
  return Error{ErrorKind::bad_input, message};
}

std::string json_path_key(const std::string& path, std::string_view key) {
  const bool plain = !key.empty() && std::all_of(key.begin(), key.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c >= 0x80;
  });
  return plain ? fmt::format("{}.{}", path, key) : fmt::format("{}[\"{}\"]", path, key);
}

std::string json_path_index(const std::string& path, std::size_t index) {
  return fmt::format("{}[{}]", path, index);
}

}  // namespace baton
