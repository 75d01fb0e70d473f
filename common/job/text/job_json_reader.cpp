#include "common/job/text/job_json_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "common/base/files.h"
#include "common/base/legible.h"
#include "common/base/limits.h"
#include "common/base/suggest.h"
#include "common/job/text/job_json_text.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t kMaxShownBytes = 60;

/// A value as faults show it.
std::string shown(const json& value) {
  if (value.is_array()) return fmt::format("a list of {}", value.size());
  if (value.is_object()) return "an object";
  const std::string* text = value.get_ptr<const std::string*>();
  if (text != nullptr && text->size() > kMaxShownBytes)
    return fmt::format("a text of {} bytes", text->size());
  return value.dump();
}

std::string shown(NumberRange range) {
  return fmt::format("{}{}, {}{}", range.min_open ? '(' : '[', range.min, range.max,
                     range.max_open ? ')' : ']');
}

/// Whole numbers may be written 3 or 3.0, as in JSON Schema.
bool is_whole(const json& value) {
  return value.is_number_integer() ||
         (value.is_number() && std::floor(value.get<double>()) == value.get<double>());
}

bool has_control_character(const std::string& text) { return legible_line(text) != text; }

}  // namespace

JobJsonReader::JobJsonReader(std::string name, const fs::path& base_directory,
                             const std::vector<JobOverride>& overrides)
    : overrides_(overrides) {
  place_.file = std::move(name);
  std::error_code error;  // without a current folder, relative paths stay so and are not found
  place_.base_directory = fs::current_path(error) / base_directory;
}

Status JobJsonReader::read(json root, const Body& body) {
  Place place = place_;
  place.path = "$";
  place.file_root = place.path.size();
  overrides_.apply(place.path, root);
  visit(root, std::move(place), body, {});
  for (std::string& fault : overrides_.faults()) faults_.push_back(std::move(fault));
  if (faults_.empty()) return {};

  const std::size_t listed = std::min<std::size_t>(faults_.size(), limits::kMaxFaultsReported);
  std::string message =
      fmt::format("{}", fmt::join(faults_.begin(), faults_.begin() + listed, "\n"));
  if (listed < faults_.size())
    message += fmt::format("\n... and {} more faults", faults_.size() - listed);
  return Error{ErrorKind::bad_input, message};
}

bool JobJsonReader::boolean(Key key, bool& value) {
  const json* found = find(key);
  if (found == nullptr) return false;
  if (!found->is_boolean()) {
    fault(key.name, "true or false", shown(*found));
    return false;
  }
  value = found->get<bool>();
  return true;
}

bool JobJsonReader::integer(Key key, int& value, int min, int max) {
  const json* found = find(key);
  if (found == nullptr) return false;
  const NumberRange range{static_cast<double>(min), static_cast<double>(max)};
  if (!is_whole(*found) || !range.contains(found->get<double>())) {
    fault(key.name,
          min == max ? fmt::format("{}", min) : fmt::format("an integer in [{}, {}]", min, max),
          shown(*found));
    return false;
  }
  value = found->get<int>();
  return true;
}

bool JobJsonReader::integer(Key key, std::uint64_t& value) {
  const json* found = find(key);
  if (found == nullptr) return false;
  if (!found->is_number_unsigned()) {
    fault(key.name, fmt::format("an integer in [0, {}]", UINT64_MAX), shown(*found));
    return false;
  }
  value = found->get<std::uint64_t>();
  return true;
}

bool JobJsonReader::number(Key key, double& value, NumberRange range) {
  const json* found = find(key);
  return found != nullptr && read_number(path_of(key.name), *found, value, range);
}

bool JobJsonReader::numbers(Key key, std::span<double> values, NumberRange range, bool lone) {
  const json* found = find(key);
  if (found == nullptr) return false;
  const std::string path = path_of(key.name);

  // One number stands for all.
  if (lone && found->is_number()) {
    double value = 0;
    if (!read_number(path, *found, value, range)) return false;
    std::fill(values.begin(), values.end(), value);
    return true;
  }

  if (!found->is_array() || found->size() != values.size()) {
    fault(key.name,
          fmt::format("{}a list of {} numbers", lone ? "a number or " : "", values.size()),
          shown(*found));
    return false;
  }
  bool good = true;
  for (std::size_t i = 0; i < values.size(); ++i) {
    good = read_number(json_path_index(path, i), (*found)[i], values[i], range) && good;
  }
  return good;
}

bool JobJsonReader::text(Key key, std::string& value) {
  const json* found = find(key);
  return found != nullptr && read_text(path_of(key.name), *found, value);
}

bool JobJsonReader::path(Key key, std::string& value) {
  const bool given = text(key, value);
  if (!value.empty()) value = (place_.base_directory / value).lexically_normal().string();
  return given;
}

bool JobJsonReader::word(Key key, std::string& value, std::span<const std::string_view> words) {
  const json* found = find(key);
  return found != nullptr && read_word(path_of(key.name), *found, value, words);
}

bool JobJsonReader::words(Key key, std::vector<std::string>& values,
                          std::span<const std::string_view> words) {
  const json* found = find(key);
  if (found == nullptr) return false;
  if (!found->is_array()) {
    fault(key.name, fmt::format("a list of {}", fmt::join(words, ", ")), shown(*found));
    return false;
  }
  std::vector<std::string> chosen;
  bool good = true;
  for (const json& element : *found) {
    const std::string path =
        json_path_index(path_of(key.name), static_cast<std::size_t>(&element - &found->front()));
    std::string word;
    if (!read_word(path, element, word, words)) {
      good = false;
    } else if (std::find(chosen.begin(), chosen.end(), word) != chosen.end()) {
      fault_at(path, fmt::format("expected each word once, got \"{}\" twice", word));
      good = false;
    } else {
      chosen.push_back(word);
    }
  }
  if (good) values = std::move(chosen);
  return good;
}

bool JobJsonReader::texts(Key key, std::map<std::string, std::string>& values, int max_count) {
  const json* found = find(key);
  if (found == nullptr) return false;
  if (!found->is_object() || found->size() > static_cast<std::size_t>(max_count)) {
    fault(key.name, fmt::format("an object of at most {} texts", max_count), shown(*found));
    return false;
  }
  bool good = true;
  for (const auto& [name, value] : found->items()) {
    if (name.empty() || name.size() > limits::kMaxTextLength || has_control_character(name)) {
      fault(
          key.name,
          fmt::format("names of 1 to {} bytes without control characters", limits::kMaxTextLength),
          shown(json(name)));
      good = false;
      continue;
    }
    good = read_text(json_path_key(path_of(key.name), name), value, values[name]) && good;
  }
  return good;
}

bool JobJsonReader::object(Key key, const Body& body, ObjectForm form) {
  // An object that is not there and has defaults is one without keys.
  static const json kEmpty = json::object();
  const json* found = find(key);
  const bool empty = found == nullptr && key.presence == Key::Presence::optional && form.present;
  if (found == nullptr && !empty) return false;

  if (found != nullptr && form.file && found->is_string()) {
    visit_file(*found, path_of(key.name), body);
  } else {
    Place place = place_;
    place.path = path_of(key.name);
    visit(empty ? kEmpty : *found, std::move(place), body, form);
  }
  return !empty;
}

bool JobJsonReader::list_of(Key key, std::size_t, int max_count, const IndexBody& resize,
                            const IndexBody& body) {
  const json* found = find(key);
  if (found == nullptr) return false;
  if (!found->is_array() || found->size() > static_cast<std::size_t>(max_count)) {
    fault(key.name, fmt::format("a list of at most {} objects", max_count), shown(*found));
    return false;
  }
  resize(found->size());
  const std::string path = path_of(key.name);
  for (std::size_t i = 0; i < found->size(); ++i) {
    Place place = place_;
    place.path = json_path_index(path, i);
    visit((*found)[i], std::move(place), [&] { body(i); }, {});
  }
  return true;
}

bool JobJsonReader::named_of(Key key, const std::vector<std::string>&, int max_count,
                             const NameBody& body, ObjectForm form) {
  const json* found = find(key);
  if (found == nullptr) return false;
  if (!found->is_object() || found->size() > static_cast<std::size_t>(max_count)) {
    fault(key.name, fmt::format("an object of at most {} named objects", max_count), shown(*found));
    return false;
  }
  const std::string path = path_of(key.name);
  for (const auto& [name, value] : found->items()) {
    Place place = place_;
    place.path = json_path_key(path, name);
    visit(
        value, std::move(place), [&, &item = name] { body(item); }, form);
  }
  return true;
}

void JobJsonReader::fault(std::string_view key, const std::string& message) {
  fault_at(key.empty() ? place_.path : path_of(key), message);
}

bool JobJsonReader::explains_faults() const { return faults_.size() < limits::kMaxFaultsReported; }

// ---- the object being visited -------------------------------------------------------------------
const json* JobJsonReader::find(Key key) {
  place_.keys.emplace_back(key.name);
  const auto found = place_.object->find(key.name);
  if (found != place_.object->end()) return &*found;
  if (key.presence == Key::Presence::optional) defaulted_.insert(path_of(key.name));
  if (key.presence == Key::Presence::required) fault(key.name, "a value", "none");
  return nullptr;
}

std::string JobJsonReader::path_of(std::string_view key) const {
  return json_path_key(place_.path, key);
}

void JobJsonReader::fault_at(const std::string& path, const std::string& message) {
  const std::string option = overrides_.source_of(path);
  faults_.push_back(option.empty() ? fmt::format("{}: ${}: {}", place_.file,
                                                 path.substr(place_.file_root), message)
                                   : fmt::format("{}: {}: {}", option, path, message));
}

bool JobJsonReader::read_number(const std::string& path, const json& value, double& number,
                                NumberRange range) {
  if (!value.is_number() || !range.contains(value.get<double>())) {
    fault_at(path, fmt::format("expected a number in {}, got {}", shown(range), shown(value)));
    return false;
  }
  number = value.get<double>();
  return true;
}

bool JobJsonReader::read_text(const std::string& path, const json& value, std::string& text) {
  const std::string* found = value.get_ptr<const std::string*>();
  if (found == nullptr || found->empty() || found->size() > limits::kMaxTextLength ||
      has_control_character(*found)) {
    fault_at(path, value.is_number()
                       ? fmt::format("expected a text, such as \"{0}\", got {0}", shown(value))
                       : fmt::format(
                             "expected a text of 1 to {} bytes without control characters, got {}",
                             limits::kMaxTextLength, shown(value)));
    return false;
  }
  text = *found;
  return true;
}

bool JobJsonReader::read_word(const std::string& path, const json& value, std::string& word,
                              std::span<const std::string_view> words) {
  const std::string* found = value.get_ptr<const std::string*>();
  if (found != nullptr && std::find(words.begin(), words.end(), *found) != words.end()) {
    word = *found;
    return true;
  }
  const std::string near =
      found == nullptr || !explains_faults()
          ? ""
          : closest_word(*found, std::vector<std::string>(words.begin(), words.end()));
  fault_at(path, fmt::format("expected one of {}, got {}{}", fmt::join(words, ", "), shown(value),
                             near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)));
  return false;
}

void JobJsonReader::visit(const json& value, Place place, const Body& body, ObjectForm form) {
  // A lone text means an object with one key.
  json expanded;
  place.object = &value;
  if (form.shorthand != nullptr && value.is_string()) {
    expanded = {{form.shorthand, value}};
    place.object = &expanded;
  }
  place.keys.clear();
  std::swap(place_, place);
  if (place_.object->is_object()) {
    body();
    report_unknown_keys();
  } else {
    fault("", form.shorthand != nullptr ? "an object or a text" : "an object", shown(value));
  }
  std::swap(place_, place);
}

void JobJsonReader::visit_file(const json& value, const std::string& path, const Body& body) {
  if (!may_read_files_) return fault_at(path, "expected an object, got " + shown(value));
  std::string name;
  if (!read_text(path, value, name)) return;
  Place place = place_;
  const fs::path file = (place_.base_directory / name).lexically_normal();
  place.path = path;
  place.file_root = path.size();
  place.file = file.string();
  place.base_directory = file.parent_path();

  // The file's own troubles name it already.
  const Result<std::string> text = read_text_file(file, limits::kMaxJobFileBytes);
  if (!text) return faults_.push_back(text.error().message);
  Result<json> document = parse_json_text(*text, place.file);
  if (!document) return faults_.push_back(document.error().message);
  documents_.push_back(std::move(document).value());
  overrides_.apply(path, documents_.back());
  visit(documents_.back(), std::move(place), body, {});
}

void JobJsonReader::report_unknown_keys() {
  for (const auto& [key, value] : place_.object->items()) {
    if (std::find(place_.keys.begin(), place_.keys.end(), key) != place_.keys.end()) continue;
    fault(key, "unknown key" + (explains_faults() ? suggestion(key, place_.keys) : ""));
  }
}

}  // namespace baton
