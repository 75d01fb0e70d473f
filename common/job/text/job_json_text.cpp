#include "common/job/text/job_json_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <vector>

#include "common/base/legible.h"
#include "common/base/limits.h"

namespace baton {
namespace {

using nlohmann::json;

/// Bytes of a message, of which a token is a part.
constexpr std::size_t kMostShown = 300;

/// A text of anybody's as a message may have it.
std::string shown_part(const std::string& text) {
  return text.size() <= kMostShown ? legible_line(text)
                                   : legible_line(text.substr(0, kMostShown)) + "...";
}

/// The parser's message without its own prefixes: "line 3, column 7: syntax error ...".
std::string plain_message(std::string message) {
  for (const std::string_view prefix : {"] ", "parse error at "}) {
    const std::size_t at = message.find(prefix);
    if (at != std::string::npos) message.erase(0, at + prefix.size());
  }
  return shown_part(message);
}

/// Follows the parser through a document for what it lets pass, keys given twice and deep nesting,
/// without making values of it: a parser that makes them and asks about each takes time with the
/// square of an object's members.
class StructureCheck : public nlohmann::json_sax<json> {
 public:
  bool null() override { return value(); }
  bool boolean(bool) override { return value(); }
  bool number_integer(number_integer_t) override { return value(); }
  bool number_unsigned(number_unsigned_t) override { return value(); }
  bool number_float(number_float_t, const string_t&) override { return value(); }
  bool string(string_t&) override { return value(); }
  bool binary(binary_t&) override { return value(); }
  bool start_object(std::size_t) override { return start(false); }
  bool start_array(std::size_t) override { return start(true); }
  bool end_object() override { return end(); }
  bool end_array() override { return end(); }
  bool key(string_t& key) override {
    Level& level = levels_.back();
    level.key = key;
    if (level.keys.insert(key).second || faults_.size() >= limits::kMaxFaultsReported) return true;
    faults_.push_back(
        fmt::format("{}: expected one value, got the key twice", json_path_key(level.path, key)));
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const json::exception& error) override {
    faults_ = {plain_message(error.what())};
    return false;
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

  bool value() {
    if (!levels_.empty()) ++levels_.back().index;
    return true;
  }
  bool start(bool is_array) {
    if (levels_.size() >= limits::kMaxJsonDepth) {
      faults_.push_back(fmt::format("expected at most {} levels, got more", limits::kMaxJsonDepth));
      return false;
    }
    std::string path = next_path();
    value();
    levels_.push_back({is_array, std::move(path), {}, 0, {}});
    return true;
  }
  bool end() {
    levels_.pop_back();
    return true;
  }
  /// Path of the value that begins here.
  std::string next_path() const {
    if (levels_.empty()) return "$";
    const Level& level = levels_.back();
    return level.array ? json_path_index(level.path, level.index)
                       : json_path_key(level.path, level.key);
  }

  std::vector<Level> levels_;
  std::vector<std::string> faults_;
};

}  // namespace

Result<json> parse_json_text(std::string_view text, const std::string& name) {
  StructureCheck check;
  json::sax_parse(text, &check);
  if (check.faults().empty()) return json::parse(text);

  std::string message;
  for (const std::string& fault : check.faults()) {
    message += fmt::format("{}{}: {}", message.empty() ? "" : "\n", name, fault);
  }
  return Error{ErrorKind::bad_input, message};
}

std::string json_path_key(const std::string& path, std::string_view key) {
  if (key.size() > limits::kMaxTextLength)
    return fmt::format("{}[\"{}\"]", path, shown_part(std::string(key)));
  const bool plain = !key.empty() && std::all_of(key.begin(), key.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c >= 0x80;
  });
  return plain ? fmt::format("{}.{}", path, key) : fmt::format("{}[\"{}\"]", path, key);
}

std::string json_path_index(const std::string& path, std::size_t index) {
  return fmt::format("{}[{}]", path, index);
}

}  // namespace baton
