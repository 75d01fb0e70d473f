#include "jobs/study/study_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "common/base/limits.h"
#include "common/base/suggest.h"
#include "common/job/text/job_json_text.h"

namespace baton {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxShownBytes = 60;
constexpr std::size_t kMaxNameBytes = 30;  // scene, method and budget together name a job

const json& empty_object() {
  static const json kEmpty = json::object();
  return kEmpty;
}
const json& empty_list() {
  static const json kEmpty = json::array();
  return kEmpty;
}

/// A value as faults show it.
std::string shown(const json* value) {
  if (value == nullptr) return "none";
  const std::string text = value->dump();
  return text.size() <= kMaxShownBytes ? text : text.substr(0, kMaxShownBytes) + "...";
}

}  // namespace

void StudyFaults::add(const std::string& path, const std::string& message) {
  add_line(fmt::format("{}: {}: {}", name_, path, message));
}

void StudyFaults::add_line(const std::string& line) {
  if (lines_.size() >= limits::kMaxFaultsReported) return;
  if (std::find(lines_.begin(), lines_.end(), line) == lines_.end()) lines_.push_back(line);
}

std::string StudyFaults::text() const { return fmt::format("{}", fmt::join(lines_, "\n")); }

StudyObject::StudyObject(const json& object, std::string path, StudyFaults& faults)
    : json_(object.is_object() ? &object : &empty_object()),
      path_(std::move(path)),
      faults_(faults) {
  if (!object.is_object()) faults_.add(path_, "expected an object, got " + shown(&object));
}

std::string StudyObject::name(const char* key) {
  const json* found = find(key);
  const std::string* text = found != nullptr ? found->get_ptr<const std::string*>() : nullptr;
  const bool good = text != nullptr && !text->empty() && text->size() <= kMaxNameBytes &&
                    text->find_first_of("/\",\n") == std::string::npos && text->front() != '.';
  if (good) return *text;
  faults_.add(path_of(key),
              fmt::format("expected a name of 1 to {} bytes without '/', '\"' and ',', got {}",
                          kMaxNameBytes, shown(found)));
  return "";
}

std::filesystem::path StudyObject::file(const char* key,
                                        const std::filesystem::path& base_directory) {
  const std::string given = text(key);
  if (given.empty()) {
    faults_.add(path_of(key), "expected the path of a file, got none");
    return {};
  }
  return (base_directory / given).lexically_normal();
}

int StudyObject::integer(const char* key, int otherwise, int min, int max) {
  const json* found = find(key);
  if (found == nullptr) return otherwise;
  if (found->is_number_integer() && found->get<double>() >= min && found->get<double>() <= max)
    return found->get<int>();
  faults_.add(path_of(key),
              fmt::format("expected an integer in [{}, {}], got {}", min, max, shown(found)));
  return otherwise;
}

std::string StudyObject::text(const char* key) {
  const json* found = find(key);
  if (found == nullptr) return "";
  const std::string* value = found->get_ptr<const std::string*>();
  if (value != nullptr && !value->empty() && value->size() <= limits::kMaxTextLength) return *value;
  faults_.add(path_of(key), "expected a text, got " + shown(found));
  return "";
}

json StudyObject::patch(const char* key) {
  const json* found = find(key);
  if (found == nullptr) return empty_object();
  if (found->is_object()) return *found;
  faults_.add(path_of(key),
              "expected an object to merge into the job (RFC 7396), got " + shown(found));
  return empty_object();
}

const json& StudyObject::list(const char* key, bool required) {
  const json* found = find(key);
  if (found == nullptr && !required) return empty_list();
  if (found != nullptr && found->is_array() && !found->empty()) return *found;
  faults_.add(path_of(key), "expected a list with at least one element, got " + shown(found));
  return empty_list();
}

void StudyObject::finish() {
  for (const auto& [key, value] : json_->items()) {
    if (std::find(keys_.begin(), keys_.end(), key) == keys_.end())
      faults_.add(json_path_key(path_, key), "unknown key" + suggestion(key, keys_));
  }
}

std::string StudyObject::path_of(const char* key) const { return json_path_key(path_, key); }

const json* StudyObject::find(const char* key) {
  keys_.emplace_back(key);
  const auto found = json_->find(key);
  return found == json_->end() ? nullptr : &*found;
}

}  // namespace baton
