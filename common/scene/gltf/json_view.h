#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace baton::gltf {

/// The first fault of a file, by its place in the JSON.
using Fault = std::optional<std::string>;

/// A value of a glTF's JSON and its place. Reading goes on after a fault, with defaults: the first
/// fault is kept, and what was read is then thrown away. A value that is not there reads as its
/// default.
class JsonView {
 public:
  JsonView(const nlohmann::json* value, std::string place, Fault& fault)
      : value_(value), place_(std::move(place)), fault_(&fault) {}

  explicit operator bool() const { return value_ != nullptr; }
  const std::string& place() const { return place_; }
  bool has(const char* key) const { return find(key) != nullptr; }
  /// Members of an object.
  std::size_t num_members() const {
    return value_ != nullptr && value_->is_object() ? value_->size() : 0;
  }

  /// A member of an object; nothing where it is not there.
  JsonView at(const char* key) const;
  /// Calls body(element) for each element of a list that may not be there.
  template <class Body>
  void each(const char* key, const Body& body) const {
    const JsonView list = at(key);
    if (!list.is_list()) return;
    for (std::size_t i = 0; i < list.value_->size(); ++i) body(list.element(i));
  }

  /// Calls body(name) for each member of an object.
  template <class Body>
  void each_member(const Body& body) const {
    if (value_ == nullptr || !value_->is_object()) return;
    for (const auto& item : value_->items()) body(item.key());
  }

  std::string text(const char* key) const;
  /// A text as a job may say it: with spaces for control characters, and cut where it is longer.
  std::string name(const char* key) const;
  bool boolean(const char* key, bool otherwise = false) const;
  double number(const char* key, double otherwise, double min, double max) const;
  /// Bytes, counts: [0, 2^53].
  std::uint64_t size(const char* key, std::uint64_t otherwise = 0) const;
  /// An index below `count`; -1 where the key is missing.
  int index(const char* key, std::size_t count) const;
  /// The same where it must be there.
  int required_index(const char* key, std::size_t count) const;
  /// This value itself as a text, as an index.
  std::string as_text() const;
  int as_index(std::size_t count) const;
  /// A list of finite numbers; empty where the key is missing or at fault.
  std::vector<double> all_numbers(const char* key) const;
  /// As many finite numbers as `values` has; false where the key is missing or at fault.
  bool numbers(const char* key, std::span<double> values) const;

  /// The same value, whose faults go to `fault`.
  JsonView apart(Fault& fault) const { return {value_, place_, fault}; }

  void fail(const std::string& what) const {
    if (!*fault_) *fault_ = place_ + ": " + what;
  }

 private:
  const nlohmann::json* find(const char* key) const;
  JsonView element(std::size_t i) const {
    return {&(*value_)[i], place_ + "[" + std::to_string(i) + "]", *fault_};
  }
  bool is_list() const;

  const nlohmann::json* value_;
  std::string place_;
  Fault* fault_;
};

}  // namespace baton::gltf
