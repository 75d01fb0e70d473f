#include "common/job/text/job_json_overrides.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "common/job/text/job_json_text.h"

namespace baton {
namespace {

using nlohmann::json;

/// JSON, where .5 may stand for 0.5; or else the text itself.
json value_of(const std::string& text) {
  Result<json> value = parse_json_text((text.starts_with('.') ? "0" : "") + text, "");
  return value ? std::move(value).value() : json(text);
}

std::size_t index_of(const std::string& digits) {
  std::size_t index = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), index);
  return index;
}

}  // namespace

JobOverrides::JobOverrides(const std::vector<JobOverride>& overrides) {
  for (const JobOverride& said : overrides) {
    Entry entry{said.path, steps_of(said.path), value_of(said.value), said.option, {}};
    if (!entry.steps.empty()) entry.path = "$";
    for (const Step& step : entry.steps) {
      entry.path = step.is_index ? json_path_index(entry.path, index_of(step.key))
                                 : json_path_key(entry.path, step.key);
    }
    entries_.push_back(std::move(entry));
  }
}

/// `image.width`, `objects[0].mesh`, `materials["my gold"].color`; a `$.` before it may be left
/// out. Empty: no path.
std::vector<JobOverrides::Step> JobOverrides::steps_of(const std::string& path) {
  std::string_view rest = path;
  if (rest.starts_with('$')) rest.remove_prefix(1);
  if (rest.starts_with('.')) rest.remove_prefix(1);
  std::vector<Step> steps;
  while (!rest.empty()) {
    const bool quoted = rest.starts_with("[\""), bracket = rest.starts_with('[');
    const std::size_t start = quoted ? 2 : bracket ? 1 : 0;
    const std::size_t end = quoted    ? rest.find("\"]", start)
                            : bracket ? rest.find(']')
                                      : std::min(rest.find_first_of(".["), rest.size());
    if (end == rest.npos || end == start) return {};
    const std::string key(rest.substr(start, end - start));
    const bool is_index = bracket && !quoted;
    if (is_index && (key.size() > 9 || key.find_first_not_of("0123456789") != key.npos)) return {};
    steps.push_back({key, is_index});
    rest.remove_prefix(std::min(end + start, rest.size()));
    if (rest.starts_with('.')) {
      rest.remove_prefix(1);
      if (rest.empty()) return {};
    } else if (!rest.empty() && rest[0] != '[') {
      return {};
    }
  }
  return steps;
}

void JobOverrides::apply(const std::string& path, json& value) {
  for (Entry& entry : entries_) {
    std::string at = "$", made;
    json* place = at == path ? &value : nullptr;
    bool blocked = entry.steps.empty() || !entry.made.empty();
    for (const Step& step : entry.steps) {
      at = step.is_index ? json_path_index(at, index_of(step.key)) : json_path_key(at, step.key);
      if (place == nullptr) {
        if (at == path) place = &value;
        continue;
      }
      if (step.is_index) {
        blocked = blocked || !place->is_array() || index_of(step.key) >= place->size();
        if (!blocked) place = &(*place)[index_of(step.key)];
      } else {
        blocked = blocked || !(place->is_object() || place->is_null());
        if (blocked) break;
        if (made.empty() && !place->contains(step.key)) made = at;
        place = &(*place)[step.key];
      }
      if (blocked) break;
    }
    if (blocked || place == nullptr || place == &value) continue;
    *place = entry.value;
    entry.made = made.empty() ? entry.path : made;
  }
}

std::string JobOverrides::source_of(const std::string& path) const {
  // The last one said counts.
  const auto found = std::find_if(entries_.rbegin(), entries_.rend(), [&](const Entry& entry) {
    return !entry.made.empty() && path.starts_with(entry.made) &&
           (path.size() == entry.made.size() || path[entry.made.size()] == '.' ||
            path[entry.made.size()] == '[');
  });
  return found == entries_.rend() ? "" : found->option;
}

std::vector<std::string> JobOverrides::faults() const {
  std::vector<std::string> faults;
  for (const Entry& entry : entries_) {
    if (entry.steps.empty()) {
      faults.push_back(
          fmt::format("{}: {}: expected the path of a value, such as sampling.numParticles or "
                      "scene.objects[0].fitHeight",
                      entry.option, entry.path));
    } else if (entry.made.empty()) {
      faults.push_back(fmt::format(
          "{}: {}: expected a key of an object or the index of an element of a list that the job "
          "has",
          entry.option, entry.path));
    }
  }
  return faults;
}

}  // namespace baton
