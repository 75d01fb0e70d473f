#include "common/job/text/job_json_writer.h"

#include <cmath>

namespace baton {

using nlohmann::ordered_json;

bool JobJsonWriter::boolean(Key key, bool& value) {
  root_[key.name] = value;
  return true;
}

bool JobJsonWriter::integer(Key key, int& value, int, int) {
  root_[key.name] = value;
  return true;
}

bool JobJsonWriter::integer(Key key, std::uint64_t& value) {
  root_[key.name] = value;
  return true;
}

bool JobJsonWriter::number(Key key, double& value, NumberRange) {
  if (std::isnan(value)) return false;
  root_[key.name] = value;
  return true;
}

bool JobJsonWriter::numbers(Key key, std::span<double> values, NumberRange, bool) {
  if (std::isnan(values.front())) return false;
  root_[key.name] = std::vector<double>(values.begin(), values.end());
  return true;
}

bool JobJsonWriter::text(Key key, std::string& value) {
  if (value.empty()) return false;
  root_[key.name] = value;
  return true;
}

bool JobJsonWriter::path(Key key, std::string& value) { return text(key, value); }

bool JobJsonWriter::word(Key key, std::string& value, std::span<const std::string_view>) {
  return text(key, value);
}

bool JobJsonWriter::words(Key key, std::vector<std::string>& values,
                          std::span<const std::string_view>) {
  root_[key.name] = values;
  return true;
}

bool JobJsonWriter::texts(Key key, std::map<std::string, std::string>& values, int) {
  root_[key.name] = ordered_json(values);
  return true;
}

bool JobJsonWriter::object(Key key, const Body& body, ObjectForm form) {
  if (!form.present) return false;
  root_[key.name] = nested(body);
  return true;
}

bool JobJsonWriter::list_of(Key key, std::size_t count, int, const IndexBody&,
                            const IndexBody& body) {
  ordered_json list = ordered_json::array();
  for (std::size_t i = 0; i < count; ++i) list.push_back(nested([&] { body(i); }));
  root_[key.name] = std::move(list);
  return true;
}

bool JobJsonWriter::named_of(Key key, const std::vector<std::string>& names, int,
                             const NameBody& body, ObjectForm form) {
  if (names.empty() && !form.present) return false;
  ordered_json objects = ordered_json::object();
  for (const std::string& name : names) objects[name] = nested([&] { body(name); });
  root_[key.name] = std::move(objects);
  return true;
}

ordered_json JobJsonWriter::nested(const Body& body) {
  ordered_json outer = ordered_json::object();
  std::swap(root_, outer);
  body();
  std::swap(root_, outer);
  return outer;
}

}  // namespace baton
