#include "common/scene/gltf/json_view.h"

#include <algorithm>
#include <cmath>

#include "common/base/limits.h"

namespace baton::gltf {
namespace {

/// Bytes. What makes names different has room behind them.
constexpr std::size_t kLongestName = limits::kMaxTextLength - 96;
constexpr double kMaxSize = 9007199254740992.0;  // 2^53

bool is_whole(const nlohmann::json& value, double max) {
  if (!value.is_number()) return false;
  const double number = value.get<double>();
  return number >= 0 && number <= max && std::floor(number) == number;
}

std::string index_below(std::size_t count) {
  return count == 0 ? "an index into a list that is not empty"
                    : "an index below " + std::to_string(count);
}

}  // namespace

const nlohmann::json* JsonView::find(const char* key) const {
  if (value_ == nullptr || !value_->is_object()) return nullptr;
  const auto found = value_->find(key);
  return found == value_->end() ? nullptr : &*found;
}

JsonView JsonView::at(const char* key) const { return {find(key), place_ + "." + key, *fault_}; }

bool JsonView::is_list() const {
  if (value_ == nullptr) return false;
  if (!value_->is_array()) fail("expected a list");
  return value_->is_array();
}

std::string JsonView::text(const char* key) const {
  const JsonView member = at(key);
  return member ? member.as_text() : std::string();
}

std::string JsonView::name(const char* key) const {
  std::string name = text(key);
  if (name.size() > kLongestName) {
    std::size_t end = kLongestName;
    while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xC0) == 0x80) --end;  // whole UTF-8
    name.resize(end);
  }
  std::ranges::replace_if(
      name, [](unsigned char c) { return c < 0x20 || c == 0x7F; }, ' ');
  return name;
}

std::string JsonView::as_text() const {
  if (const auto* text = value_->get_ptr<const std::string*>()) return *text;
  fail("expected a text");
  return {};
}

bool JsonView::boolean(const char* key, bool otherwise) const {
  const JsonView member = at(key);
  if (!member) return otherwise;
  if (member.value_->is_boolean()) return member.value_->get<bool>();
  member.fail("expected true or false");
  return otherwise;
}

double JsonView::number(const char* key, double otherwise, double min, double max) const {
  const JsonView member = at(key);
  if (!member) return otherwise;
  const double value = member.value_->is_number() ? member.value_->get<double>() : min - 1;
  if (value >= min && value <= max) return value;
  member.fail("expected a number from " + nlohmann::json(min).dump() + " to " +
              nlohmann::json(max).dump() + ", got " + member.value_->dump().substr(0, 40));
  return otherwise;
}

std::uint64_t JsonView::size(const char* key, std::uint64_t otherwise) const {
  const JsonView member = at(key);
  if (!member) return otherwise;
  if (is_whole(*member.value_, kMaxSize))
    return static_cast<std::uint64_t>(member.value_->get<double>());
  member.fail("expected a whole number that is not negative");
  return otherwise;
}

int JsonView::as_index(std::size_t count) const {
  if (is_whole(*value_, static_cast<double>(count) - 1)) return value_->get<int>();
  fail("expected " + index_below(count) + ", got " + value_->dump().substr(0, 40));
  return -1;
}

int JsonView::index(const char* key, std::size_t count) const {
  const JsonView member = at(key);
  return member ? member.as_index(count) : -1;
}

int JsonView::required_index(const char* key, std::size_t count) const {
  if (!has(key)) at(key).fail("expected " + index_below(count) + ", got nothing");
  return index(key, count);
}

std::vector<double> JsonView::all_numbers(const char* key) const {
  const JsonView member = at(key);
  if (!member.is_list()) return {};
  std::vector<double> values(member.value_->size());
  numbers(key, values);
  return values;
}

bool JsonView::numbers(const char* key, std::span<double> values) const {
  const JsonView member = at(key);
  if (!member) return false;
  bool good = member.value_->is_array() && member.value_->size() == values.size();
  for (std::size_t i = 0; good && i < values.size(); ++i) {
    good = (*member.value_)[i].is_number();
    if (good) values[i] = (*member.value_)[i].get<double>();
    good = good && std::isfinite(values[i]);
  }
  if (!good) member.fail("expected " + std::to_string(values.size()) + " numbers");
  return good;
}

}  // namespace baton::gltf
